// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/plan/traffic.hpp"

#include <gtest/gtest.h>

namespace understory {
namespace {

constexpr TrafficDistances kDistances{1.6, 1.2, 0.9};

// At a steady pace from one place to another, then rested there.
TrajectoryPtr line(const Vector3d& from_m, const Vector3d& to_m, double start_s = 0.0) {
  auto flown = std::make_shared<Trajectory>();
  flown->start = Time{} + duration_from_seconds(start_s);
  const double length_m = (to_m - from_m).norm();
  const int pieces = std::max(1, static_cast<int>(length_m / 0.1));  // 1 m/s
  for (int i = -1; i <= pieces + 2; ++i) {
    const double share = std::clamp(static_cast<double>(i) / pieces, 0.0, 1.0);
    flown->position.control_points.emplace_back(from_m + share * (to_m - from_m));
  }
  flown->yaw.control_points.assign(4, 0.0);
  return flown;
}

Traffic with(TrajectoryPtr trajectory, bool has_way = false) {
  Mover mover;
  mover.position_m = trajectory->sample(trajectory->start).position_m;
  mover.trajectory = std::move(trajectory);
  mover.has_way = has_way;
  return {{mover}, kDistances};
}

Traffic with_standing(const Vector3d& position_m, double extra_m = 0.0) {
  Mover mover;
  mover.position_m = position_m;
  mover.extra_m = extra_m;
  return {{mover}, kDistances};
}

TEST(Traffic, BlocksWhatMeetsSomeone) {
  const TrajectoryPtr eastward = line({0, 0, 1}, {10, 0, 1});

  EXPECT_NE(with(line({10, 0, 1}, {0, 0, 1})).obstruction_of(*eastward), Obstruction::kNone);
  EXPECT_NE(with(line({5, 5, 1}, {5, -5, 1})).obstruction_of(*eastward), Obstruction::kNone);
  EXPECT_EQ(with(line({10, 3, 1}, {0, 3, 1})).obstruction_of(*eastward), Obstruction::kNone);
}

TEST(Traffic, DoesNotBlockWhatCrossesAfterTheOtherHasPassed) {
  const TrajectoryPtr eastward = line({0, 0, 1}, {10, 0, 1});

  // The other is at the crossing after one second, this one after five.
  EXPECT_EQ(with(line({5, 1, 1}, {5, -9, 1})).obstruction_of(*eastward), Obstruction::kNone);
}

TEST(Traffic, BlocksAnEndWhereTheOtherComesLater) {
  const TrajectoryPtr short_way = line({0, 0, 1}, {2, 0, 1});

  EXPECT_NE(with(line({12, 0, 1}, {2, 0, 1})).obstruction_of(*short_way), Obstruction::kNone);
}

TEST(Traffic, BlocksWhatPassesSomeoneWhoStands) {
  const TrajectoryPtr eastward = line({0, 0, 1}, {10, 0, 1});

  EXPECT_NE(with_standing({5, 0.8, 1}).obstruction_of(*eastward), Obstruction::kNone);
  EXPECT_EQ(with_standing({5, 1, 1}).obstruction_of(*eastward), Obstruction::kNone);
  EXPECT_NE(with_standing({5, 1, 1}, 0.2).obstruction_of(*eastward), Obstruction::kNone);
}

TEST(Traffic, TellsWhoPassesFromWhoStands) {
  const TrajectoryPtr eastward = line({0, 0, 1}, {10, 0, 1});

  EXPECT_EQ(with(line({10, 0, 1}, {0, 0, 1})).obstruction_of(*eastward), Obstruction::kPassing);
  EXPECT_EQ(with_standing({5, 0.5, 1}).obstruction_of(*eastward), Obstruction::kStanding);
}

TEST(Traffic, OfManyPlacesWhereSomeoneMayStandTheNearestCounts) {
  Mover mover;
  mover.position_m = {0.0, 0.7, 1.0};
  for (int i = 1; i < 10; ++i) {
    mover.other_places_m.emplace_back(0.3 * i, 0.7, 1.0);
  }
  const Traffic row({mover}, kDistances);

  // Along the row, no nearer than at the start, and across it.
  EXPECT_EQ(row.obstruction_of(*line({0, 0, 1}, {2, 0, 1})), Obstruction::kNone);
  EXPECT_EQ(row.obstruction_of(*line({0, 0, 1}, {2, 2, 1})), Obstruction::kStanding);
}

TEST(Traffic, WhoIsTooNearAlreadyMayLeaveButComeNoNearer) {
  const Traffic beside = with_standing({0.7, 0.0, 1.0});

  EXPECT_EQ(beside.obstruction_of(*line({0, 0, 1}, {-5, 0, 1})), Obstruction::kNone);
  EXPECT_NE(beside.obstruction_of(*line({0, 0, 1}, {0.3, 0, 1})), Obstruction::kNone);
}

TEST(Traffic, OnlyOneOfTwoGivesWayWhileThereIsTime) {
  const TrajectoryPtr eastward = line({0, 0, 1}, {20, 0, 1});
  const TrajectoryPtr westward = line({20, 0, 1}, {0, 0, 1});

  const std::optional<Time> ours = with(westward, true).must_give_way_at(*eastward, Time{});

  ASSERT_TRUE(ours);
  EXPECT_NEAR(to_seconds(*ours), 9.4, 0.2);
  EXPECT_FALSE(with(westward, false).must_give_way_at(*eastward, Time{}));
}

TEST(Traffic, InTheLastMomentBothGiveWay) {
  const TrajectoryPtr eastward = line({0, 0, 1}, {20, 0, 1});
  const TrajectoryPtr westward = line({20, 0, 1}, {0, 0, 1});
  const Time late{std::chrono::milliseconds(7500)};

  EXPECT_TRUE(with(westward, false).must_give_way_at(*eastward, late));
}

TEST(Traffic, WhoStandsNeverGivesWayAndIsAlwaysGivenIt) {
  const TrajectoryPtr eastward = line({0, 0, 1}, {20, 0, 1});
  const TrajectoryPtr standing = line({10, 0, 1}, {10, 0, 1});

  EXPECT_TRUE(with(standing, false).must_give_way_at(*eastward, Time{}));
  EXPECT_TRUE(with_standing({10, 0, 1}).must_give_way_at(*eastward, Time{}));
}

TEST(Traffic, RoutesAreBarredAroundWhoStandsAndOnlyThere) {
  const Vector3d here_m(0, 0, 1);

  const Barriers around = with_standing({5, 0, 1}, 0.5).barriers(here_m, Time{});
  const Barriers close_by = with_standing({1, 0, 1}, 0.5).barriers(here_m, Time{});

  ASSERT_EQ(around.size(), 1U);
  EXPECT_GT(around[0].radius_m, kDistances.rest_m + 0.5);
  EXPECT_TRUE(is_barred(around, {0, 1, 1}, {10, 1, 1}));
  EXPECT_FALSE(is_barred(around, {0, 3, 1}, {10, 3, 1}));
  EXPECT_FALSE(is_barred(around, {0, 0, 1}, {2, 0, 1})) << "it lies beyond";
  ASSERT_EQ(close_by.size(), 1U);
  EXPECT_LT(close_by[0].radius_m, 1.0) << "who is inside may leave";
  EXPECT_TRUE(with(line({5, 0, 1}, {9, 0, 1})).barriers(here_m, Time{}).empty());
}

TEST(Traffic, NobodyIsNoTraffic) {
  const TrajectoryPtr eastward = line({0, 0, 1}, {20, 0, 1});

  EXPECT_EQ(Traffic().obstruction_of(*eastward), Obstruction::kNone);
  EXPECT_FALSE(Traffic().must_give_way_at(*eastward, Time{}));
}

}  // namespace
}  // namespace understory
