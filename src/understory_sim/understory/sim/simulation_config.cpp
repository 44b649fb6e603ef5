// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/sim/simulation_config.hpp"

#include "understory/sim/forest_csv.hpp"
#include "understory/sim/mesh_reader.hpp"

namespace understory {
namespace {

Box2d extent_of(const Forest& forest) {
  Box2d extent;
  for (const Trunk& trunk : forest.trunks) {
    extent.extend(trunk.center_m);
  }
  return extent;
}

Forest cropped_to_scene(const Forest& forest, SceneConfig& scene) {
  adapt_box(scene);
  CropConfig& crop = scene.crop;
  if (scene.crop_mode == "center") {
    const Vector2d middle = extent_of(forest).center();
    crop.x0_m = middle.x() - 0.5 * crop.width_m;
    crop.y0_m = middle.y() - 0.5 * crop.height_m;
  }
  const Vector2d corner(crop.x0_m, crop.y0_m);
  const Vector2d size(crop.width_m, crop.height_m);
  Forest piece = centered_crop(forest, Box2d(corner, Vector2d(corner + size)));
  if (piece.trunks.empty()) {
    throw ForestError(scene.forest_file + ": the crop holds no trunk");
  }
  return piece;
}

// Moves the start to where the vehicle has room.
void clear_start(SceneConfig& scene, const Forest& forest) {
  const Box3d box = scene.box.box_m();
  const std::optional<Vector2d> start =
      nearest_clear_point(forest,
                          Box2d(Vector2d(box.min().head<2>()), Vector2d(box.max().head<2>())),
                          Vector2d(scene.start.x_m, scene.start.y_m),
                          scene.start.clearance_m);
  if (!start) {
    throw ForestError("scene.start: no point of the box has " +
                      std::to_string(scene.start.clearance_m) + " m clearance to every trunk");
  }
  scene.start.x_m = start->x();
  scene.start.y_m = start->y();
}

}  // namespace

Box3d BoxConfig::box_m() const {
  const Box3d box(Vector3d(x_min_m, y_min_m, z_min_m), Vector3d(x_max_m, y_max_m, z_max_m));
  if (box.isEmpty() || box.sizes().minCoeff() <= 0.0) {
    throw ConfigError("scene.box: each minimum must lie below its maximum");
  }
  return box;
}

SimulatedVehicleConfig vehicle_of(const SimulationConfig& config) {
  SimulatedVehicleConfig vehicle;
  vehicle.vehicle = config.vehicle;
  vehicle.control = config.control;
  vehicle.power = config.power;
  vehicle.supervisor = config.autopilot;
  vehicle.odometry_noise = config.odometry_noise;
  return vehicle;
}

Pose world_from_start(const StartConfig& start) {
  Pose world_from_start = Pose::Identity();
  world_from_start.translation() = Vector3d(start.x_m, start.y_m, start.z_m);
  world_from_start.linear() =
      Eigen::AngleAxisd(start.yaw_rad, Vector3d::UnitZ()).toRotationMatrix();
  return world_from_start;
}

void adapt_box(SceneConfig& scene) {
  if (scene.source != "file" || scene.crop_mode == "none") {
    return;
  }
  CropConfig& crop = scene.crop;
  BoxConfig& box = scene.box;
  if (scene.crop_mode == "center") {
    crop.width_m = box.x_max_m - box.x_min_m;
    crop.height_m = box.y_max_m - box.y_min_m;
  }
  box.x_min_m = -0.5 * crop.width_m;
  box.x_max_m = 0.5 * crop.width_m;
  box.y_min_m = -0.5 * crop.height_m;
  box.y_max_m = 0.5 * crop.height_m;
}

std::vector<Vector2d> team_starts_m(const SceneConfig& scene, int team_size) {
  const Vector3d size_m = scene.box.box_m().sizes();
  const Vector2d along = size_m.y() > size_m.x() ? Vector2d::UnitY() : Vector2d::UnitX();
  std::vector<Vector2d> starts_m;
  for (int id = 0; id < team_size; ++id) {
    const double offset_m = scene.team_spacing_m * (id - 0.5 * (team_size - 1));
    starts_m.push_back(Vector2d(scene.start.x_m, scene.start.y_m) + offset_m * along);
  }
  return starts_m;
}

SceneConfig scene_of_vehicle(SceneConfig scene,
                             const Forest& forest,
                             const team::TeamConfig& team) {
  const Vector2d start_m = team_starts_m(scene, team.size)[static_cast<std::size_t>(team.id)];
  scene.start.x_m = start_m.x();
  scene.start.y_m = start_m.y();
  clear_start(scene, forest);
  return scene;
}

Forest build_forest(SceneConfig& scene, const Rng& rng, int team_size) {
  Forest forest;
  if (scene.source == "generated") {
    GeneratorConfig generator = scene.generator;
    if (team_size > 1) {
      for (const Vector2d& start_m : team_starts_m(scene, team_size)) {
        generator.starts.push_back({start_m.x(), start_m.y()});
      }
    }
    forest = generate_forest(generator, rng);
  } else {
    if (scene.forest_file.empty()) {
      throw ConfigError(
          "scene.forest_file: needed with scene.source: file (or give --forest FILE)");
    }
    forest = read_forest_csv(scene.forest_file);
    if (scene.crop_mode != "none") {
      forest = cropped_to_scene(forest, scene);
    }
  }
  if (!scene.mesh_file.empty()) {
    forest.meshes.push_back(read_mesh(scene.mesh_file));
  }
  clear_start(scene, forest);
  return forest;
}

}  // namespace understory
