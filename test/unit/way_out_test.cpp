// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/plan/way_out.hpp"

#include <gtest/gtest.h>

#include "support/mission_flight.hpp"
#include "understory/explorer.hpp"

namespace understory {
namespace {

using test::hall_known_between;
using test::MissionFlight;
using test::SnapshotBuilder;

constexpr double kClearance_m = 0.28;
const Vector3d kStart_m(0.0, 0.0, 1.0);
// Room for one voxel in its middle. Routes look at every other one: at -0.15, 0.05, 0.25.
constexpr double kGap_m = 0.7;
constexpr double kBetweenNodes_m = 0.15;
constexpr double kAtANode_m = 0.05;

// A wall across the hall, with a gap around this y; none without one.
void put_a_wall(SnapshotBuilder& hall, double x_m, std::optional<double> gap_at_m) {
  hall.set_box({Vector3d(x_m, -1.0, 0.0), Vector3d(x_m + 0.2, 1.0, 2.0)}, VoxelState::kOccupied);
  if (gap_at_m) {
    const Vector3d corner_m(x_m, *gap_at_m - 0.5 * kGap_m, 0.0);
    hall.set_box({corner_m, corner_m + Vector3d(0.2, kGap_m, 2.0)}, VoxelState::kFree);
  }
}

// Walls on both sides of the start, the eastern one with this gap.
SnapshotBuilder pocket(std::optional<double> gap_at_m) {
  SnapshotBuilder hall = hall_known_between(-8.0, 6.0);
  put_a_wall(hall, -1.5, std::nullopt);
  put_a_wall(hall, 1.5, gap_at_m);
  return hall;
}

std::vector<Vector3d> way_out_of(SnapshotBuilder builder) {
  ClearanceMap map;
  map.update(builder.build());
  RouteSearch routes(builder.geometry(), kClearance_m);
  std::vector<Vector3d> way_m = way_out(map, routes, kClearance_m, kStart_m);
  for (const Vector3d& at_m : way_m) {
    EXPECT_TRUE(map.clearance_at_least(at_m, kClearance_m)) << at_m.transpose();
  }
  return way_m;
}

TEST(WayOut, LeadsThroughAGapBetweenTheNodesOfTheRoutes) {
  const std::vector<Vector3d> way_m = way_out_of(pocket(kBetweenNodes_m));

  ASSERT_FALSE(way_m.empty());
  EXPECT_EQ(way_m.front(), kStart_m);
  EXPECT_NEAR(way_m.back().x(), 4.0, 0.2);
}

TEST(WayOut, IsNotNeededWhereRoutesLeadOut) {
  EXPECT_TRUE(way_out_of(pocket(kAtANode_m)).empty());
}

TEST(WayOut, IsNoneOutOfAClosedRoom) {
  EXPECT_TRUE(way_out_of(pocket(std::nullopt)).empty());
}

TEST(WayOut, IsNoneThroughSomeoneWhoStandsInTheGap) {
  SnapshotBuilder builder = pocket(kBetweenNodes_m);
  ClearanceMap map;
  map.update(builder.build());
  RouteSearch routes(builder.geometry(), kClearance_m);
  routes.avoid({{Vector3d(1.6, kBetweenNodes_m, 1.0), 1.2}});

  EXPECT_TRUE(way_out(map, routes, kClearance_m, kStart_m).empty());
}

TEST(WayOut, IsNoneWhereTheBoxIsSmallerThanIt) {
  SnapshotBuilder builder(0.1, Box3d(Vector3d(-2.0, -2.0, 0.0), Vector3d(2.0, 2.0, 2.0)));

  EXPECT_TRUE(way_out_of(builder.fill(VoxelState::kFree)).empty());
}

TEST(WayOut, IsFlownToWhatThereIsToSee) {
  MissionFlight flight(pocket(kBetweenNodes_m));

  ASSERT_TRUE(flight.fly_until([&] { return flight.here().position_m.x() > 3.0; }));

  EXPECT_EQ(flight.mission.state(), MissionState::kExplore);
  EXPECT_TRUE(flight.fly_until([&] { return flight.mission.explorer().target().has_value(); }));
  EXPECT_EQ(flight.mission.pilot().counters().brakes, 0U);
}

TEST(WayOut, IsFlownHome) {
  MissionFlight flight(hall_known_between(-8.0, 8.0), {}, Vector3d(-6.0, 0.0, 1.0));
  flight.builder.set_box({Vector3d(5.0, -1.0, 0.0), Vector3d(8.0, 1.0, 2.0)}, VoxelState::kUnknown);
  ASSERT_TRUE(flight.fly_until([&] { return flight.here().position_m.x() > 2.0; }));
  put_a_wall(flight.builder, 1.0, kBetweenNodes_m);

  ASSERT_TRUE(flight.mission.return_home(flight.now).accepted);

  ASSERT_TRUE(flight.fly_until_state(MissionState::kLand));
  EXPECT_NEAR(flight.here().position_m.x(), -6.0, 0.3);
}

}  // namespace
}  // namespace understory
