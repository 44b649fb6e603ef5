// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// What only the onboard host can be set to: config/onboard.yaml. SI units; checked at start.
#pragma once

#include <string>

#include "understory/bridge/flight_loop.hpp"
#include "understory/dds/dds_config.hpp"
#include "understory/nodelets/bus_config.hpp"

namespace understory {

struct CloudConfig {
  int decimation = 1;
  double min_range_m = 0.2;
  int median_window_px = 1;
  double flying_pixel_jump_m = 0.0;
  double lidar_leaf_m = 0.05;
  double lidar_range_m = 12.0;

  void visit(FieldVisitor& f) {
    f.field("decimation", decimation, in_range(1, 16), "only every so many pixels are used");
    f.field("min_range_m", min_range_m, in_range(0.0, 5.0), "nearer depths are no measurement");
    f.field("median_window_px",
            median_window_px,
            in_range(1, 11),
            "median filter over so many pixels; 1: none");
    f.field("flying_pixel_jump_m",
            flying_pixel_jump_m,
            in_range(0.0, 5.0),
            "a pixel this far from all its neighbours' depths is dropped; 0: none is");
    f.field("lidar_leaf_m",
            lidar_leaf_m,
            in_range(0.0, 1.0),
            "LiDAR clouds are thinned to one point per cube of this edge; 0: not");
    f.field("lidar_range_m", lidar_range_m, in_range(0.5, 200.0), "LiDAR returns count so far");
  }
};

struct FramesConfig {
  std::string map = "map";
  std::string body = "base_link";
  std::string camera = "camera_optical";
  bool publish_extrinsics = true;
  double wait_s = 0.05;

  void visit(FieldVisitor& f) {
    f.field("map", map, {}, "frame of the map");
    f.field("body", body, {}, "frame of the vehicle");
    f.field("camera", camera, {}, "optical frame of the depth camera");
    f.field("publish_extrinsics",
            publish_extrinsics,
            "whether body to camera is published from the camera's configuration");
    f.field("wait_s",
            wait_s,
            in_range(0.0, 1.0),
            "a transform may be so late; then the frame is skipped and counted");
  }
};

struct WatchConfig {
  double frames_s = 5.0;
  double late_decision_s = 0.25;

  void visit(FieldVisitor& f) {
    f.field("frames_s",
            frames_s,
            in_range(0.2, 60.0),
            "so long without a new map in flight, and the mission ends where the vehicle is");
    f.field("late_decision_s",
            late_decision_s,
            in_range(0.02, 5.0),
            "a trajectory that is later than this behind its start is withdrawn");
  }
};

struct PublishConfig {
  double octomap_s = 1.0;
  double markers_s = 0.25;
  int whole_map_every = 15;

  void visit(FieldVisitor& f) {
    f.field("octomap_s", octomap_s, in_range(0.05, 60.0), "between two OctoMaps or point maps");
    f.field("markers_s", markers_s, in_range(0.02, 60.0), "between two sets of markers");
    f.field("whole_map_every",
            whole_map_every,
            in_range(1, 1000),
            "to other processes, every so many updates bring the whole map");
  }
};

struct OnboardConfig {
  CloudConfig cloud;
  FramesConfig frames;
  WatchConfig watch;
  PublishConfig publish;
  FlightConfig flight;
  BusConfig bus;
  dds::DdsConfig dds;

  void visit(FieldVisitor& f) {
    f.section("cloud", cloud, "From depth images and LiDAR to clouds.");
    f.section("frames", frames, "tf2.");
    f.section("watch", watch, "What is too late.");
    f.section("publish", publish, "What others may look at.");
    f.section("flight", flight, "The flight thread.");
    f.section("bus", bus, "The vehicle at the other end.");
    f.section("dds", dds, "The radio to team mates; without a team it is not used.");
  }
};

}  // namespace understory
