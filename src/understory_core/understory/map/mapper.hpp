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
#include <memory>
#include <vector>

#include "understory/base/result.hpp"
#include "understory/base/time.hpp"
#include "understory/map/map_snapshot.hpp"
#include "understory/map/projective_integration.hpp"
#include "understory/map/scan_window.hpp"
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
  std::size_t missed_voxels = 0;   // lowered; those at the free clamp already do not count
  std::size_t skipped_points = 0;  // no measurement: NaN, zero, negative depth
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
  explicit Mapper(MapSnapshot resumed);  // ConfigError if its tiles do not fit its geometry

  // Projective integration of an organised cloud or depth image: the view frustum's voxels are
  // compared with the image once each. An image so coarse that rays would leave gaps between its
  // pixels within range is integrated ray by ray instead.
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

  // What the operator vouches for (the launch site): voxels whose centres lie in the region become
  // observed free, except those that returns have marked (log-odds of 0 and more).
  void mark_free(const Box3d& region_m, Time stamp);

  // The map as of now; its changed_tiles are those since the previous call.
  [[nodiscard]] MapSnapshotPtr publish();

  [[nodiscard]] const GridGeometry& geometry() const { return current_.geometry; }

 private:
  // Before the window is applied.
  void note_intruders();
  // Hits and misses of the window into the tiles; clones a tile only if a voxel of it changes.
  IntegrateCounts apply_window();
  IntegrateCounts apply_marks(TileSlot slot, const TileMarks& marks);
  bool update_voxel(TileSlot slot, std::size_t offset, bool is_hit);  // whether it changed
  void integrate_depth_rays(const CameraView& view, const DepthView& depth);
  Tile& writable_tile(TileSlot slot);

  MapSnapshot current_;
  // Written since the last publication and not yet seen by anyone else; also in current_.tiles.
  std::vector<std::shared_ptr<Tile>> private_tiles_;
  std::vector<TileSlot> touched_;
  ScanWindow window_;
  ProjectiveIntegration projective_;
};

}  // namespace understory
