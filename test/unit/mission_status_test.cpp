// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/mission_status.hpp"

#include <gtest/gtest.h>

#include "support/mission_flight.hpp"

namespace understory {
namespace {

using test::long_hall;
using test::MissionFlight;

TEST(MissionStatus, WaitingMissionHasNothingToTell) {
  MissionConfig config;
  config.auto_start = false;
  MissionFlight flight(long_hall(), config);
  flight.fly_for(1.0);

  const MissionStatus status = status_of(flight.mission, flight.now);

  EXPECT_EQ(status.time, flight.now);
  EXPECT_EQ(status.state, MissionState::kWaiting);
  EXPECT_EQ(status.stop_reason, StopReason::kNone);
  EXPECT_TRUE(status.at_rest);
  EXPECT_FALSE(status.is_over());
  EXPECT_FALSE(status.explored_at.has_value());
  EXPECT_FALSE(status.target_id.has_value());
  EXPECT_FALSE(status.target_m.has_value());
  EXPECT_EQ(status.replans, 0U);
}

TEST(MissionStatus, ExploringMissionNamesItsTargetAndCountsItsClusters) {
  MissionFlight flight(long_hall());
  ASSERT_TRUE(flight.fly_until_fast());

  const MissionStatus status = status_of(flight.mission, flight.now);

  const Explorer& explorer = flight.mission.explorer();
  ASSERT_TRUE(explorer.target().has_value());
  const Candidate& target = explorer.target()->candidate;
  EXPECT_EQ(status.target_id, target.cluster->id);
  EXPECT_EQ(status.target_m, target.viewpoint.position_m);
  EXPECT_EQ(status.state, MissionState::kExplore);
  EXPECT_EQ(status.mode, flight.mission.pilot().follower().at(flight.now).mode);
  EXPECT_NE(status.mode, FlightMode::kBrake);
  EXPECT_FALSE(status.at_rest);
  EXPECT_GE(status.clusters, 2U);
  EXPECT_EQ(status.clusters, explorer.clusters().size());
  EXPECT_LE(status.trails + status.dormant, 2 * status.clusters);
  EXPECT_GE(status.replans, 1U);
  EXPECT_EQ(status.replans, flight.mission.pilot().counters().plans);
  EXPECT_EQ(status.counters.at("decisions"), explorer.counters().decisions);
  EXPECT_GE(status.counters.at("decisions"), 1U);
}

TEST(MissionStatus, ModeIsThatOfTheTrajectoryThatIsFlownNowNotOfTheNext) {
  MissionFlight flight(long_hall());
  ASSERT_TRUE(flight.fly_until_something_new_is_published());

  EXPECT_EQ(status_of(flight.mission, flight.now).mode, FlightMode::kBrake) << "stands yet";
  EXPECT_NE(status_of(flight.mission, flight.now + Duration(100000)).mode, FlightMode::kBrake);
}

TEST(MissionStatus, StoppedMissionTellsWhyAndWhenAndThatItBraked) {
  MissionFlight flight(long_hall());
  ASSERT_TRUE(flight.fly_until_fast());
  const Time stopped_at = flight.now;
  flight.mission.stop(StopReason::kSensorLost, flight.now);
  flight.fly_for(10.0);

  const MissionStatus status = status_of(flight.mission, flight.now);

  EXPECT_TRUE(status.is_over());
  EXPECT_EQ(status.stop_reason, StopReason::kSensorLost);
  EXPECT_EQ(status.explored_at, stopped_at);
  EXPECT_EQ(status.mode, FlightMode::kBrake);
  EXPECT_TRUE(status.at_rest);
  EXPECT_EQ(status.counters.at("brakes"), 1U);
  EXPECT_EQ(status.counters.at("failed_brakes"), 0U);
}

}  // namespace
}  // namespace understory
