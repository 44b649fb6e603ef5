// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// What an operator may ask of a mission, and when.
#include <set>
#include <string>

#include <gtest/gtest.h>

#include "support/mission_flight.hpp"
#include "understory/mission.hpp"

namespace understory {
namespace {

using test::long_hall;
using test::MissionFlight;

MissionConfig waiting() {
  MissionConfig config;
  config.auto_start = false;
  return config;
}

// The states in which a flight was until it was over.
std::set<MissionState> states_until_over(MissionFlight& flight) {
  std::set<MissionState> states;
  flight.fly_until([&] {
    states.insert(flight.mission.state());
    return flight.mission.is_over();
  });
  EXPECT_TRUE(flight.mission.is_over());
  return states;
}

void expect_refused(const Mission::Answer& answer) {
  EXPECT_FALSE(answer.accepted);
  EXPECT_EQ(answer.published, nullptr);
}

TEST(MissionRequest, MissionThatIsNotStartedWaitsWhereItIs) {
  MissionFlight flight(long_hall(), waiting());

  for (int i = 0; i < 50; ++i) {
    EXPECT_EQ(flight.step().published, nullptr);
  }

  EXPECT_EQ(flight.mission.state(), MissionState::kWaiting);
  EXPECT_EQ(flight.here().position_m, Vector3d(0.0, 0.0, 1.0));
}

TEST(MissionRequest, StartSetsAWaitingMissionOff) {
  MissionFlight flight(long_hall(), waiting());
  flight.fly_for(5.0);

  EXPECT_TRUE(flight.mission.start(flight.now));

  EXPECT_EQ(flight.mission.state(), MissionState::kTakeOff);
  EXPECT_EQ(flight.mission.started_at(), flight.now);
  EXPECT_TRUE(flight.fly_until_fast());
  EXPECT_EQ(flight.mission.state(), MissionState::kExplore);
}

TEST(MissionRequest, MissionThatFliesCannotBeStartedAgain) {
  MissionFlight flight(long_hall());
  EXPECT_FALSE(flight.mission.start(flight.now));
  ASSERT_TRUE(flight.fly_until_fast());

  EXPECT_FALSE(flight.mission.start(flight.now));

  EXPECT_EQ(flight.mission.started_at(), Time{});
}

TEST(MissionRequest, WaitingMissionTakesNothingButStart) {
  MissionFlight flight(long_hall(), waiting());

  expect_refused(flight.mission.pause(flight.now));
  expect_refused(flight.mission.return_home(flight.now));
  expect_refused(flight.mission.land(flight.now));

  EXPECT_EQ(flight.mission.state(), MissionState::kWaiting);
  EXPECT_EQ(flight.mission.stop_reason(), StopReason::kNone);
}

TEST(MissionRequest, PauseBrakesToRestAndStays) {
  MissionFlight flight(long_hall());
  ASSERT_TRUE(flight.fly_until_fast());
  const Vector3d asked_at_m = flight.here().position_m;

  const Mission::Answer answer = flight.mission.pause(flight.now);

  EXPECT_TRUE(answer.accepted);
  ASSERT_NE(answer.published, nullptr);
  EXPECT_EQ(answer.published->mode, FlightMode::kBrake);
  for (int i = 0; i < 200; ++i) {
    EXPECT_EQ(flight.step().published, nullptr);
  }
  EXPECT_EQ(flight.mission.state(), MissionState::kPaused);
  EXPECT_LT(flight.here().velocity_mps.norm(), 1e-3);
  EXPECT_LT((flight.here().position_m - asked_at_m).norm(), 2.0);
}

TEST(MissionRequest, WhatIsAskedBeforeTheFirstMapNeedsNoBrake) {
  MissionFlight flight(long_hall());

  const Mission::Answer answer = flight.mission.pause(flight.now);

  EXPECT_TRUE(answer.accepted);
  EXPECT_EQ(answer.published, nullptr);
  EXPECT_EQ(flight.mission.stop(StopReason::kStageFailed, flight.now), nullptr);
  EXPECT_EQ(flight.mission.state(), MissionState::kStopped);
}

TEST(MissionRequest, StartResumesWhatThePauseInterrupted) {
  for (const MissionState state : {MissionState::kTakeOff,
                                   MissionState::kExplore,
                                   MissionState::kReturnHome,
                                   MissionState::kDescend}) {
    MissionFlight flight(long_hall(), {}, {0.0, 0.0, 0.45});
    if (state == MissionState::kReturnHome || state == MissionState::kDescend) {
      ASSERT_TRUE(flight.fly_until_fast());
      const Mission::Answer answer = state == MissionState::kDescend
                                         ? flight.mission.land(flight.now)
                                         : flight.mission.return_home(flight.now);
      ASSERT_TRUE(answer.accepted);
    }
    ASSERT_TRUE(flight.fly_until_state(state)) << to_string(state);
    ASSERT_TRUE(flight.mission.pause(flight.now).accepted) << to_string(state);
    flight.fly_for(10.0);
    ASSERT_EQ(flight.mission.state(), MissionState::kPaused);

    EXPECT_TRUE(flight.mission.start(flight.now));

    EXPECT_EQ(flight.mission.state(), state) << to_string(flight.mission.state());
  }
}

TEST(MissionRequest, SecondPauseIsRefusedAndForgetsNothing) {
  MissionFlight flight(long_hall());
  ASSERT_TRUE(flight.fly_until_state(MissionState::kExplore));
  ASSERT_TRUE(flight.mission.pause(flight.now).accepted);

  expect_refused(flight.mission.pause(flight.now));

  EXPECT_TRUE(flight.mission.start(flight.now));
  EXPECT_EQ(flight.mission.state(), MissionState::kExplore);
}

TEST(MissionRequest, ReturnHomeFromExploringGoesHomeAndLands) {
  for (const bool returns_by_itself : {true, false}) {
    MissionConfig config;
    config.return_home = returns_by_itself;
    MissionFlight flight(long_hall(), config);
    ASSERT_TRUE(flight.fly_until([&] { return std::abs(flight.here().position_m.x()) > 2.0; }));
    const Time asked_at = flight.now;

    const Mission::Answer answer = flight.mission.return_home(flight.now);
    const std::set<MissionState> states = states_until_over(flight);

    EXPECT_TRUE(answer.accepted);
    EXPECT_EQ(answer.published, nullptr) << "the way home begins on what is flown";
    EXPECT_EQ(states,
              (std::set<MissionState>{
                  MissionState::kReturnHome, MissionState::kDescend, MissionState::kLand}));
    EXPECT_EQ(flight.mission.stop_reason(), StopReason::kReturnRequested);
    EXPECT_EQ(flight.mission.explored_at(), asked_at);
    EXPECT_LT(flight.here().position_m.head<2>().norm(), 0.3);
    EXPECT_LT(flight.here().position_m.z(), 0.8);
    EXPECT_TRUE(flight.mission.explorer().has_open_clusters()) << "there was more to see";
  }
}

TEST(MissionRequest, ReturnHomeEndsAPause) {
  MissionFlight flight(long_hall());
  ASSERT_TRUE(flight.fly_until_fast());
  ASSERT_TRUE(flight.mission.pause(flight.now).accepted);
  flight.fly_for(5.0);

  EXPECT_TRUE(flight.mission.return_home(flight.now).accepted);

  EXPECT_EQ(states_until_over(flight).count(MissionState::kPaused), 0U);
  EXPECT_LT(flight.here().position_m.head<2>().norm(), 0.3);
}

TEST(MissionRequest, LandDescendsWhereTheVehicleComesToRest) {
  MissionFlight flight(long_hall());
  ASSERT_TRUE(flight.fly_until([&] {
    return std::abs(flight.here().position_m.x()) > 2.0 && flight.here().velocity_mps.norm() > 1.0;
  }));

  const Mission::Answer answer = flight.mission.land(flight.now);

  EXPECT_TRUE(answer.accepted);
  ASSERT_NE(answer.published, nullptr);
  EXPECT_EQ(answer.published->mode, FlightMode::kBrake);
  const Vector3d braked_m = answer.published->sample(answer.published->end()).position_m;
  EXPECT_EQ(states_until_over(flight),
            (std::set<MissionState>{MissionState::kDescend, MissionState::kLand}));
  EXPECT_EQ(flight.mission.stop_reason(), StopReason::kLandRequested);
  EXPECT_LT((flight.here().position_m - braked_m).head<2>().norm(), 0.05);
  EXPECT_LT(flight.here().position_m.z(), 0.8);
}

TEST(MissionRequest, MissionThatIsOverTakesNoRequests) {
  for (const MissionState end : {MissionState::kLand, MissionState::kStopped}) {
    MissionFlight flight(long_hall());
    ASSERT_TRUE(flight.fly_until_fast());
    if (end == MissionState::kLand) {
      ASSERT_TRUE(flight.mission.land(flight.now).accepted);
      ASSERT_TRUE(flight.fly_until_state(end));
    } else {
      flight.mission.stop(StopReason::kSensorLost, flight.now);
    }
    const StopReason reason = flight.mission.stop_reason();

    EXPECT_FALSE(flight.mission.start(flight.now));
    expect_refused(flight.mission.pause(flight.now));
    expect_refused(flight.mission.return_home(flight.now));
    expect_refused(flight.mission.land(flight.now));
    EXPECT_EQ(flight.mission.stop(StopReason::kInterrupted, flight.now), nullptr);

    EXPECT_EQ(flight.mission.state(), end);
    EXPECT_EQ(flight.mission.stop_reason(), reason);
  }
}

TEST(MissionRequest, SecondStopKeepsTheFirstReasonAndTheVehicleComesToRest) {
  MissionFlight flight(long_hall());
  ASSERT_TRUE(flight.fly_until_fast());
  ASSERT_NE(flight.mission.stop(StopReason::kSensorLost, flight.now), nullptr);
  const Time stopped_at = flight.now;
  flight.fly_for(0.3);

  flight.mission.stop(StopReason::kInterrupted, flight.now);

  EXPECT_EQ(flight.mission.stop_reason(), StopReason::kSensorLost);
  EXPECT_EQ(flight.mission.explored_at(), stopped_at);
  EXPECT_EQ(flight.mission.state(), MissionState::kStopped);
  EXPECT_TRUE(flight.fly_until_at_rest());
  EXPECT_EQ(flight.mission.stop(StopReason::kInterrupted, flight.now), nullptr);
}

TEST(MissionRequest, StopOnTheWayHomeEndsItThere) {
  MissionFlight flight(long_hall());
  ASSERT_TRUE(flight.fly_until([&] { return std::abs(flight.here().position_m.x()) > 2.5; }));
  ASSERT_TRUE(flight.mission.return_home(flight.now).accepted);
  flight.fly_for(0.5);

  flight.mission.stop(StopReason::kInterrupted, flight.now);
  flight.fly_for(20.0);

  EXPECT_EQ(flight.mission.state(), MissionState::kStopped);
  EXPECT_EQ(flight.mission.stop_reason(), StopReason::kReturnRequested);
  EXPECT_GT(std::abs(flight.here().position_m.x()), 0.5) << "not at home";
}

TEST(MissionRequest, TimeLimitCountsFromTheStart) {
  MissionConfig config = waiting();
  config.time_limit_s = 5.0;
  MissionFlight flight(long_hall(), config);
  flight.fly_for(20.0);
  ASSERT_EQ(flight.mission.state(), MissionState::kWaiting);
  ASSERT_TRUE(flight.mission.start(flight.now));

  flight.fly_for(4.9);
  EXPECT_EQ(flight.mission.state(), MissionState::kExplore);
  flight.fly_for(0.1);

  EXPECT_EQ(flight.mission.state(), MissionState::kStopped);
  EXPECT_EQ(flight.mission.stop_reason(), StopReason::kTimeLimit);
  EXPECT_TRUE(flight.fly_until_at_rest());
}

TEST(MissionRequest, TimeLimitEndsAPauseToo) {
  MissionConfig config;
  config.time_limit_s = 5.0;
  MissionFlight flight(long_hall(), config);
  ASSERT_TRUE(flight.mission.pause(flight.now).accepted);

  flight.fly_for(5.0);

  EXPECT_EQ(flight.mission.stop_reason(), StopReason::kTimeLimit);
}

TEST(MissionRequest, EveryStateAndReasonHasANameOfItsOwn) {
  std::set<std::string> names{"?"};
  for (int i = 0; i <= static_cast<int>(MissionState::kStopped); ++i) {
    EXPECT_TRUE(names.insert(to_string(static_cast<MissionState>(i))).second) << i;
  }
  names = {"?"};
  for (int i = 0; i <= static_cast<int>(StopReason::kTrackingLost); ++i) {
    EXPECT_TRUE(names.insert(to_string(static_cast<StopReason>(i))).second) << i;
  }
}

}  // namespace
}  // namespace understory
