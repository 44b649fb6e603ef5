// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/strategy/explorer_collector.hpp"

#include <gtest/gtest.h>

#include "understory/strategy/set_aside.hpp"

namespace understory {
namespace {

Candidate candidate_at(std::uint32_t id,
                       const Vector3d& position_m,
                       ClusterLabel label,
                       double yaw_rad = 0.0) {
  Cluster cluster;
  cluster.id = id;
  cluster.mean_m = position_m;
  cluster.label = label;
  return {std::make_shared<const Cluster>(cluster),
          {RouteLattice::Node::Zero(), position_m, yaw_rad, 1.0},
          position_m.norm()};
}

StrategyInput eastbound() {
  StrategyInput input;
  input.vehicle.velocity_mps = {1.5, 0.0, 0.0};
  return input;
}

ExplorerCollector strategy(const ExplorerCollectorConfig& config = {}) {
  return ExplorerCollector(config, TravelRates{3.0, 0.9});
}

constexpr ClusterLabel kFrontier = ClusterLabel::kFrontier;
constexpr ClusterLabel kTrail = ClusterLabel::kTrail;

TEST(ExplorerCost, IsTheWeightedSumOfEquationOne) {
  ExplorerCollectorConfig config;
  config.explorer.distance_weight = 0.5;
  config.explorer.direction_weight = 3.0;
  config.explorer.label_weight = 2.0;
  config.explorer.trail_penalty = 7.0;
  const StrategyInput input = eastbound();

  EXPECT_DOUBLE_EQ(strategy(config).explorer_cost(input, candidate_at(1, {4, 0, 0}, kFrontier)),
                   2.0);
  EXPECT_DOUBLE_EQ(strategy(config).explorer_cost(input, candidate_at(1, {0, 4, 0}, kFrontier)),
                   2.0 + 3.0 * kPi / 2.0);
  EXPECT_DOUBLE_EQ(strategy(config).explorer_cost(input, candidate_at(1, {-4, 0, 0}, kTrail)),
                   2.0 + 3.0 * kPi + 14.0);
}

TEST(ExplorerCost, UsesTheHeadingAtHover) {
  StrategyInput input;
  input.vehicle.velocity_mps = {0.1, 0.0, 0.0};
  input.vehicle.yaw_rad = kPi / 2.0;

  const double ahead = strategy().explorer_cost(input, candidate_at(1, {0, 4, 0}, kFrontier));
  const double aside = strategy().explorer_cost(input, candidate_at(1, {4, 0, 0}, kFrontier));

  EXPECT_LT(ahead, aside);
}

TEST(CollectorCost, IsTimeToReachPlusTimeToTurn) {
  EXPECT_DOUBLE_EQ(strategy().collector_cost(eastbound(), candidate_at(1, {6, 0, 0}, kTrail, 1.8)),
                   2.0 + 2.0);
}

TEST(Mode, CollectorWhenATrailIsNearElseExplorer) {
  StrategyInput input = eastbound();
  input.candidates = {candidate_at(1, {7.9, 0, 0}, kFrontier),
                      candidate_at(2, {8.1, 0, 0}, kTrail)};
  EXPECT_EQ(strategy().select_mode(input), FlightMode::kExplorer);

  input.candidates.push_back(candidate_at(3, {7.9, 0, 0}, kTrail));

  EXPECT_EQ(strategy().select_mode(input), FlightMode::kCollector);
}

TEST(Mode, DoesNotChatterAtTheRadius) {
  StrategyInput input = eastbound();
  int changes = 0;
  for (int i = 0; i < 100; ++i) {
    // A trail that wavers about the radius, as it does when clusters are made anew.
    input.candidates = {candidate_at(1, {8.0 + (i % 2 == 0 ? 0.5 : -0.5), 0, 0}, kTrail)};
    const FlightMode mode = strategy().select_mode(input);
    changes += mode != input.mode ? 1 : 0;
    input.mode = mode;
  }
  EXPECT_EQ(changes, 1);
}

TEST(Mode, CollectorGoesBackToExplorerBeyondTheWiderRadius) {
  StrategyInput input = eastbound();
  input.mode = FlightMode::kCollector;
  input.candidates = {candidate_at(1, {10.1, 0, 0}, kTrail)};

  EXPECT_EQ(strategy().select_mode(input), FlightMode::kExplorer);
}

TEST(Choice, ExplorerPrefersWhatLiesAhead) {
  StrategyInput input = eastbound();
  input.candidates = {candidate_at(1, {-2, 0, 0}, kFrontier),
                      candidate_at(2, {4, 0, 0}, kFrontier)};

  EXPECT_EQ(strategy().choose(input)->candidate.cluster->id, 2U);
}

// The nearer one is looked at aside: 2 s of turning for 1 s of flight.
TEST(Choice, ExplorerDoesNotWaitForItsCameraWhereThereIsAmpleChoice) {
  ExplorerCollectorConfig config;
  config.explorer.wait_weight = 2.0;
  StrategyInput input = eastbound();
  input.candidates = {candidate_at(1, {3, 0, 0}, kFrontier, 1.8),
                      candidate_at(2, {4, 0, 0}, kFrontier)};

  config.explorer.wait_ample_clusters = 2.0;
  EXPECT_EQ(strategy(config).choose(input)->candidate.cluster->id, 2U);
  config.explorer.wait_ample_clusters = 5.0;
  EXPECT_EQ(strategy(config).choose(input)->candidate.cluster->id, 1U);
  config.explorer.wait_weight = 0.0;
  config.explorer.wait_ample_clusters = 2.0;
  EXPECT_EQ(strategy(config).choose(input)->candidate.cluster->id, 1U);
}

TEST(Choice, NothingAheadFallsBackToGreedyThenToTheNearestAnywhere) {
  ExplorerCollectorConfig config;
  config.explorer.greedy_distance_m = 10.0;
  StrategyInput input = eastbound();
  input.candidates = {candidate_at(1, {-9, 0, 0}, kFrontier),
                      candidate_at(2, {0, -8, 0}, kFrontier),
                      candidate_at(3, {-12, 0, 0}, kFrontier)};
  EXPECT_EQ(strategy(config).choose(input)->candidate.cluster->id, 2U);

  input.candidates = {candidate_at(3, {-12, 0, 0}, kFrontier),
                      candidate_at(4, {0, 30, 0}, kFrontier)};
  EXPECT_FALSE(strategy(config).choose(input).has_value());
  input.is_complete = true;

  EXPECT_EQ(strategy(config).choose(input)->candidate.cluster->id, 3U);
}

TEST(Choice, CollectorTakesTheQuickestTrailAndIgnoresFrontiers) {
  StrategyInput input = eastbound();
  input.candidates = {candidate_at(1, {1, 0, 0}, kFrontier),
                      candidate_at(2, {2, 0, 0}, kTrail, 3.0),
                      candidate_at(3, {4, 0, 0}, kTrail, 0.0)};

  const std::optional<Target> target = strategy().choose(input);

  ASSERT_TRUE(target.has_value());
  EXPECT_EQ(target->mode, FlightMode::kCollector);
  EXPECT_EQ(target->candidate.cluster->id, 3U);
}

TEST(Choice, CollectorWhoseModeOnlySetsThePaceChoosesAsAnExplorer) {
  StrategyInput input = eastbound();
  input.candidates = {candidate_at(1, {5, 0, 0}, kFrontier), candidate_at(2, {-4, 0, 0}, kTrail)};
  ExplorerCollectorConfig config;
  EXPECT_EQ(strategy(config).choose(input)->candidate.cluster->id, 2U);
  config.mode.only_sets_pace = true;

  const std::optional<Target> target = strategy(config).choose(input);

  ASSERT_TRUE(target.has_value());
  EXPECT_EQ(target->mode, FlightMode::kCollector);
  EXPECT_EQ(target->candidate.cluster->id, 1U);
}

TEST(Choice, TwoEqualTargetsDoNotAlternate) {
  StrategyInput input;
  int changes = 0;
  for (int i = 0; i < 50; ++i) {
    // Equal but for a hair that tips the balance to and fro.
    const double hair_m = i % 2 == 0 ? 0.05 : -0.05;
    input.candidates = {candidate_at(1, {5.0 + hair_m, 0, 0}, kFrontier),
                        candidate_at(2, {5.0 - hair_m, 0.8, 0}, kFrontier)};
    const Target target = *strategy().choose(input);
    changes += input.target && target.candidate.cluster->id != input.target->id ? 1 : 0;
    input.target = target.candidate.cluster;
  }
  EXPECT_EQ(changes, 0);
}

TEST(Choice, NoCandidatesIsNoTargetAndNoCrash) {
  StrategyInput input;
  EXPECT_FALSE(strategy().choose(input).has_value());
  input.is_complete = true;
  EXPECT_FALSE(strategy().choose(input).has_value());
}

TEST(SetAside, PlaceIsLeftAloneForAWhileAndGivenUpAfterItsTries) {
  SetAsideList list(duration_from_seconds(10.0), 2);
  const ClusterPtr cluster = candidate_at(1, {3, 0, 1}, kTrail).cluster;

  EXPECT_FALSE(list.add(*cluster, Time{}));
  EXPECT_TRUE(list.is_waiting(*cluster, Time(duration_from_seconds(9.9))));
  EXPECT_FALSE(list.is_waiting(*cluster, Time(duration_from_seconds(10.1))));
  EXPECT_FALSE(list.is_given_up(*cluster));

  EXPECT_TRUE(list.add(*cluster, Time(duration_from_seconds(11))));
  EXPECT_TRUE(list.is_given_up(*cluster));
  EXPECT_FALSE(list.is_given_up(*candidate_at(2, {4, 0, 1}, kTrail).cluster));
}

TEST(SetAside, ViewThatShowedNothingIsNotTakenTwiceButAnotherHeadingIs) {
  SetAsideList list(duration_from_seconds(10.0), 2);
  const Viewpoint viewpoint = candidate_at(1, {3, 0, 1}, kTrail, 0.5).viewpoint;
  Viewpoint turned = viewpoint;
  turned.yaw_rad = 2.0;

  list.ban_view(viewpoint);

  EXPECT_TRUE(list.is_banned(viewpoint));
  EXPECT_FALSE(list.is_banned(turned));
}

}  // namespace
}  // namespace understory
