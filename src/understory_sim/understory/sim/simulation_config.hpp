// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// Everything a lockstep mission is made of: the scene, the vehicle, and the onboard core's own
// configuration. SI units, world frame. Loaded from config/*.yaml, then the scenario, then the
// command line; whatever is wrong throws ConfigError at start.
#pragma once

#include <string>

#include "understory/explorer_config.hpp"
#include "understory/mission.hpp"
#include "understory/sim/depth_noise.hpp"
#include "understory/sim/forest_generator.hpp"
#include "understory/sim/radio.hpp"
#include "understory/sim/simulated_vehicle.hpp"

namespace understory {

struct BoxConfig {
  double x_min_m = -10.0;
  double y_min_m = -10.0;
  double z_min_m = 0.0;
  double x_max_m = 10.0;
  double y_max_m = 10.0;
  double z_max_m = 2.0;

  void visit(FieldVisitor& f) {
    f.field("x_min_m", x_min_m, in_range(-1e4, 1e4), "west side");
    f.field("y_min_m", y_min_m, in_range(-1e4, 1e4), "south side");
    f.field("z_min_m", z_min_m, in_range(-1e3, 1e3), "floor");
    f.field("x_max_m", x_max_m, in_range(-1e4, 1e4), "east side");
    f.field("y_max_m", y_max_m, in_range(-1e4, 1e4), "north side");
    f.field("z_max_m", z_max_m, in_range(-1e3, 1e3), "ceiling");
  }

  // Throws when it is empty.
  [[nodiscard]] Box3d box_m() const;
};

struct StartConfig {
  double x_m = 0.0;
  double y_m = 0.0;
  double z_m = 1.0;
  double yaw_rad = 0.0;
  double clearance_m = 1.0;

  void visit(FieldVisitor& f) {
    f.field("x_m", x_m, in_range(-1e4, 1e4), "east");
    f.field("y_m", y_m, in_range(-1e4, 1e4), "north");
    f.field("z_m", z_m, in_range(-1e3, 1e3), "up; lower than take-off height: a climb comes first");
    f.field("yaw_rad", yaw_rad, in_range(-6.3, 6.3), "heading, 0 is east");
    f.field("clearance_m",
            clearance_m,
            in_range(0.25, 10.0),
            "the start moves to the nearest point this far from every trunk");
  }
};

struct CropConfig {
  double x0_m = 0.0;
  double y0_m = 0.0;
  double width_m = 40.0;
  double height_m = 40.0;

  void visit(FieldVisitor& f) {
    f.field("x0_m", x0_m, in_range(-1e5, 1e5), "west side in the file's frame");
    f.field("y0_m", y0_m, in_range(-1e5, 1e5), "south side in the file's frame");
    f.field("width_m", width_m, in_range(2.0, 1e4), "along x");
    f.field("height_m", height_m, in_range(2.0, 1e4), "along y");
  }
};

struct SceneConfig {
  std::string name = "small";
  std::string source = "generated";
  std::string forest_file;
  std::string mesh_file;
  std::string crop_mode = "none";
  CropConfig crop;
  BoxConfig box;
  StartConfig start;
  double team_spacing_m = 4.0;
  GeneratorConfig generator;

  void visit(FieldVisitor& f) {
    f.field("name", name, {}, "shown in results");
    f.field("source", source, {"generated", "file"}, "where the trunks come from");
    f.field("forest_file", forest_file, {}, "stem map (CSV), with source: file");
    f.field(
        "mesh_file", mesh_file, {}, "triangle mesh (PLY, OBJ, STL) beside the trunks, or empty");
    f.field("crop_mode",
            crop_mode,
            {"none", "center", "rectangle"},
            "part of a stem map that makes the scene: all as it lies, a piece of the box's size "
            "from its middle, or the rectangle below; pieces are moved to be centred on (0, 0)");
    f.section("crop", crop, "With crop_mode: rectangle. The box takes its size.");
    f.section("box", box, "What is to be explored.");
    f.section("start", start, "Where the vehicle starts.");
    f.field("team_spacing_m",
            team_spacing_m,
            in_range(1.0, 1000.0),
            "a team starts in a row along the box's longer side, this far from each other");
    f.section("generator", generator, "With source: generated.");
  }
};

struct TeamLossConfig {
  int id = 0;
  double at_s = 0.0;

  void visit(FieldVisitor& f) {
    f.field("id", id, in_range(0, 31), "of the vehicle");
    f.field("at_s", at_s, in_range(0.0, 1e6), "from then on it is silent and does not move");
  }
};

struct SimulationConfig {
  SceneConfig scene;
  MissionConfig mission;
  VehicleConfig vehicle;
  ControlConfig control;
  PowerConfig power;
  can::SupervisorConfig autopilot;
  OdometryNoiseConfig odometry_noise;
  DepthNoiseConfig depth_noise;
  RadioConfig radio;
  std::vector<TeamLossConfig> team_losses;
  ExplorerConfig explorer;

  void visit(FieldVisitor& f) {
    f.section("scene", scene, "The world of a simulated mission.");
    f.section("mission", mission, "The mission around the exploration.");
    f.section("vehicle", vehicle, "The true vehicle.");
    f.section("control", control, "The autopilot's control law.");
    f.section("power", power, "ESCs and battery of the true vehicle.");
    f.section("autopilot", autopilot, "What the autopilot makes of silence and odd setpoints.");
    f.section("odometry_noise", odometry_noise, "What the simulated odometry does wrong.");
    f.section("depth_noise", depth_noise, "What the simulated camera does wrong.");
    f.section("radio", radio, "What carries words between the vehicles of a team.");
    f.list("team_losses", team_losses, "Vehicles that fail on the way, or never start (at 0 s).");
    explorer.visit(f);
  }
};

[[nodiscard]] SimulatedVehicleConfig vehicle_of(const SimulationConfig& config);
[[nodiscard]] Pose world_from_start(const StartConfig& start);

// Gives the box the size of the crop, centred on (0, 0); build_forest does so as well.
void adapt_box(SceneConfig& scene);

// Where the vehicles of a team would start, before trunks are in the way: in a row around the
// scene's start, by id along the box's longer side.
[[nodiscard]] std::vector<Vector2d> team_starts_m(const SceneConfig& scene, int team_size);

// The scene as vehicle `id` of the team finds it: with its start, clear of every trunk.
[[nodiscard]] SceneConfig scene_of_vehicle(SceneConfig scene,
                                           const Forest& forest,
                                           const team::TeamConfig& team);

// The scene's forest in the frame of the mission; adapts box and start to a crop.
[[nodiscard]] Forest build_forest(SceneConfig& scene, const Rng& rng, int team_size = 1);

}  // namespace understory
