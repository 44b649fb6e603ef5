// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include "understory/team/coordination.hpp"

namespace understory::team {
namespace {

Peer peer_at(const Vector3d& position_m, FlightMode mode = FlightMode::kExplorer) {
  Peer peer;
  peer.id = 1;
  peer.position_m = position_m;
  peer.mode = mode;
  return peer;
}

CoordinationConfig authors_values() {
  CoordinationConfig config;
  config.weight = 1.0;
  config.repulsion = 1.0;
  config.inner_radius_m = 2.0;
  config.outer_radius_m = 5.0;
  config.attraction = 1.0;
  config.range_m = 50.0;
  config.claim_weight = 0.0;
  return config;
}

TEST(Repulsion, HasTheHandWorkedValues) {
  const CoordinationConfig config = authors_values();

  // Between d_c and d_0: (d - 5)^2. Below d_c: 9 * (10 / 3) * (1 / d - 1 / 5).
  EXPECT_DOUBLE_EQ(repulsion(config, 4.0), 1.0);
  EXPECT_DOUBLE_EQ(repulsion(config, 3.0), 4.0);
  EXPECT_DOUBLE_EQ(repulsion(config, 1.0), 24.0);
  EXPECT_DOUBLE_EQ(repulsion(config, 0.5), 54.0);
}

TEST(Repulsion, IsContinuousAtBothRadii) {
  const CoordinationConfig config = authors_values();
  constexpr double kBit = 1e-9;

  for (const double radius_m : {config.inner_radius_m, config.outer_radius_m}) {
    EXPECT_NEAR(repulsion(config, radius_m - kBit), repulsion(config, radius_m + kBit), 1e-6);
  }
  EXPECT_EQ(repulsion(config, config.outer_radius_m + kBit), 0.0);
}

TEST(Repulsion, NeverGrowsWithDistanceAndStaysFiniteAtNone) {
  const CoordinationConfig config = authors_values();
  double before = repulsion(config, 0.0);
  EXPECT_TRUE(std::isfinite(before));

  for (int step = 0; step < 600; ++step) {
    const double now = repulsion(config, 0.01 * step);
    EXPECT_LE(now, before) << step;
    before = now;
  }
}

TEST(Attraction, BindsOnlyNearTheEdgeOfTheRange) {
  const CoordinationConfig config = authors_values();

  EXPECT_EQ(attraction(config, 0.0), 0.0);
  EXPECT_EQ(attraction(config, 40.0), 0.0);
  EXPECT_DOUBLE_EQ(attraction(config, 44.0), 2.0);
}

TEST(Attraction, LeadersDoNotCareWhereTheirFollowersAre) {
  EXPECT_FALSE(is_attracted(FlightMode::kExplorer, FlightMode::kCollector));
  EXPECT_TRUE(is_attracted(FlightMode::kCollector, FlightMode::kExplorer));
  EXPECT_TRUE(is_attracted(FlightMode::kExplorer, FlightMode::kExplorer));
  EXPECT_TRUE(is_attracted(FlightMode::kCollector, FlightMode::kCollector));
}

TEST(TeamCost, IsTheSumOverPlacesAndTargetsOfTeamMates) {
  CoordinationConfig config = authors_values();
  config.weight = 2.0;
  Peer near = peer_at({4.0, 0.0, 0.0});
  near.target_m = Vector3d(0.0, 3.0, 0.0);
  const Peer far = peer_at({44.0, 0.0, 0.0});

  const double cost = team_cost(config, {}, {near, far});

  EXPECT_DOUBLE_EQ(cost, 2.0 * (1.0 + 4.0 + 2.0));
}

TEST(TeamCost, AnExplorerIsNotHeldBackByACollector) {
  const CoordinationConfig config = authors_values();
  const Peers peers{peer_at({46.0, 0.0, 0.0}, FlightMode::kCollector)};

  EXPECT_EQ(team_cost(config, {Vector3d::Zero(), 0.0, FlightMode::kExplorer}, peers), 0.0);
  EXPECT_DOUBLE_EQ(team_cost(config, {Vector3d::Zero(), 0.0, FlightMode::kCollector}, peers), 3.0);
}

TEST(TeamCost, WhoIsNearerHasTheBetterClaim) {
  CoordinationConfig config = authors_values();
  config.claim_weight = 0.5;
  const Peers peers{peer_at({8.0, 0.0, 0.0})};

  EXPECT_DOUBLE_EQ(team_cost(config, {Vector3d::Zero(), 18.0, FlightMode::kExplorer}, peers), 5.0);
  EXPECT_EQ(team_cost(config, {Vector3d::Zero(), 7.0, FlightMode::kExplorer}, peers), 0.0);
}

TEST(TeamCost, WhoIsOutOfContactHasNoSay) {
  Peer silent = peer_at({1.0, 0.0, 0.0});
  silent.target_m = Vector3d::Zero();
  silent.in_contact = false;

  EXPECT_EQ(team_cost(authors_values(), {}, {silent}), 0.0);
}

TEST(Region, AreAsLargeAsEachOtherAndCoverTheBox) {
  const Box3d box_m(Vector3d(-50.0, -25.0, 0.0), Vector3d(50.0, 25.0, 2.0));
  for (int size = 1; size <= 8; ++size) {
    TeamConfig config;
    config.size = size;
    double volume_m3 = 0.0;
    for (config.id = 0; config.id < size; ++config.id) {
      const Box3d region_m = region_of(config, box_m);
      EXPECT_NEAR(region_m.volume(), box_m.volume() / size, 1e-6) << size;
      EXPECT_TRUE(box_m.contains(region_m));
      volume_m3 += region_m.volume();
    }
    EXPECT_NEAR(volume_m3, box_m.volume(), 1e-6);
  }
}

TEST(Region, AreHalvesAlongTheLongerSideByIdOfTwo) {
  TeamConfig config;
  config.size = 2;
  config.id = 1;

  const Box3d region_m =
      region_of(config, Box3d(Vector3d(-50.0, -25.0, 0.0), Vector3d(50.0, 25.0, 2.0)));

  EXPECT_EQ(region_m.min(), Vector3d(0.0, -25.0, 0.0));
  EXPECT_EQ(region_m.max(), Vector3d(50.0, 25.0, 2.0));
}

TEST(TeamTraffic, ASilentTeamMateIsGivenMoreRoomTheLongerItIsSilent) {
  TeamConfig config;
  Peer silent = peer_at({3.0, 0.0, 1.0});
  silent.in_contact = false;
  // Past it, 1.3 m away.
  Trajectory past;
  for (int i = 0; i < 60; ++i) {
    past.position.control_points.emplace_back(0.1 * i, 1.3, 1.0);
  }
  past.position.control_points.insert(
      past.position.control_points.end(), 3, past.position.control_points.back());
  past.yaw.control_points.assign(4, 0.0);
  const Time soon{std::chrono::seconds(1)};
  const Time later{std::chrono::seconds(10)};

  EXPECT_EQ(traffic_of(config, {silent}, {}, soon).obstruction_of(past), Obstruction::kNone);
  EXPECT_EQ(traffic_of(config, {silent}, {}, later).obstruction_of(past), Obstruction::kStanding);
}

}  // namespace
}  // namespace understory::team
