// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/plan/trajectory_follower.hpp"

#include <algorithm>

#include <gtest/gtest.h>

#include "support/trajectory_checks.hpp"

namespace understory {
namespace {

Time at_s(double seconds) {
  return Time(duration_from_seconds(seconds));
}

// At rest at (id, 0, 1), from this time on.
TrajectoryPtr rest(std::uint64_t id, double start_s) {
  Trajectory trajectory =
      test::straight_trajectory({static_cast<double>(id), 0, 1}, Vector3d::Zero(), 1.0);
  trajectory.id = id;
  trajectory.start = at_s(start_s);
  return std::make_shared<const Trajectory>(trajectory);
}

TEST(TrajectoryFollower, IsEmptyUntilSomethingIsSet) {
  TrajectoryFollower follower;
  EXPECT_TRUE(follower.empty());

  follower.set(rest(1, 0.0), Time{});

  EXPECT_FALSE(follower.empty());
}

TEST(TrajectoryFollower, EachTrajectoryHoldsUntilTheNextOnesStart) {
  TrajectoryFollower follower;
  follower.set(rest(1, 1.0), at_s(1.0));
  follower.set(rest(2, 2.0), at_s(1.5));

  EXPECT_EQ(follower.at(at_s(0.0)).id, 1U) << "before all starts, the first";
  EXPECT_EQ(follower.at(at_s(1.999999)).id, 1U);
  EXPECT_EQ(follower.at(at_s(2.0)).id, 2U);
  EXPECT_EQ(follower.at(at_s(1000.0)).id, 2U);
  EXPECT_EQ(follower.sample(at_s(1.7)).position_m, Vector3d(1, 0, 1));
}

TEST(TrajectoryFollower, LaterOneThatWasToTakeOverIsDropped) {
  TrajectoryFollower follower;
  follower.set(rest(1, 0.0), at_s(0.0));
  follower.set(rest(2, 3.0), at_s(1.0));
  follower.set(rest(3, 2.0), at_s(1.5));

  EXPECT_EQ(follower.newest()->id, 3U);
  EXPECT_EQ(follower.at(at_s(1.9)).id, 1U);
  EXPECT_EQ(follower.at(at_s(10.0)).id, 3U);
}

TEST(TrajectoryFollower, OneOfTheSameStartReplacesTheOther) {
  TrajectoryFollower follower;
  follower.set(rest(1, 0.0), at_s(0.0));
  follower.set(rest(2, 2.0), at_s(1.0));
  follower.set(rest(3, 2.0), at_s(1.0));

  EXPECT_EQ(follower.queue().size(), 2U);
  EXPECT_EQ(follower.at(at_s(2.0)).id, 3U);
}

TEST(TrajectoryFollower, WhatHasBeenFlownIsForgotten) {
  TrajectoryFollower follower;
  for (std::uint64_t id = 1; id <= 100; ++id) {
    const double now_s = static_cast<double>(id);
    follower.set(rest(id, now_s + 0.1), at_s(now_s));

    ASSERT_LE(follower.queue().size(), 3U);
    ASSERT_EQ(follower.at(at_s(now_s)).id, std::max<std::uint64_t>(1, id - 1));
  }
}

TEST(TrajectoryFollower, RemovedOneLeavesWhatWasFlownBefore) {
  TrajectoryFollower follower;
  const TrajectoryPtr second = rest(2, 2.0);
  follower.set(rest(1, 0.0), at_s(0.0));
  follower.set(second, at_s(1.0));

  follower.remove(second);

  EXPECT_EQ(follower.newest()->id, 1U);
  EXPECT_EQ(follower.at(at_s(10.0)).id, 1U);
}

TEST(TrajectoryFollower, RemovingOneInBetweenKeepsThoseAround) {
  TrajectoryFollower follower;
  const TrajectoryPtr second = rest(2, 2.0);
  follower.set(rest(1, 0.0), at_s(0.0));
  follower.set(second, at_s(0.0));
  follower.set(rest(3, 3.0), at_s(0.0));

  follower.remove(second);

  EXPECT_EQ(follower.at(at_s(2.5)).id, 1U);
  EXPECT_EQ(follower.at(at_s(3.0)).id, 3U);
}

TEST(TrajectoryFollower, OnlyOneThereIsCannotBeRemoved) {
  TrajectoryFollower follower;
  const TrajectoryPtr only = rest(1, 0.0);
  follower.set(only, at_s(0.0));

  follower.remove(only);

  ASSERT_FALSE(follower.empty());
  EXPECT_EQ(follower.newest(), only);
}

TEST(TrajectoryFollower, RemovingWhatItDoesNotHaveChangesNothing) {
  TrajectoryFollower follower;
  follower.set(rest(1, 0.0), at_s(0.0));
  follower.set(rest(2, 2.0), at_s(0.0));

  follower.remove(rest(2, 2.0));  // an equal one, but not that one

  EXPECT_EQ(follower.queue().size(), 2U);
}

}  // namespace
}  // namespace understory
