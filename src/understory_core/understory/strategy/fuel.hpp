// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// The paper's baseline, FUEL (Zhou, Zhang, Chen and Shen 2021, section V): the shortest tour over
// all clusters, then the best of the views of the clusters that come next. World frame, SI units.
// What is remembered are lengths between clusters and the last tour; one thread, deterministic.
#pragma once

#include "understory/base/config.hpp"
#include "understory/strategy/cluster_lengths.hpp"
#include "understory/strategy/open_tour.hpp"
#include "understory/strategy/strategy.hpp"

namespace understory {

struct FuelConfig {
  double direction_weight = 1.5;
  int refined_clusters = 7;
  double refined_radius_m = 5.0;
  int refined_views = 15;
  double least_view_share = 0.8;
  int tour_kicks = 12;

  void visit(FieldVisitor& f) {
    f.field("direction_weight",
            direction_weight,
            in_range(0.0, 100.0),
            "seconds per radian between the velocity and what the tour begins with");
    f.field("refined_clusters",
            refined_clusters,
            in_range(1, 50),
            "of so many clusters that come next the views are chosen together");
    f.field("refined_radius_m",
            refined_radius_m,
            in_range(0.5, 100.0),
            "up to the first one that is further away than this");
    f.field("refined_views", refined_views, in_range(1, 100), "of each cluster, best first");
    f.field("least_view_share",
            least_view_share,
            in_range(0.0, 1.0),
            "as long as they see this share of what the best one sees");
    f.field("tour_kicks", tour_kicks, in_range(0, 10000), "attempts to leave a local optimum");
  }
};

struct FuelRates {
  double speed_mps = 1.5;
  double yaw_rate_radps = 0.9;
  double clearance_m = 0.3;  // of ways between clusters
};

class Fuel final : public Strategy {
 public:
  Fuel(const FuelConfig& config, const FuelRates& rates, const GridGeometry& geometry);

  [[nodiscard]] std::optional<Target> choose(const StrategyInput& input) override;
  [[nodiscard]] bool needs_all() const override { return true; }

 private:
  // The candidates of a cluster lie in a row, best first.
  struct Group {
    const Candidate* begin = nullptr;
    const Candidate* end = nullptr;
  };

  [[nodiscard]] static std::vector<Group> groups_of(const std::vector<Candidate>& candidates);
  [[nodiscard]] double first_cost(const TrajectoryPoint& vehicle, const Candidate& to) const;
  [[nodiscard]] double cost(const Viewpoint& from, const Viewpoint& to, double length_m) const;
  [[nodiscard]] Tour tour_over(const StrategyInput& input, const std::vector<Group>& groups);
  [[nodiscard]] std::vector<Group> next_of(const StrategyInput& input,
                                           const std::vector<Group>& groups,
                                           const Tour& tour) const;
  [[nodiscard]] const Candidate& refine(const StrategyInput& input,
                                        const std::vector<Group>& next) const;

  FuelConfig config_;
  FuelRates rates_;
  ClusterLengths lengths_;
  std::vector<std::uint32_t> last_tour_;  // cluster ids
};

}  // namespace understory
