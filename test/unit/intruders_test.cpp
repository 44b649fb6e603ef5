// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/map/intruders.hpp"

#include <gtest/gtest.h>

#include "support/synthetic_scene.hpp"
#include "understory/map/mapper.hpp"
#include "understory/sim/teammates_in_view.hpp"

namespace understory {
namespace {

constexpr double kRadius_m = 0.2;

// Someone who hovers in a forest clearing and looks east.
class Watch {
 public:
  Watch() : camera_(CameraConfig{}), mapper_(MapConfig{}, box()) {
    scene_.trunks = {{{3.6, 1.2}, 0.2}, {{2.5, -1.4}, 0.15}};
  }

  // What one image shows of what moves.
  std::vector<Vector3d> see(const std::vector<Vector3d>& others_m) {
    const DepthImage image =
        add_teammates(test::render(scene_, camera_, pose()), camera_, pose(), others_m, kRadius_m);
    EXPECT_TRUE(mapper_.integrate(camera_, image.view(), pose(), time_).has_value());
    time_ += std::chrono::milliseconds(67);
    return mapper_.publish()->intruders_m;
  }
  void see_nobody(int times) {
    for (int i = 0; i < times; ++i) {
      EXPECT_TRUE(see({}).empty()) << "image " << i;
    }
  }

 private:
  static Box3d box() { return {Vector3d(-1.0, -4.0, 0.0), Vector3d(6.0, 4.0, 2.0)}; }
  static Pose pose() {
    return level_pose({0.05, 0.05, 1.05}, 0.0) * body_from_optical(CameraConfig{});
  }

  test::SyntheticScene scene_;
  CameraModel camera_;
  Mapper mapper_;
  Time time_{};
};

TEST(Intruders, WhoFliesThroughWhatWasSeenToBeFreeIsNoticedAtOnce) {
  Watch watch;
  watch.see_nobody(6);

  const std::vector<Vector3d> seen_m = watch.see({{3.0, 0.3, 1.1}});

  ASSERT_EQ(seen_m.size(), 1U);
  // The middle of its near side.
  EXPECT_NEAR(seen_m[0].x(), 3.0 - 0.7 * kRadius_m, 0.1);
  EXPECT_NEAR(seen_m[0].y(), 0.3, 0.1);
  EXPECT_NEAR(seen_m[0].z(), 1.1, 0.1);
}

TEST(Intruders, IsFollowedAsLongAsItMoves) {
  Watch watch;
  watch.see_nobody(6);

  for (int i = 0; i < 15; ++i) {
    const double y_m = -1.0 + 0.15 * i;
    const std::vector<Vector3d> seen_m = watch.see({{3.0, y_m, 1.1}});
    ASSERT_EQ(seen_m.size(), 1U) << i;
    EXPECT_NEAR(seen_m[0].y(), y_m, 0.15) << i;
  }
}

TEST(Intruders, TwoAreTwo) {
  Watch watch;
  watch.see_nobody(6);

  EXPECT_EQ(watch.see({{2.0, -0.6, 1.1}, {3.0, 0.6, 0.8}}).size(), 2U);
}

TEST(Intruders, WhoStandsBecomesPartOfTheMap) {
  Watch watch;
  watch.see_nobody(6);

  std::size_t images = 0;
  while (images < 20 && !watch.see({{3.0, 0.3, 1.1}}).empty()) {
    ++images;
  }

  EXPECT_GE(images, 2U);
  EXPECT_LE(images, 8U);
  EXPECT_TRUE(watch.see({{3.0, 0.3, 1.1}}).empty());
}

TEST(Intruders, TrunksAndTheGroundAreNoneInAnyImage) {
  Watch watch;

  watch.see_nobody(30);
}

TEST(Intruders, WhereNothingWasKnownNothingIsASurprise) {
  Watch watch;

  EXPECT_TRUE(watch.see({{3.0, 0.3, 1.1}}).empty());
}

ScanWindow hits_at(const MapSnapshot& map, const std::vector<VoxelIndex>& voxels) {
  ScanWindow window;
  window.reset(map.geometry, map.geometry.box_m());
  for (const VoxelIndex& voxel : voxels) {
    window.mark_hit(voxel);
  }
  return window;
}

TEST(Intruders, TwoVoxelsAreNoise) {
  Mapper mapper(MapConfig{}, Box3d(Vector3d(0.0, 0.0, 0.0), Vector3d(2.0, 2.0, 2.0)));
  // Never seen, but vouched for: as sure as it can be.
  mapper.mark_free(Box3d(Vector3d(0.0, 0.0, 0.0), Vector3d(2.0, 2.0, 2.0)), Time{});
  const MapSnapshotPtr map = mapper.publish();

  EXPECT_TRUE(intruders_in(hits_at(*map, {{10, 10, 10}, {11, 10, 10}}), *map).empty());
  EXPECT_EQ(intruders_in(hits_at(*map, {{10, 10, 10}, {11, 10, 10}, {10, 11, 10}}), *map).size(),
            1U);
}

}  // namespace
}  // namespace understory
