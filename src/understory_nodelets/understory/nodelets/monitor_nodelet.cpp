// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// Says in diagnostics which link of the chain is silent: a stage that hangs cannot say so itself.
// In: camera/depth/image_rect's camera_info, map_updates, odometry, status. Out: /diagnostics.
#include <memory>

#include <diagnostic_msgs/DiagnosticArray.h>
#include <nav_msgs/Odometry.h>
#include <pluginlib/class_list_macros.hpp>
#include <sensor_msgs/CameraInfo.h>
#include <understory_msgs/MissionStatus.h>

#include "understory/bridge/flight_loop.hpp"
#include "understory/nodelets/flight_setup.hpp"
#include "understory/nodelets/guarded_nodelet.hpp"
#include "understory/nodelets/map_update.hpp"

namespace understory {

class MonitorNodelet : public GuardedNodelet {
 private:
  struct Link {
    const char* name = "";
    double patience_s = 0.0;
    std::int64_t last_ns = 0;
    std::uint64_t messages = 0;

    void seen() {
      last_ns = steady_ns();
      ++messages;
    }
    [[nodiscard]] double silent_s() const {
      return static_cast<double>(steady_ns() - last_ns) * 1e-9;
    }
  };

  void start() override {
    ros::NodeHandle& nh = getNodeHandle();
    const ros::TransportHints hints = ros::TransportHints().tcpNoDelay();
    info_subscriber_ = nh.subscribe<sensor_msgs::CameraInfo>(
        "camera/depth/camera_info",
        1,
        [this](const sensor_msgs::CameraInfoConstPtr&) { camera_.seen(); },
        {},
        hints);
    map_subscriber_ = nh.subscribe<MapUpdate>(
        "map_updates", 1, [this](const MapUpdatePtr&) { map_.seen(); }, {}, hints);
    odometry_subscriber_ = nh.subscribe<nav_msgs::Odometry>(
        "odometry", 1, [this](const nav_msgs::OdometryConstPtr&) { odometry_.seen(); }, {}, hints);
    status_subscriber_ = nh.subscribe<understory_msgs::MissionStatus>(
        "status",
        1,
        [this](const understory_msgs::MissionStatusConstPtr&) { mission_.seen(); },
        {},
        hints);
  }

  [[nodiscard]] Health health() override {
    using diagnostic_msgs::DiagnosticStatus;
    std::string silent;
    bool was_heard = true;
    for (const Link* link : {&odometry_, &camera_, &map_, &mission_}) {
      set_counter(std::string(link->name) + "_messages", link->messages);
      if (link->messages == 0 || link->silent_s() > link->patience_s) {
        silent += (silent.empty() ? "" : ", ") + std::string(link->name);
        was_heard = was_heard && link->messages > 0;
      }
    }
    if (silent.empty()) {
      return {};
    }
    Health found;
    found.level = was_heard ? DiagnosticStatus::ERROR : DiagnosticStatus::WARN;
    found.message = (was_heard ? "silent: " : "not yet heard: ") + silent;
    return found;
  }

  Link odometry_{"odometry", 0.5};
  Link camera_{"camera", 1.0};
  Link map_{"map", 1.0};
  Link mission_{"mission", 2.0};
  ros::Subscriber info_subscriber_;
  ros::Subscriber map_subscriber_;
  ros::Subscriber odometry_subscriber_;
  ros::Subscriber status_subscriber_;
};

}  // namespace understory

PLUGINLIB_EXPORT_CLASS(understory::MonitorNodelet, nodelet::Nodelet)
