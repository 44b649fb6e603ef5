// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/sim/coverage_truth.hpp"

#include <algorithm>
#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "understory/base/rng.hpp"
#include "understory/sim/voxel_mask.hpp"

namespace understory {
namespace {

constexpr double kVehicleRadius_m = 0.20;

// NOLINTNEXTLINE(readability-function-size): six bounds read best as six numbers
Box3d box(double x0, double y0, double z0, double x1, double y1, double z1) {
  return {Vector3d(x0, y0, z0), Vector3d(x1, y1, z1)};
}

CameraConfig short_sighted_camera() {
  CameraConfig camera;
  camera.max_range_m = 1.5;
  return camera;
}

CoverageTruth truth_of(const Forest& forest,
                       const GridGeometry& geometry,
                       const CameraConfig& camera) {
  return {ForestTruth(forest), geometry, {Vector3d(0, 0, 1)}, camera, kVehicleRadius_m};
}

// The definition, voxel by voxel and place by place, with nothing shared or sorted. `slack` widens
// what counts as in view (negative: narrows), to bracket rounding at the borders of the view.
class BruteForce {
 public:
  BruteForce(const Forest& forest, const GridGeometry& geometry, const CameraConfig& camera)
      : forest_(forest), geometry_(geometry), camera_(camera) {
    reach({0, 0, 0});
  }

  [[nodiscard]] bool is_free(const VoxelIndex& voxel) const {
    const Vector2d low = voxel.head<2>().cast<double>() * geometry_.resolution_m();
    const Box2d square(low, low + Vector2d::Constant(geometry_.resolution_m()));
    return std::none_of(forest_.trunks.begin(), forest_.trunks.end(), [&](const Trunk& trunk) {
      return square.exteriorDistance(trunk.center_m) < trunk.radius_m;
    });
  }

  [[nodiscard]] bool is_visible(const VoxelIndex& voxel, double slack) const {
    const Vector3d target = geometry_.center_of(voxel);
    return std::any_of(places_.begin(), places_.end(), [&](const Vector2d& place) {
      return place != target.head<2>() && in_view_from(place, target, slack) &&
             line_is_clear(place, target.head<2>(), slack);
    });
  }

 private:
  [[nodiscard]] double clearance(const Vector2d& point) const {
    double best_m = 1e9;
    for (const Trunk& trunk : forest_.trunks) {
      best_m = std::min(best_m, (trunk.center_m - point).norm() - trunk.radius_m);
    }
    return best_m;
  }

  void reach(const VoxelIndex& voxel) {
    const Vector2d place = geometry_.center_of(voxel).head<2>();
    if (!geometry_.contains(voxel) || clearance(place) < kVehicleRadius_m ||
        std::find(places_.begin(), places_.end(), place) != places_.end()) {
      return;
    }
    places_.push_back(place);
    for (const auto& [dx, dy] :
         {std::pair(1, 0), std::pair(-1, 0), std::pair(0, 1), std::pair(0, -1)}) {
      reach(voxel + VoxelIndex(dx, dy, 0));
    }
  }

  [[nodiscard]] bool in_view_from(const Vector2d& place,
                                  const Vector3d& target,
                                  double slack) const {
    const double flat_m = (target.head<2>() - place).norm();
    // NOLINTNEXTLINE(bugprone-float-loop-counter,cert-flp30-c): a coarse scan
    for (double z_m = kVehicleRadius_m; z_m <= geometry_.box_m().max().z() + 1e-9; z_m += 0.01) {
      const double rise_m = target.z() - z_m;
      if (std::abs(std::atan2(rise_m, flat_m)) <= 0.5 * camera_.vertical_fov_rad + slack &&
          std::hypot(flat_m, rise_m) <= camera_.max_range_m + slack) {
        return true;
      }
    }
    return false;
  }

  [[nodiscard]] bool line_is_clear(const Vector2d& from, const Vector2d& to, double slack) const {
    for (int i = 0; i <= 200; ++i) {
      if (clearance(from + 0.005 * i * (to - from)) < -0.1 * slack) {
        return false;
      }
    }
    return true;
  }

  const Forest& forest_;
  const GridGeometry& geometry_;
  const CameraConfig& camera_;
  std::vector<Vector2d> places_;
};

TEST(CoverageTruth, IsWhatBruteForceFindsInTinyForests) {
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    Rng rng(seed);
    Forest forest;
    while (forest.trunks.size() < 7) {
      const double x_m = rng.uniform(-1.6, 1.6);
      const Vector2d center_m(x_m, rng.uniform(-1.6, 1.6));
      if (center_m.norm() > 0.7) {
        forest.trunks.push_back({center_m, rng.uniform(0.05, 0.4)});
      }
    }
    const GridGeometry geometry(0.2, box(-1.4, -1.4, 0, 1.8, 1.6, 1.2));
    const CameraConfig camera = short_sighted_camera();
    const BruteForce brute(forest, geometry, camera);

    const CoverageTruth truth = truth_of(forest, geometry, camera);

    std::size_t count = 0;
    for_each_voxel(geometry.voxels(), [&](const VoxelIndex& voxel) {
      const bool found = truth.contains(voxel);
      count += found ? 1U : 0U;
      if (!brute.is_free(voxel)) {
        EXPECT_FALSE(found) << "seed " << seed << ", not free: " << voxel.transpose();
      } else if (found) {
        EXPECT_TRUE(brute.is_visible(voxel, 0.01)) << "seed " << seed << ": " << voxel.transpose();
      } else {
        EXPECT_FALSE(brute.is_visible(voxel, -0.01))
            << "seed " << seed << ": " << voxel.transpose();
      }
    });
    EXPECT_EQ(truth.voxel_count(), count) << "seed " << seed;
  }
}

TEST(CoverageTruth, StoresItsBitsAsTilesDo) {
  const GridGeometry geometry(0.1, box(-2.05, -1, 0, 2, 1, 1));
  const CoverageTruth truth = truth_of(Forest{}, geometry, CameraConfig{});

  std::size_t bits = 0;
  for (TileSlot slot = 0; slot < geometry.slot_count(); ++slot) {
    const VoxelIndex first = geometry.tile_of_slot(slot) * kTileVoxels;
    for (int i = 0; i < static_cast<int>(kVoxelsPerTile); ++i) {
      const VoxelIndex voxel = first + VoxelIndex(i % 16, i / 16 % 16, i / 256);
      const bool bit = (truth.rows(slot)[row_in_tile(voxel.y(), voxel.z())] >> (i % 16) & 1) != 0;
      EXPECT_EQ(bit, truth.contains(voxel)) << voxel.transpose();
      bits += bit ? 1U : 0U;
    }
  }
  EXPECT_EQ(bits, truth.voxel_count());
}

TEST(CoverageTruth, HoldsAllOfAnEmptyBoxButWhatIsBelowTheView) {
  const GridGeometry geometry(0.1, box(-3, -3, 0, 3, 3, 2));
  CameraConfig camera;
  camera.vertical_fov_rad = 0.2;

  const CoverageTruth wide = truth_of(Forest{}, geometry, CameraConfig{});
  const CoverageTruth narrow = truth_of(Forest{}, geometry, camera);

  EXPECT_EQ(wide.voxel_count(), 60U * 60U * 20U);
  EXPECT_TRUE(narrow.contains({0, 0, 0}));  // from 1.5 m away and more
  EXPECT_EQ(narrow.voxel_count(), 60U * 60U * 20U);
}

TEST(CoverageTruth, LeavesOutWhatACameraThatLooksUpCannotSee) {
  const GridGeometry geometry(0.1, box(-3, -3, 0, 3, 3, 2));
  CameraConfig camera;
  camera.vertical_fov_rad = 0.2;
  camera.mount_pitch_rad = -0.3;  // 0.2 rad above the horizon and more

  const CoverageTruth truth = truth_of(Forest{}, geometry, camera);

  EXPECT_FALSE(truth.contains({0, 0, 1}));
  EXPECT_TRUE(truth.contains({0, 0, 2}));  // from 0.1 m away and 3 cm below
}

TEST(CoverageTruth, LeavesOutAPocketThatTheVehicleCannotEnterAndNothingSees) {
  Forest forest;  // a ring of touching trunks of 1 m radius
  for (int i = 0; i < 16; ++i) {
    const double angle_rad = 2 * kPi * i / 16;
    forest.trunks.push_back({Vector2d(3 + std::cos(angle_rad), std::sin(angle_rad)), 0.25});
  }
  const GridGeometry geometry(0.1, box(-5, -5, 0, 5, 5, 2));

  const CoverageTruth truth = truth_of(forest, geometry, CameraConfig{});

  EXPECT_FALSE(truth.contains(geometry.index_of({3, 0, 1})));
  EXPECT_TRUE(truth.contains(geometry.index_of({3, 1.6, 1})));
  EXPECT_TRUE(truth.contains(geometry.index_of({4.6, 0, 1})));
}

TEST(CoverageTruth, CountsWhatIsSeenThroughAGapThatTheVehicleCannotPass) {
  Forest forest;  // a wall across the box with a gap of 0.3 m
  for (int i = 0; i < 40; ++i) {
    const double y_m = -3.0 + 0.15 * i;
    if (std::abs(y_m) > 0.24) {
      forest.trunks.push_back({Vector2d(2, y_m), 0.1});
    }
  }
  const GridGeometry geometry(0.1, box(-3, -2, 0, 5, 2, 2));

  const CoverageTruth truth = truth_of(forest, geometry, CameraConfig{});

  EXPECT_TRUE(truth.contains(geometry.index_of({3.05, 0.05, 1})));
  EXPECT_FALSE(truth.contains(geometry.index_of({2.45, 1.55, 1})));
}

TEST(CoverageTruth, CountsTheGroundOfEveryVehicleOfATeam) {
  Forest forest;  // a closed wall at x = 0
  for (int i = 0; i < 40; ++i) {
    forest.trunks.push_back({Vector2d(0, -2.9 + 0.15 * i), 0.1});
  }
  const GridGeometry geometry(0.1, box(-3, -2, 0, 3, 2, 2));
  const ForestTruth world(forest);

  const CoverageTruth west(world, geometry, {Vector3d(-2, 0, 1)}, CameraConfig{}, kVehicleRadius_m);
  const CoverageTruth east(world, geometry, {Vector3d(2, 0, 1)}, CameraConfig{}, kVehicleRadius_m);
  const CoverageTruth both(
      world, geometry, {Vector3d(-2, 0, 1), Vector3d(2, 0, 1)}, CameraConfig{}, kVehicleRadius_m);

  EXPECT_FALSE(west.contains({20, 0, 10}));
  EXPECT_EQ(both.voxel_count(), west.voxel_count() + east.voxel_count());
}

TEST(CoverageTruth, RefusesAStartWithoutRoom) {
  Forest forest;
  forest.trunks = {{Vector2d(0, 0), 0.8}};
  const GridGeometry geometry(0.1, box(-3, -3, 0, 3, 3, 2));
  try {
    (void)truth_of(forest, geometry, CameraConfig{});
    FAIL() << "accepted a start inside a trunk";
  } catch (const ForestError& error) {
    EXPECT_THAT(error.what(), testing::HasSubstr("start (0, 0)"));
  }
  EXPECT_THROW(
      (void)CoverageTruth(
          ForestTruth(Forest{}), geometry, {Vector3d(9, 9, 1)}, CameraConfig{}, kVehicleRadius_m),
      ForestError);
}

// A triangle out of everybody's sight makes the same forest a world with meshes.
TEST(CoverageTruth, FindsNearlyTheSameByRaysAsInColumns) {
  Rng rng(3);
  Forest forest;
  while (forest.trunks.size() < 12) {
    const double x_m = rng.uniform(-3, 3);
    const Vector2d center_m(x_m, rng.uniform(-3, 3));
    if (center_m.norm() > 0.7) {
      forest.trunks.push_back({center_m, rng.uniform(0.1, 0.3)});
    }
  }
  Forest with_mesh = forest;
  with_mesh.meshes = {{{{90, 90, 0}, {91, 90, 0}, {90, 91, 0}}, {{0, 1, 2}}}};
  const GridGeometry geometry(0.1, box(-3, -3, 0, 3, 3, 1));

  const CoverageTruth columns = truth_of(forest, geometry, short_sighted_camera());
  const CoverageTruth rays = truth_of(with_mesh, geometry, short_sighted_camera());

  std::size_t only_by_rays = 0;
  for_each_voxel(geometry.voxels(), [&](const VoxelIndex& voxel) {
    only_by_rays += rays.contains(voxel) && !columns.contains(voxel) ? 1U : 0U;
  });
  EXPECT_LE(only_by_rays, columns.voxel_count() / 1000);  // the prisms are a little slimmer
  EXPECT_GE(rays.voxel_count(), columns.voxel_count() * 98 / 100);
}

TEST(CoverageTruth, LooksOverStumpsAndLeavesOutWhatATerrainBuries) {
  Forest forest;
  forest.trunk_height_m = 0.6;
  for (int i = 0; i < 16; ++i) {  // a closed ring of stumps
    const double angle_rad = 2 * kPi * i / 16;
    forest.trunks.push_back({Vector2d(2 + std::cos(angle_rad), std::sin(angle_rad)), 0.25});
  }
  forest.meshes = {
      {{{-9, -9, 0.32F}, {9, -9, 0.32F}, {9, 9, 0.32F}, {-9, 9, 0.32F}}, {{0, 1, 2}, {0, 2, 3}}}};
  const GridGeometry geometry(0.1, box(-1, -2, 0, 4, 2, 2));

  const CoverageTruth truth = truth_of(forest, geometry, CameraConfig{});

  EXPECT_TRUE(truth.contains(geometry.index_of({2.05, 0.05, 0.95})));   // inside the ring, above
  EXPECT_TRUE(truth.contains(geometry.index_of({2.05, 0.05, 0.45})));   // inside the ring
  EXPECT_TRUE(truth.contains(geometry.index_of({3.05, 0.05, 0.65})));   // on a stump
  EXPECT_FALSE(truth.contains(geometry.index_of({3.05, 0.05, 0.55})));  // in the stump
  EXPECT_TRUE(truth.contains(geometry.index_of({-0.55, 0.05, 0.45})));
  EXPECT_FALSE(truth.contains(geometry.index_of({-0.55, 0.05, 0.35})));  // the terrain enters it
  EXPECT_FALSE(truth.contains(geometry.index_of({-0.55, 0.05, 0.15})));  // below the terrain
}

TEST(TriangleMeetsBox, AgreesWithSampledPoints) {
  int met = 0;
  for (std::uint64_t seed = 1; seed <= 400; ++seed) {
    Rng rng(seed);
    std::array<Vector3d, 3> corners;
    for (Vector3d& corner : corners) {
      for (int axis = 0; axis < 3; ++axis) {
        corner[axis] = rng.uniform(-1.5, 1.5);
      }
    }
    const Box3d unit = box(-0.5, -0.5, -0.5, 0.5, 0.5, 0.5);
    double nearest_m = 9.0;
    for (int i = 0; i <= 60; ++i) {
      for (int j = 0; i + j <= 60; ++j) {
        const Vector3d point =
            corners[0] + (i * (corners[1] - corners[0]) + j * (corners[2] - corners[0])) / 60.0;
        nearest_m = std::min(nearest_m, unit.exteriorDistance(point));
      }
    }

    const bool meets = triangle_meets_box(corners, unit);

    met += meets ? 1 : 0;
    EXPECT_TRUE(meets || nearest_m > 0.0) << "seed " << seed;
    EXPECT_TRUE(!meets || nearest_m < 0.06) << "seed " << seed;
  }
  EXPECT_GT(met, 50);
  EXPECT_LT(met, 350);
}

}  // namespace
}  // namespace understory
