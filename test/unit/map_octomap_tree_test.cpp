// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include <fstream>
#include <sstream>
#include <string>

#include <gtest/gtest.h>
#include <octomap/octomap.h>

#include "support/map_checks.hpp"
#include "support/snapshot_builder.hpp"
#include "support/temporary_folder.hpp"
#include "understory/map/octomap_io.hpp"

namespace understory {
namespace {

const Box3d kBox_m(Vector3d(-2.1, -0.7, -0.3), Vector3d(2.6, 2.9, 2.0));

std::string bytes_of(const std::string& path) {
  std::ostringstream bytes;
  bytes << std::ifstream(path, std::ios::binary).rdbuf();
  return bytes.str();
}

// A voxel at the end of a hall along x.
MapSnapshotPtr map_up_to(double x_max_m) {
  test::SnapshotBuilder builder(
      0.1, Box3d(Vector3d(x_max_m - 0.45, 0.0, 0.0), Vector3d(x_max_m, 0.45, 0.45)));
  builder.fill(VoxelState::kFree);
  return builder.build();
}

TEST(OctomapTree, IsWhatASavedFileHoldsAfterItsHeader) {
  const TemporaryFolder folder;
  for (const bool is_binary : {false, true}) {
    const MapSnapshot map = test::random_map(kBox_m, 0.1, 3);
    const std::string path = folder.path_of(is_binary ? "map.bt" : "map.ot");
    save_octomap(map, path);
    const std::string file = bytes_of(path);
    const std::size_t end_of_header = file.find("\ndata\n") + 6;
    ASSERT_LT(end_of_header, file.size());

    EXPECT_TRUE(octomap_tree(map, is_binary) == file.substr(end_of_header)) << path;
  }
}

TEST(OctomapTree, OctomapReadsItAsItComesInAMessage) {
  const MapSnapshot map = test::random_map(kBox_m, 0.1, 4);
  octomap::OcTree full(0.1);
  std::istringstream full_data(octomap_tree(map, false));
  octomap::OcTree binary(0.1);
  std::istringstream binary_data(octomap_tree(map, true));

  full.readData(full_data);
  binary.readBinaryData(binary_data);

  test::for_each_voxel(map.geometry.voxels(), [&](const VoxelIndex& voxel) {
    const Vector3d center_m = map.geometry.center_of(voxel);
    const int log_odds = test::log_odds_at(map, voxel);
    for (const octomap::OcTree* tree : {&full, &binary}) {
      const octomap::OcTreeNode* leaf = tree->search(center_m.x(), center_m.y(), center_m.z());
      ASSERT_EQ(leaf != nullptr, log_odds != static_cast<int>(kUnknownLogOdds));
      ASSERT_TRUE(leaf == nullptr || (leaf->getLogOdds() < 0.0F) == (log_odds < 0));
    }
  });
}

TEST(OctomapTree, BoxBeyondWhatAnOctomapCanHoldIsRefused) {
  EXPECT_FALSE(octomap_tree(*map_up_to(3276.8), false).empty());
  EXPECT_FALSE(octomap_tree(*map_up_to(-3276.35), true).empty());

  EXPECT_THROW(static_cast<void>(octomap_tree(*map_up_to(3276.9), false)), MapFileError);
  EXPECT_THROW(static_cast<void>(octomap_tree(*map_up_to(-3276.45), true)), MapFileError);
}

}  // namespace
}  // namespace understory
