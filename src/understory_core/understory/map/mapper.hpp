// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// Integrates clouds into voxel tiles and publishes immutable snapshots. World frame, metres. A
// voxel that receives a return in a cloud is a hit for that cloud even if other rays pass it, as
// octomap::OcTree::insertPointCloud has it; every voxel changes at most once per cloud. Only voxels
// inside the box are stored. Used by one thread. Bad input (non-finite pose, image of another
// size) changes nothing and is returned as an error; non-finite points are skipped and counted.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "understory/base/result.hpp"
#include "understory/base/time.hpp"
#include "understory/map/map_snapshot.hpp"
#include "understory/sense/camera_model.hpp"

namespace understory {

struct MapConfig {
  double resolution_m = 0.10;
  SensorModelConfig sensor;

  void visit(FieldVisitor& f) {
    f.field("resolution_m", resolution_m, in_range(0.02, 1.0), "edge of a voxel");
    f.section("sensor", sensor, "Occupancy update: clamped log-odds.");
  }
};

enum class IntegrateError { kBadPose, kImageSizeMismatch };
[[nodiscard]] const char* to_string(IntegrateError error);

struct IntegrateCounts {
  std::size_t hit_voxels = 0;
  std::size_t missed_voxels = 0;
  std::size_t skipped_points = 0;  // NaN: no measurement
};

// Borrowed points of an unorganised cloud, each three floats in the sensor's frame.
struct PointsView {
  const float* xyz_m = nullptr;
  std::size_t stride_floats = 3;
  std::size_t count = 0;
};

class Mapper {
 public:
  Mapper(const MapConfig& config, const Box3d& box_m);
  // Goes on from a saved map of the same geometry.
  explicit Mapper(MapSnapshot resumed);

  // Projective integration of an organised cloud or depth image: the view frustum's voxels are
  // compared with the image once each.
  Result<IntegrateCounts, IntegrateError> integrate(const CameraModel& camera,
                                                    const DepthView& depth,
                                                    const Pose& world_from_optical,
                                                    Time exposure);

  // Ray integration of any cloud (LiDAR). Points beyond max_range_m, +inf ones included when their
  // direction is finite, clear up to max_range_m and mark nothing.
  Result<IntegrateCounts, IntegrateError> integrate_rays(const PointsView& points,
                                                         const Pose& world_from_sensor,
                                                         double max_range_m,
                                                         Time exposure);

  // What the operator vouches for (the launch site): observed free, unless already occupied.
  void mark_free(const Box3d& region_m, Time stamp);

  // The map as of now; its changed_tiles are those since the previous call.
  [[nodiscard]] MapSnapshotPtr publish();

  [[nodiscard]] const GridGeometry& geometry() const { return current_.geometry; }

 private:
  Tile& writable_tile(TileSlot slot);

  MapSnapshot current_;
  std::vector<std::uint8_t> tile_is_private_;  // written since the last publication
  std::vector<TileSlot> touched_;
};

}  // namespace understory
