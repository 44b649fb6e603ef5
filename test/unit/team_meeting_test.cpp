// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include "understory/team/meeting.hpp"

namespace understory::team {
namespace {

Time at_s(double time_s) {
  return Time() + duration_from_seconds(time_s);
}

Peer mate_at(double x_m, bool in_contact) {
  Peer mate;
  mate.id = 1;
  mate.position_m = {x_m, 0.0, 1.0};
  mate.in_contact = in_contact;
  return mate;
}

// The vehicle itself hovers at the origin.
struct Silence {
  explicit Silence(double wait_s = 60.0) : meeting(config_with(wait_s)) {}

  static CoordinationConfig config_with(double wait_s) {
    CoordinationConfig config;
    config.meeting_wait_s = wait_s;
    return config;
  }
  void hear(double x_m, double time_s) { observe({mate_at(x_m, true)}, time_s); }
  void hear_nothing(double time_s) { observe({mate_at(0.0, false)}, time_s); }
  void observe(const Peers& peers, double time_s) {
    meeting.observe(peers, {0.0, 0.0, 1.0}, at_s(time_s));
  }

  Meeting meeting;
};

TEST(Meeting, IsWantedWithWhoWasLeavingAndHasBeenSilentForAMinute) {
  Silence silence;
  silence.hear(5.0, 0.0);
  silence.hear(14.0, 10.0);

  silence.hear_nothing(69.0);
  EXPECT_FALSE(silence.meeting.is_wanted());
  silence.hear_nothing(70.0);
  EXPECT_TRUE(silence.meeting.is_wanted());
}

TEST(Meeting, IsNotWantedWithWhoFellSilentNearBy) {
  Silence silence;
  silence.hear(14.0, 0.0);
  silence.hear(9.0, 10.0);

  silence.hear_nothing(500.0);

  EXPECT_FALSE(silence.meeting.is_wanted());
}

TEST(Meeting, IsNotWantedWithWhoIsInContactOrWasNeverHeard) {
  Silence silence;
  silence.observe({}, 500.0);
  EXPECT_FALSE(silence.meeting.is_wanted());
  silence.hear_nothing(550.0);  // others have heard it, or somebody did before this began
  EXPECT_FALSE(silence.meeting.is_wanted());
  silence.hear(14.0, 600.0);
  EXPECT_FALSE(silence.meeting.is_wanted());
}

TEST(Meeting, IsOverWhenTheOtherIsHeard) {
  Silence silence;
  silence.hear(14.0, 0.0);
  silence.hear_nothing(100.0);
  silence.meeting.wait(at_s(100.0));

  silence.hear(12.0, 120.0);

  EXPECT_FALSE(silence.meeting.is_wanted());
}

TEST(Meeting, IsOverAfterTheWaitAndNotWantedAgainUntilTheOtherWasHeard) {
  Silence silence(30.0);
  silence.hear(14.0, 0.0);
  for (const double time_s : {100.0, 129.0}) {
    silence.hear_nothing(time_s);
    EXPECT_TRUE(silence.meeting.is_wanted());
    silence.meeting.wait(at_s(time_s));
  }
  silence.hear_nothing(130.0);
  silence.meeting.wait(at_s(130.0));
  EXPECT_FALSE(silence.meeting.is_wanted());
  silence.hear_nothing(400.0);
  EXPECT_FALSE(silence.meeting.is_wanted());

  silence.hear(14.0, 500.0);
  silence.hear_nothing(600.0);

  EXPECT_TRUE(silence.meeting.is_wanted());
}

TEST(Meeting, WithoutAWaitNobodyMeets) {
  Silence silence(0.0);
  silence.hear(14.0, 0.0);

  silence.hear_nothing(100.0);

  EXPECT_FALSE(silence.meeting.is_wanted());
}

}  // namespace
}  // namespace understory::team
