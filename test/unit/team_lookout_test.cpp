// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include "understory/team/lookout.hpp"

namespace understory::team {
namespace {

const Vector3d kHere_m(0.0, 0.0, 1.0);

Time at_s(double time_s) {
  return Time() + duration_from_seconds(time_s);
}

TeamConfig team_of(int size) {
  TeamConfig config;
  config.size = size;
  return config;
}

Peer mate_at(int id, double x_m, bool in_contact, double heard_s = 0.0) {
  Peer mate;
  mate.heard_at = at_s(heard_s);
  mate.id = static_cast<std::uint8_t>(id);
  mate.position_m = {x_m, 0.0, 1.0};
  mate.in_contact = in_contact;
  return mate;
}

TEST(Lookout, IsWaryUntilEveryTeamMateIsHeard) {
  Lookout lookout(team_of(3));

  lookout.hear({}, kHere_m);
  EXPECT_TRUE(lookout.is_wary(at_s(0.0)));
  lookout.hear({mate_at(1, 3.0, true)}, kHere_m);
  EXPECT_TRUE(lookout.is_wary(at_s(0.0)));
  lookout.hear({mate_at(1, 3.0, true), mate_at(2, 6.0, true)}, kHere_m);
  EXPECT_FALSE(lookout.is_wary(at_s(0.0)));
}

TEST(Lookout, IsWaryOfWhoFellSilentNearByAndNotOfWhoIsOutOfRange) {
  Lookout lookout(team_of(2));

  lookout.hear({mate_at(1, 30.0, true)}, kHere_m);
  lookout.hear({mate_at(1, 30.0, false)}, kHere_m);
  EXPECT_FALSE(lookout.is_wary(at_s(0.0)));

  // It is back, and then it is not the range.
  lookout.hear({mate_at(1, 5.0, true, 9.0)}, kHere_m);
  lookout.hear({mate_at(1, 5.0, false, 9.0)}, kHere_m);
  EXPECT_TRUE(lookout.is_wary(at_s(0.0)));
}

// The vehicle itself moves on; where the other was when last heard counts from where this one was.
TEST(Lookout, WhoFellSilentNearByStaysSoHoweverFarOneFlies) {
  Lookout lookout(team_of(2));

  lookout.hear({mate_at(1, 5.0, true)}, kHere_m);
  lookout.hear({mate_at(1, 5.0, true)}, {-30.0, 0.0, 1.0});  // nothing new of it
  lookout.hear({mate_at(1, 5.0, false)}, {-60.0, 0.0, 1.0});

  EXPECT_TRUE(lookout.is_wary(at_s(0.0)));
}

TEST(Lookout, IsWaryForAWhileOfWhoIsSeenThoughItShouldBeOutOfRange) {
  Lookout lookout(team_of(2));
  lookout.hear({mate_at(1, 30.0, true)}, kHere_m);
  lookout.hear({mate_at(1, 30.0, false)}, kHere_m);

  lookout.see({{3.0, 0.0, 1.0}}, at_s(100.0));

  EXPECT_TRUE(lookout.is_wary(at_s(119.0)));
  EXPECT_FALSE(lookout.is_wary(at_s(121.0)));
  lookout.hear({mate_at(1, 5.0, true)}, kHere_m);
  EXPECT_FALSE(lookout.is_wary(at_s(101.0)));
}

TEST(Lookout, AloneOrSwitchedOffItDoesNothing) {
  TeamConfig off = team_of(2);
  off.separation.lookout = false;
  for (const TeamConfig& config : {team_of(1), off}) {
    Lookout lookout(config);
    lookout.hear({}, kHere_m);
    lookout.see({{3.0, 0.0, 1.0}}, at_s(1.0));

    EXPECT_FALSE(lookout.is_wary(at_s(0.0)));
    EXPECT_TRUE(lookout.movers(at_s(1.0)).empty());
  }
}

TEST(Lookout, WhatMovesIsNobodyWhileAllAreHeard) {
  Lookout lookout(team_of(2));
  lookout.hear({mate_at(1, 3.0, true)}, kHere_m);

  lookout.see({{3.0, 0.0, 1.0}}, at_s(1.0));

  EXPECT_TRUE(lookout.movers(at_s(1.0)).empty());
}

// Comes at 2 m/s from 4 m away; seen 15 times a second.
TEST(Lookout, WhoIsSeenToComeIsTrafficWhereItWillBe) {
  Lookout lookout(team_of(2));
  lookout.hear({}, kHere_m);
  double now_s = 0.0;
  for (int i = 0; i < 6; ++i) {
    now_s = i / 15.0;
    lookout.see({{4.0 - 2.0 * now_s, 0.0, 1.0}}, at_s(now_s));
  }

  const std::vector<Mover> movers = lookout.movers(at_s(now_s));

  ASSERT_EQ(movers.size(), 1U);
  EXPECT_NEAR(movers[0].position_m.x(), 4.0 - 2.0 * now_s, 1e-9);
  EXPECT_LT(movers[0].distance_m({1.0, 0.0, 1.0}, at_s(now_s)), 0.4);  // a second later
  EXPECT_GT(movers[0].distance_m({4.5, 0.0, 1.0}, at_s(now_s)), 1.0);  // behind it
  EXPECT_GT(movers[0].distance_m({2.0, 1.5, 1.0}, at_s(now_s)), 1.4);  // beside its way
}

TEST(Lookout, IsRememberedForThreeSeconds) {
  Lookout lookout(team_of(2));
  lookout.hear({}, kHere_m);
  lookout.see({{3.0, 0.0, 1.0}}, at_s(1.0));

  lookout.see({}, at_s(3.9));
  EXPECT_EQ(lookout.movers(at_s(3.9)).size(), 1U);
  lookout.see({}, at_s(4.1));
  EXPECT_TRUE(lookout.movers(at_s(4.1)).empty());
}

TEST(Lookout, TwoThatCrossAreTwo) {
  Lookout lookout(team_of(3));
  lookout.hear({}, kHere_m);
  for (int i = 0; i < 10; ++i) {
    const double time_s = i / 15.0;
    lookout.see({{3.0, -1.0 + 2.0 * time_s, 1.0}, {4.2, 1.0 - 2.0 * time_s, 1.0}}, at_s(time_s));
    EXPECT_EQ(lookout.movers(at_s(time_s)).size(), 2U) << i;
  }
}

}  // namespace
}  // namespace understory::team
