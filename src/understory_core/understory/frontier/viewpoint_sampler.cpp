// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/frontier/viewpoint_sampler.hpp"

#include <algorithm>
#include <cmath>

#include "understory/plan/line_of_sight.hpp"

namespace understory {
namespace {

constexpr std::size_t kSampledVoxels = 12;  // of a cluster, evenly spread over its list
constexpr double kFovMargin = 0.95;         // a voxel at the very edge of the image does not count

struct YawChoice {
  double yaw_rad;
  std::size_t in_view;
};

// How many of a cluster's sampled voxels a view has to show to be among those kept: more than the
// worst of them, as soon as there are that many.
class Threshold {
 public:
  Threshold(std::size_t least, std::size_t most, std::size_t max_kept)
      : needed_(least), room_(max_kept), kept_(most + 1, 0) {}

  [[nodiscard]] std::size_t needed() const { return needed_; }
  [[nodiscard]] bool is_full() const { return needed_ >= kept_.size(); }
  void keep(std::size_t in_view) {
    ++kept_[in_view];
    better_ += in_view >= needed_ ? 1U : 0U;
    while (!is_full() && better_ >= room_) {
      better_ -= kept_[needed_++];
    }
  }

 private:
  std::size_t needed_;
  std::size_t room_;
  std::size_t better_ = 0;         // kept, and at least as good as needed
  std::vector<std::size_t> kept_;  // by how many they show
};

// The heading that has the most of these bearings in a window of this half width.
YawChoice best_yaw(std::vector<double> bearings_rad, double half_width_rad) {
  std::sort(bearings_rad.begin(), bearings_rad.end());
  const std::size_t count = bearings_rad.size();
  YawChoice best{bearings_rad.front(), 0};
  for (std::size_t first = 0; first < count; ++first) {
    std::size_t in_view = 1;
    double spread_rad = 0.0;
    while (in_view < count) {
      const std::size_t next = first + in_view;
      const double bearing =
          bearings_rad[next % count] + (next >= count ? 2.0 * kPi : 0.0) - bearings_rad[first];
      if (bearing > 2.0 * half_width_rad) {
        break;
      }
      spread_rad = bearing;
      ++in_view;
    }
    if (in_view > best.in_view) {
      best = {wrap_angle(bearings_rad[first] + 0.5 * spread_rad), in_view};
    }
  }
  return best;
}

}  // namespace

ViewpointSampler::ViewpointSampler(const ViewpointConfig& config, const CameraConfig& camera)
    : config_(config),
      half_horizontal_fov_rad_(0.5 * kFovMargin * camera.horizontal_fov_rad),
      vertical_slope_(std::tan(0.5 * kFovMargin * camera.vertical_fov_rad)),
      max_range_m_(kFovMargin * camera.max_range_m) {
  if (config.min_radius_m > config.max_radius_m) {
    throw ConfigError("frontier.viewpoints.min_radius_m: larger than max_radius_m");
  }
}

std::vector<RouteLattice::Node> ViewpointSampler::candidates(const ClearanceMap& map,
                                                             const RouteSearch& routes,
                                                             const Cluster& cluster) const {
  const RouteLattice& lattice = routes.lattice();
  const int layers = lattice.count().z();
  std::vector<std::size_t> indices;
  const double rings = (config_.max_radius_m - config_.min_radius_m) / config_.radius_step_m;
  const double spokes = 2.0 * kPi / config_.angle_step_rad;
  for (int ring = 0; ring <= rings + 1e-6; ++ring) {
    const double radius_m = config_.min_radius_m + ring * config_.radius_step_m;
    for (int spoke = 0; spoke < spokes - 1e-6; ++spoke) {
      const double angle_rad = spoke * config_.angle_step_rad;
      const Vector3d point =
          cluster.mean_m + radius_m * Vector3d(std::cos(angle_rad), std::sin(angle_rad), 0.0);
      const RouteLattice::Node middle = lattice.nearest(point);
      for (int layer = std::max(middle.z() - 1, 0); layer <= std::min(middle.z() + 1, layers - 1);
           ++layer) {
        const RouteLattice::Node node(middle.x(), middle.y(), layer);
        if (routes.passable(map, node) &&
            map.clearance_at_least(lattice.point_of(node), config_.unknown_distance_m)) {
          indices.push_back(lattice.index_of(node));
        }
      }
    }
  }
  std::sort(indices.begin(), indices.end());
  indices.erase(std::unique(indices.begin(), indices.end()), indices.end());
  std::vector<RouteLattice::Node> nodes;
  nodes.reserve(indices.size());
  for (const std::size_t index : indices) {
    nodes.push_back(lattice.node_of_index(index));
  }
  return nodes;
}

bool ViewpointSampler::is_in_reach(const Vector3d& from_m, const Vector3d& to_m) const {
  const Vector3d ray = to_m - from_m;
  const double horizontal_square = ray.head<2>().squaredNorm();
  return ray.squaredNorm() <= max_range_m_ * max_range_m_ &&
         ray.z() * ray.z() <= vertical_slope_ * vertical_slope_ * horizontal_square;
}

// The bearings of those in view, or of fewer than `needed` when so many cannot be.
std::vector<double> ViewpointSampler::bearings_in_view(const ClearanceMap& map,
                                                       const Vector3d& from_m,
                                                       const std::vector<Vector3d>& places_m,
                                                       std::size_t needed) const {
  std::vector<double> bearings;
  auto possible = static_cast<std::size_t>(
      std::count_if(places_m.begin(), places_m.end(), [&](const Vector3d& place_m) {
        return is_in_reach(from_m, place_m);
      }));
  for (const Vector3d& place_m : places_m) {
    if (possible < needed) {
      break;
    }
    if (!is_in_reach(from_m, place_m)) {
      continue;
    }
    if (line_is_free(map, from_m, place_m)) {
      bearings.push_back(std::atan2(place_m.y() - from_m.y(), place_m.x() - from_m.x()));
    } else {
      --possible;
    }
  }
  return bearings;
}

std::vector<Viewpoint> ViewpointSampler::sample(const ClearanceMap& map,
                                                const RouteSearch& routes,
                                                const Cluster& cluster) const {
  std::vector<Vector3d> sampled;
  const std::size_t count = std::min(cluster.voxels.size(), kSampledVoxels);
  sampled.reserve(count);
  for (std::size_t i = 0; i < count; ++i) {
    sampled.push_back(map.geometry().center_of(cluster.voxels[i * cluster.voxels.size() / count]));
  }
  const auto least = std::max<std::size_t>(
      1, static_cast<std::size_t>(std::ceil(config_.min_coverage * static_cast<double>(count))));
  Threshold threshold(least, count, static_cast<std::size_t>(config_.max_kept));
  std::vector<Viewpoint> viewpoints;
  for (const RouteLattice::Node& node : candidates(map, routes, cluster)) {
    if (threshold.is_full()) {
      break;
    }
    const Vector3d position = routes.lattice().point_of(node);
    std::vector<double> bearings = bearings_in_view(map, position, sampled, threshold.needed());
    if (bearings.size() < threshold.needed()) {
      continue;
    }
    const YawChoice yaw = best_yaw(std::move(bearings), half_horizontal_fov_rad_);
    const double coverage = static_cast<double>(yaw.in_view) / static_cast<double>(count);
    if (coverage >= config_.min_coverage) {
      viewpoints.push_back({node, position, yaw.yaw_rad, coverage});
      threshold.keep(yaw.in_view);
    }
  }
  std::stable_sort(viewpoints.begin(),
                   viewpoints.end(),
                   [](const Viewpoint& a, const Viewpoint& b) { return a.coverage > b.coverage; });
  if (viewpoints.size() > static_cast<std::size_t>(config_.max_kept)) {
    viewpoints.resize(static_cast<std::size_t>(config_.max_kept));
  }
  return viewpoints;
}

}  // namespace understory
