// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/strategy/set_aside.hpp"

#include <gtest/gtest.h>

namespace understory {
namespace {

constexpr Duration kWait = std::chrono::seconds(10);

Time at_s(double seconds) {
  return Time(duration_from_seconds(seconds));
}

Cluster cluster_at(const Vector3d& mean_m) {
  Cluster cluster;
  cluster.mean_m = mean_m;
  return cluster;
}

TEST(SetAsideList, WhatWasNeverAddedIsNeitherWaitingNorGivenUp) {
  const SetAsideList list(kWait, 3);

  EXPECT_EQ(list.size(), 0U);
  EXPECT_FALSE(list.is_waiting(cluster_at({1, 2, 1}), at_s(0.0)));
  EXPECT_FALSE(list.is_given_up(cluster_at({1, 2, 1})));
}

TEST(SetAsideList, PlaceWaitsForTheSetTimeAndNoLonger) {
  SetAsideList list(kWait, 3);
  const Cluster cluster = cluster_at({1, 2, 1});

  EXPECT_FALSE(list.add(cluster, at_s(5.0)));

  EXPECT_TRUE(list.is_waiting(cluster, at_s(5.0)));
  EXPECT_TRUE(list.is_waiting(cluster, at_s(14.999999)));
  EXPECT_FALSE(list.is_waiting(cluster, at_s(15.0)));
  EXPECT_FALSE(list.is_given_up(cluster));
}

TEST(SetAsideList, LastTryGivesThePlaceUpForGood) {
  SetAsideList list(kWait, 3);
  const Cluster cluster = cluster_at({1, 2, 1});

  EXPECT_FALSE(list.add(cluster, at_s(0.0)));
  EXPECT_FALSE(list.add(cluster, at_s(20.0)));
  EXPECT_FALSE(list.is_given_up(cluster));
  EXPECT_TRUE(list.add(cluster, at_s(40.0)));

  EXPECT_TRUE(list.is_given_up(cluster));
  EXPECT_FALSE(list.is_waiting(cluster, at_s(1e6)));
  EXPECT_TRUE(list.is_given_up(cluster));
  EXPECT_FALSE(list.add(cluster, at_s(2e6))) << "it is given up once only";
}

TEST(SetAsideList, OneTryGivesUpAtOnce) {
  SetAsideList list(kWait, 1);
  const Cluster cluster = cluster_at({1, 2, 1});

  EXPECT_TRUE(list.add(cluster, at_s(0.0)));

  EXPECT_TRUE(list.is_given_up(cluster));
}

TEST(SetAsideList, ClusterThatWasMadeAnewAtTheSamePlaceIsKnown) {
  SetAsideList list(kWait, 2);
  list.add(cluster_at({1, 2, 1}), at_s(0.0));

  EXPECT_TRUE(list.is_waiting(cluster_at({1.3, 2, 1.1}), at_s(1.0)));
  EXPECT_FALSE(list.is_waiting(cluster_at({1.5, 2, 1}), at_s(1.0)));
  EXPECT_TRUE(list.add(cluster_at({1.2, 2.1, 1}), at_s(20.0)));
  EXPECT_EQ(list.size(), 1U);
}

TEST(SetAsideList, PlacesAreCountedEachForItself) {
  SetAsideList list(kWait, 2);
  list.add(cluster_at({0, 0, 1}), at_s(0.0));
  list.add(cluster_at({3, 0, 1}), at_s(5.0));

  EXPECT_FALSE(list.is_waiting(cluster_at({0, 0, 1}), at_s(12.0)));
  EXPECT_TRUE(list.is_waiting(cluster_at({3, 0, 1}), at_s(12.0)));
  EXPECT_TRUE(list.add(cluster_at({0, 0, 1}), at_s(20.0)));
  EXPECT_FALSE(list.is_given_up(cluster_at({3, 0, 1})));
}

TEST(SetAsideList, BannedViewIsThatPlaceWithThatHeadingOnly) {
  SetAsideList list(kWait, 2);
  const Viewpoint banned{{3, 4, 1}, {0, 0, 1}, 3.1, 0.8};
  list.ban_view(banned);

  EXPECT_TRUE(list.is_banned(banned));
  Viewpoint other = banned;
  other.yaw_rad = -3.1;  // 0.08 rad on, across the seam
  EXPECT_TRUE(list.is_banned(other));
  other.yaw_rad = 2.7;
  EXPECT_FALSE(list.is_banned(other));
  other = banned;
  other.node.x() += 1;
  EXPECT_FALSE(list.is_banned(other));
}

}  // namespace
}  // namespace understory
