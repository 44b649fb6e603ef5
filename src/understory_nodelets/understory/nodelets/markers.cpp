// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/nodelets/markers.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "understory/nodelets/conversions.hpp"

namespace understory {
namespace {

using visualization_msgs::Marker;

constexpr Duration kPathStep = std::chrono::milliseconds(100);
constexpr std::size_t kMostPathPoints = 2000;

std_msgs::ColorRGBA color(const std::array<float, 4>& rgba) {
  std_msgs::ColorRGBA msg;
  msg.r = rgba[0];
  msg.g = rgba[1];
  msg.b = rgba[2];
  msg.a = rgba[3];
  return msg;
}

const std_msgs::ColorRGBA kFrontierColor = color({0.95F, 0.55F, 0.10F, 0.8F});
const std_msgs::ColorRGBA kTrailColor = color({0.65F, 0.25F, 0.85F, 0.9F});
const std_msgs::ColorRGBA kViewpointColor = color({0.10F, 0.60F, 0.95F, 0.9F});
const std_msgs::ColorRGBA kTargetColor = color({0.90F, 0.10F, 0.15F, 1.0F});
const std_msgs::ColorRGBA kTrajectoryColor = color({0.05F, 0.75F, 0.35F, 1.0F});
const std_msgs::ColorRGBA kTextColor = color({1.0F, 1.0F, 1.0F, 1.0F});

Marker marker(const MarkerContext& context,
              const char* name,
              int type,
              const std_msgs::ColorRGBA& marker_color) {
  Marker marker;
  marker.header.frame_id = context.map_frame;
  marker.header.stamp = context.stamp;
  marker.ns = name;
  marker.type = type;
  marker.action = Marker::ADD;
  marker.pose.orientation.w = 1.0;
  marker.color = marker_color;
  return marker;
}

Marker cubes(const MarkerContext& context,
             const char* name,
             const std_msgs::ColorRGBA& marker_color) {
  Marker cubes = marker(context, name, Marker::CUBE_LIST, marker_color);
  cubes.scale.x = cubes.scale.y = cubes.scale.z = context.resolution_m;
  return cubes;
}

// An empty list is an error to RViz: such a marker is taken away instead.
void add(Marker marker, visualization_msgs::MarkerArray& array) {
  const bool is_list = marker.type == Marker::CUBE_LIST || marker.type == Marker::LINE_STRIP ||
                       marker.type == Marker::LINE_LIST;
  if (is_list && marker.points.empty()) {
    marker.action = Marker::DELETE;
  }
  array.markers.push_back(std::move(marker));
}

void add_clusters(const Explorer& explorer,
                  const GridGeometry& geometry,
                  const MarkerContext& context,
                  visualization_msgs::MarkerArray& array) {
  Marker frontiers = cubes(context, "frontiers", kFrontierColor);
  Marker trails = cubes(context, "trails", kTrailColor);
  Marker viewpoints = marker(context, "viewpoints", Marker::LINE_LIST, kViewpointColor);
  viewpoints.scale.x = 0.05;
  for (const ClusterPtr& cluster : explorer.clusters()) {
    Marker& cells = cluster->is_trail() ? trails : frontiers;
    for (const VoxelIndex& voxel : cluster->voxels) {
      cells.points.push_back(to_point(geometry.center_of(voxel)));
    }
    if (!cluster->is_dormant()) {
      const Viewpoint& best = cluster->viewpoints.front();
      const Vector3d ahead(0.4 * std::cos(best.yaw_rad), 0.4 * std::sin(best.yaw_rad), 0.0);
      viewpoints.points.push_back(to_point(best.position_m));
      viewpoints.points.push_back(to_point(best.position_m + ahead));
    }
  }
  add(std::move(frontiers), array);
  add(std::move(trails), array);
  add(std::move(viewpoints), array);
}

void add_target(const Mission& mission,
                const MarkerContext& context,
                visualization_msgs::MarkerArray& array) {
  Marker target = marker(context, "target", Marker::SPHERE, kTargetColor);
  target.scale.x = target.scale.y = target.scale.z = 0.35;
  if (mission.explorer().target()) {
    target.pose.position = to_point(mission.explorer().target()->candidate.viewpoint.position_m);
  } else {
    target.action = Marker::DELETE;
  }
  array.markers.push_back(std::move(target));
}

void add_trajectory(const Trajectory& flown,
                    const MarkerContext& context,
                    visualization_msgs::MarkerArray& array) {
  Marker line = marker(context, "trajectory", Marker::LINE_STRIP, kTrajectoryColor);
  line.scale.x = 0.06;
  for (const geometry_msgs::PoseStamped& pose : to_path(flown, context.map_frame).poses) {
    line.points.push_back(pose.pose.position);
  }
  add(std::move(line), array);
}

}  // namespace

visualization_msgs::MarkerArray mission_markers(const Mission& mission,
                                                const MarkerContext& context) {
  visualization_msgs::MarkerArray array;
  const Time now = to_time(context.stamp);
  const Trajectory& flown = *mission.pilot().follower().newest();
  add_clusters(mission.explorer(), mission.pilot().clearance().geometry(), context, array);
  add_target(mission, context, array);
  add_trajectory(flown, context, array);
  Marker words = marker(context, "mode", Marker::TEXT_VIEW_FACING, kTextColor);
  words.scale.z = 0.6;
  words.pose.position = to_point(flown.sample(now).position_m + Vector3d(0.0, 0.0, 1.2));
  words.text = std::string(to_string(mission.state())) + " / " + to_string(flown.mode);
  array.markers.push_back(std::move(words));
  return array;
}

nav_msgs::Path to_path(const Trajectory& trajectory, const std::string& map_frame) {
  nav_msgs::Path path;
  path.header.frame_id = map_frame;
  path.header.stamp = to_ros(trajectory.start);
  const auto pieces = static_cast<std::size_t>(trajectory.duration() / kPathStep) + 1;
  const std::size_t points = std::min(pieces, kMostPathPoints);
  for (std::size_t i = 0; i <= points; ++i) {
    const Time time = trajectory.start + static_cast<std::int64_t>(i) * kPathStep;
    const TrajectoryPoint point = trajectory.sample(time);
    geometry_msgs::PoseStamped pose;
    pose.header.frame_id = map_frame;
    pose.header.stamp = to_ros(time);
    pose.pose.position = to_point(point.position_m);
    pose.pose.orientation.w = std::cos(0.5 * point.yaw_rad);
    pose.pose.orientation.z = std::sin(0.5 * point.yaw_rad);
    path.poses.push_back(pose);
  }
  return path;
}

}  // namespace understory
