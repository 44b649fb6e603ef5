// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// What RViz shows of a mission: clusters (frontiers and trails), viewpoints, the target, the
// trajectory, the mode in words. World frame, metres. Pure functions; nothing here can fail.
#pragma once

#include <string>

#include <nav_msgs/Path.h>
#include <visualization_msgs/MarkerArray.h>

#include "understory/mission.hpp"

namespace understory {

struct MarkerContext {
  std::string map_frame;
  ros::Time stamp;
  double resolution_m = 0.1;
};

[[nodiscard]] visualization_msgs::MarkerArray mission_markers(const Mission& mission,
                                                              const MarkerContext& context);

[[nodiscard]] nav_msgs::Path to_path(const Trajectory& trajectory, const std::string& map_frame);

}  // namespace understory
