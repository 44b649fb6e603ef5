// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// What must hold for any box, camera, pose and image: random ones, each seed printed on failure.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include <gtest/gtest.h>
#include <octomap/octomap.h>

#include "support/map_checks.hpp"
#include "support/synthetic_scene.hpp"
#include "understory/base/rng.hpp"
#include "understory/map/mapper.hpp"

namespace understory {
namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

Box3d random_box(Rng& rng) {
  const Vector3d min(rng.uniform(-9.0, 4.0), rng.uniform(-9.0, 4.0), rng.uniform(-1.0, 0.2));
  const Vector3d size(rng.uniform(1.0, 6.0), rng.uniform(1.0, 6.0), rng.uniform(0.5, 3.0));
  return {min, min + size};
}

// Inside the box or up to 2 m beside it, looking anywhere.
Pose random_pose(const Box3d& box_m, Rng& rng) {
  Pose pose = Pose::Identity();
  for (int axis = 0; axis < 3; ++axis) {
    pose.translation()[axis] = rng.uniform(box_m.min()[axis] - 2.0, box_m.max()[axis] + 2.0);
  }
  const Eigen::Quaterniond rotation(rng.normal(), rng.normal(), rng.normal(), rng.normal());
  pose.linear() = rotation.normalized().toRotationMatrix();
  return pose;
}

CameraModel random_camera(Rng& rng) {
  CameraConfig config;
  config.width_px = 90 + static_cast<int>(rng.below(90));
  config.height_px = 90 + static_cast<int>(rng.below(60));
  config.horizontal_fov_rad = rng.uniform(0.6, 1.4);
  config.vertical_fov_rad = rng.uniform(0.6, 1.2);
  config.max_range_m = rng.uniform(1.0, 4.5);
  return CameraModel(config);
}

// Trunks wherever the camera looks, with faulty pixels.
DepthImage random_image(const CameraModel& camera, const Pose& pose, Rng& rng) {
  test::SyntheticScene scene;
  scene.ground_z_m = pose.translation().z() - rng.uniform(0.2, 3.0);
  for (int i = 0; i < 12; ++i) {
    const Vector2d center_m =
        pose.translation().head<2>() + Vector2d(rng.uniform(-4.0, 4.0), rng.uniform(-4.0, 4.0));
    if ((center_m - pose.translation().head<2>()).norm() > 0.5) {
      scene.trunks.push_back({center_m, rng.uniform(0.05, 0.3)});
    }
  }
  DepthImage image = test::render(scene, camera, pose);
  const std::array<float, 4> faults{kNan, 0.0F, -1.0F, 1e30F};
  for (int i = 0; i < 20; ++i) {
    image.z_m[rng.below(image.z_m.size())] = faults.at(rng.below(faults.size()));
  }
  return image;
}

// What one image must do to a voxel, by the rules and in plain arithmetic. Where rounding may
// decide, both outcomes are allowed.
struct Verdict {
  bool may_be_hit = false;
  bool must_be_hit = false;
  bool may_be_missed = false;
  bool must_be_missed = false;
};

class SlowReference {
 public:
  SlowReference(const GridGeometry& geometry,
                const CameraModel& camera,
                const DepthImage& image,
                const Pose& world_from_optical)
      : geometry_(geometry),
        camera_(camera),
        image_(image),
        optical_from_world_(world_from_optical.inverse()),
        verdicts_(static_cast<std::size_t>(geometry.voxels().size().prod())) {
    for (int v = 0; v < image.height_px; ++v) {
      for (int u = 0; u < image.width_px; ++u) {
        note_return(u, v, world_from_optical);
      }
    }
    test::for_each_voxel(geometry.voxels(), [&](const VoxelIndex& voxel) {
      Verdict& verdict = verdict_of(voxel);
      verdict.may_be_missed = seen_past(voxel, -kSlack);
      verdict.must_be_missed = seen_past(voxel, kSlack) && !verdict.may_be_hit;
    });
    const VoxelIndex own = geometry.index_of(world_from_optical.translation());
    if (geometry.contains(own)) {
      verdict_of(own).may_be_missed = true;
    }
  }

  [[nodiscard]] Verdict& verdict_of(const VoxelIndex& voxel) {
    const Vector3i size = geometry_.voxels().size();
    const Vector3i local = voxel - geometry_.voxels().min;
    const int slot = (local.z() * size.y() + local.y()) * size.x() + local.x();
    return verdicts_[static_cast<std::size_t>(slot)];
  }

 private:
  static constexpr double kSlack = 1e-3;  // voxels and pixels

  void note_return(int u, int v, const Pose& world_from_optical) {
    const Vector3d ray((u - camera_.cx) / camera_.fx, (v - camera_.cy) / camera_.fy, 1.0);
    const auto z = static_cast<double>(image_.view().at(u, v));
    if (!(z > 0.0) || !std::isfinite(z) || (ray * z).norm() > camera_.max_range_m + 1e-4) {
      return;
    }
    const Vector3d point = world_from_optical * (ray * z) / geometry_.resolution_m();
    const VoxelIndex low = (point.array() - kSlack).floor().cast<int>();
    const VoxelIndex high = (point.array() + kSlack).floor().cast<int>();
    const bool sure = low == high && (ray * z).norm() < camera_.max_range_m - 1e-4;
    const VoxelIndex end = high.array() + 1;
    test::for_each_voxel(VoxelBox{low, end}, [&](const VoxelIndex& voxel) {
      if (geometry_.contains(voxel)) {
        verdict_of(voxel).may_be_hit = true;
        verdict_of(voxel).must_be_hit = verdict_of(voxel).must_be_hit || sure;
      }
    });
  }

  // By `slack` more than the rule asks for.
  [[nodiscard]] bool seen_past(const VoxelIndex& voxel, double slack) const {
    constexpr double kMarginVox = 0.1;
    const Vector3d p = optical_from_world_ * geometry_.center_of(voxel);
    if (p.z() < (0.01 + slack) * geometry_.resolution_m() ||
        p.norm() > camera_.max_range_m - slack * geometry_.resolution_m()) {
      return false;
    }
    const double u = camera_.fx * p.x() / p.z() + camera_.cx;
    const double v = camera_.fy * p.y() / p.z() + camera_.cy;
    if (u < slack || v < slack || u > image_.width_px - 1 - slack ||
        v > image_.height_px - 1 - slack) {
      return false;
    }
    // Near a pixel's centre either of two blocks may be asked: all of both, or any of both.
    const auto block_saw_past = [&](double block_u, double block_v) {
      const int u0 = std::clamp(static_cast<int>(std::floor(block_u)), 0, image_.width_px - 2);
      const int v0 = std::clamp(static_cast<int>(std::floor(block_v)), 0, image_.height_px - 2);
      for (int i = 0; i < 4; ++i) {
        const auto depth = static_cast<double>(image_.view().at(u0 + i % 2, v0 + i / 2));
        if (!(p.z() < depth - (kMarginVox + slack) * geometry_.resolution_m())) {
          return false;
        }
      }
      return true;
    };
    const double d = 2.0 * std::abs(slack);
    const std::array<bool, 4> blocks{block_saw_past(u - d, v - d),
                                     block_saw_past(u + d, v - d),
                                     block_saw_past(u - d, v + d),
                                     block_saw_past(u + d, v + d)};
    return slack > 0.0 ? std::all_of(blocks.begin(), blocks.end(), [](bool b) { return b; })
                       : std::any_of(blocks.begin(), blocks.end(), [](bool b) { return b; });
  }

  const GridGeometry& geometry_;
  const CameraModel& camera_;
  const DepthImage& image_;
  Pose optical_from_world_;
  std::vector<Verdict> verdicts_;
};

TEST(ProjectiveIntegrationProperty, MatchesASlowReferenceForAnyBoxCameraPoseAndImage) {
  std::size_t hits = 0;
  std::size_t misses = 0;
  for (std::uint64_t seed = 1; seed <= 1000; ++seed) {
    SCOPED_TRACE(seed);
    Rng rng(seed);
    const Box3d box_m = random_box(rng);
    const CameraModel camera = random_camera(rng);
    const Pose pose = random_pose(box_m, rng);
    const DepthImage image = random_image(camera, pose, rng);
    Mapper mapper(MapConfig{}, box_m);

    (void)mapper.integrate(camera, image.view(), pose, Time{});

    const MapSnapshotPtr map = mapper.publish();
    SlowReference reference(map->geometry, camera, image, pose);
    const SensorModel& model = map->sensor_model;
    test::for_each_voxel(map->geometry.voxels(), [&](const VoxelIndex& voxel) {
      const Verdict verdict = reference.verdict_of(voxel);
      const int log_odds = test::log_odds_at(*map, voxel);
      ASSERT_TRUE(!verdict.must_be_hit || log_odds == model.hit) << voxel.transpose();
      ASSERT_TRUE(!verdict.must_be_missed || log_odds == model.miss) << voxel.transpose();
      ASSERT_TRUE(log_odds != model.hit || verdict.may_be_hit) << voxel.transpose();
      ASSERT_TRUE(log_odds != model.miss || verdict.may_be_missed) << voxel.transpose();
      hits += log_odds == model.hit ? 1U : 0U;
      misses += log_odds == model.miss ? 1U : 0U;
    });
  }
  EXPECT_GT(hits, 5000U);
  EXPECT_GT(misses, 200000U);
}

TEST(MapperProperty, SnapshotsStayTrueOverAnySequenceOfUpdates) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    SCOPED_TRACE(seed);
    Rng rng(seed);
    const Box3d box_m = random_box(rng);
    const CameraModel camera = random_camera(rng);
    Mapper mapper(MapConfig{}, box_m);
    MapSnapshotPtr previous = mapper.publish();
    for (int frame = 0; frame < 25; ++frame) {
      const MapSnapshot copy_of_pointers = *previous;
      std::vector<Tile> copy_of_content;
      for (const TilePtr& tile : previous->tiles) {
        copy_of_content.push_back(tile ? *tile : Tile());
      }
      const Pose pose = random_pose(box_m, rng);
      (void)mapper.integrate(camera, random_image(camera, pose, rng).view(), pose, Time{});

      const MapSnapshotPtr next = mapper.publish();

      ASSERT_EQ(test::inconsistent_voxels(*next), 0U);
      ASSERT_EQ(next->changed_tiles, tiles_changed_between(previous.get(), *next));
      for (TileSlot slot = 0; slot < next->tiles.size(); ++slot) {
        const Tile before = previous->tiles[slot] ? *previous->tiles[slot] : Tile();
        const Tile after = next->tiles[slot] ? *next->tiles[slot] : Tile();
        const bool listed =
            std::binary_search(next->changed_tiles.begin(), next->changed_tiles.end(), slot);
        ASSERT_EQ(before.log_odds, copy_of_content[slot].log_odds);
        ASSERT_EQ(listed, before.log_odds != after.log_odds);
      }
      previous = next;
    }
  }
}

TEST(MapperProperty, EqualCloudsGiveEqualMaps) {
  const auto map_of = [](std::uint64_t seed) {
    Rng rng(seed);
    const Box3d box_m = random_box(rng);
    const CameraModel camera = random_camera(rng);
    Mapper mapper(MapConfig{}, box_m);
    for (int frame = 0; frame < 5; ++frame) {
      const Pose pose = random_pose(box_m, rng);
      (void)mapper.integrate(camera, random_image(camera, pose, rng).view(), pose, Time{});
    }
    return mapper.publish();
  };
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    EXPECT_TRUE(test::same_content(*map_of(seed), *map_of(seed))) << seed;
  }
}

TEST(RayIntegrationProperty, VisitsTheVoxelsThatOctomapVisitsForAnyRay) {
  std::size_t different = 0;
  std::size_t known = 0;
  for (std::uint64_t seed = 1; seed <= 1000; ++seed) {
    SCOPED_TRACE(seed);
    Rng rng(seed);
    const Box3d box_m = random_box(rng);
    Mapper mapper(MapConfig{}, box_m);
    octomap::OcTree tree(MapConfig{}.resolution_m);
    octomap::Pointcloud cloud;
    std::vector<float> points;
    const Vector3d eye_m = random_pose(box_m, rng).translation().cast<float>().cast<double>();
    for (int i = 0; i < 30; ++i) {
      const Eigen::Vector3f local(static_cast<float>(3.0 * rng.normal()),
                                  static_cast<float>(3.0 * rng.normal()),
                                  static_cast<float>(rng.normal()));
      const Eigen::Vector3f p = (eye_m + local.cast<double>()).cast<float>();
      points.insert(points.end(), local.data(), local.data() + 3);
      cloud.push_back(p.x(), p.y(), p.z());
    }
    const Eigen::Vector3f eye = eye_m.cast<float>();

    (void)mapper.integrate_rays({points.data(), 3, 30}, level_pose(eye_m, 0.0), 4.0, Time{});
    tree.insertPointCloud(cloud, octomap::point3d(eye.x(), eye.y(), eye.z()), 4.0);

    const MapSnapshotPtr map = mapper.publish();
    test::for_each_voxel(map->geometry.voxels(), [&](const VoxelIndex& voxel) {
      const Vector3d c = map->geometry.center_of(voxel);
      const octomap::OcTreeNode* node = tree.search(c.x(), c.y(), c.z());
      const VoxelState ours = map->state(voxel);
      const bool same = node == nullptr ? ours == VoxelState::kUnknown
                                        : (ours == VoxelState::kFree) == (node->getLogOdds() < 0) &&
                                              ours != VoxelState::kUnknown;
      different += same ? 0U : 1U;
      known += node != nullptr ? 1U : 0U;
    });
  }
  // Single and double precision may disagree on the side of an edge that a ray grazes.
  EXPECT_GT(known, 50000U);
  EXPECT_LT(different, known / 5000);
}

}  // namespace
}  // namespace understory
