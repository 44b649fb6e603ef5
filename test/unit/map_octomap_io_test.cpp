// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <octomap/octomap.h>

#include "support/map_checks.hpp"
#include "understory/map/octomap_io.hpp"

namespace understory {
namespace {

// Crosses zero, no multiple of tiles.
Box3d box() {
  return {Vector3d(-2.1, -0.7, -0.3), Vector3d(2.6, 2.9, 2.0)};
}

class OctomapIo : public testing::Test {
 protected:
  void SetUp() override {
    const testing::TestInfo* test = testing::UnitTest::GetInstance()->current_test_info();
    folder_ = std::filesystem::path(testing::TempDir()) /
              (std::string("understory_") + test->test_suite_name() + "_" + test->name());
    std::filesystem::remove_all(folder_);
    std::filesystem::create_directories(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  [[nodiscard]] std::string path(const std::string& name) const { return folder_ / name; }

  [[nodiscard]] std::string write(const std::string& name, const std::string& bytes) const {
    std::ofstream(path(name), std::ios::binary) << bytes;
    return path(name);
  }

 private:
  std::filesystem::path folder_;
};

std::string bytes_of(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

MapSnapshot load(const std::string& path) {
  return load_octomap(path, MapConfig{}, box());
}

// The message of the error, which must be one line that starts with the file's name.
std::string error_of(const std::string& path) {
  try {
    (void)load(path);
  } catch (const MapFileError& error) {
    const std::string message = error.what();
    EXPECT_EQ(message.rfind(path + ": ", 0), 0U) << message;
    EXPECT_EQ(message.find('\n'), std::string::npos) << message;
    return message.substr(path.size() + 2);
  }
  return "no error";
}

std::string ot_header(const std::string& size, const std::string& resolution = "0.1") {
  return "# Octomap OcTree file\n# comment\nid OcTree\nsize " + size + "\nres " + resolution +
         "\ndata\n";
}

std::string node(float log_odds, int child_bits) {
  std::string bytes(sizeof(log_odds) + 1, static_cast<char>(child_bits));
  std::memcpy(bytes.data(), &log_odds, sizeof(log_odds));
  return bytes;
}

std::unique_ptr<octomap::OcTree> octomap_read_ot(const std::string& path) {
  std::unique_ptr<octomap::AbstractOcTree> tree(octomap::AbstractOcTree::read(path));
  return std::unique_ptr<octomap::OcTree>(dynamic_cast<octomap::OcTree*>(tree.release()));
}

template <class Expect>
void expect_every_voxel(const MapSnapshot& map, const octomap::OcTree& tree, Expect expect) {
  test::for_each_voxel(map.geometry.voxels(), [&](const VoxelIndex& voxel) {
    const Vector3d center_m = map.geometry.center_of(voxel);
    const octomap::OcTreeNode* leaf = tree.search(center_m.x(), center_m.y(), center_m.z());
    const int log_odds = test::log_odds_at(map, voxel);
    ASSERT_EQ(leaf != nullptr, log_odds != static_cast<int>(kUnknownLogOdds));
    if (leaf != nullptr) {
      expect(log_odds, *leaf);
    }
  });
}

TEST_F(OctomapIo, OtRoundTripKeepsEveryLogOdds) {
  for (const std::uint64_t seed : {1U, 2U, 3U}) {
    const MapSnapshot map = test::random_map(box(), 0.1, seed);

    save_octomap(map, path("map.ot"));
    const MapSnapshot loaded = load(path("map.ot"));

    EXPECT_TRUE(test::same_content(map, loaded)) << "seed " << seed;
    EXPECT_EQ(test::inconsistent_voxels(loaded), 0U);
    EXPECT_EQ(loaded.changed_tiles, tiles_changed_between(nullptr, loaded));
  }
}

TEST_F(OctomapIo, BtRoundTripKeepsFreeAndMakesTheRestOccupied) {
  const MapSnapshot map = test::random_map(box(), 0.1, 4);

  save_octomap(map, path("map.bt"));
  const MapSnapshot loaded = load(path("map.bt"));

  test::for_each_voxel(map.geometry.voxels(), [&](const VoxelIndex& voxel) {
    const int before = test::log_odds_at(map, voxel);
    const int clamp = before < 0 ? map.sensor_model.min : map.sensor_model.max;
    const int expected = before == static_cast<int>(kUnknownLogOdds) ? before : clamp;
    ASSERT_EQ(test::log_odds_at(loaded, voxel), expected);
  });
}

TEST_F(OctomapIo, OctomapReadsOurOt) {
  const MapSnapshot map = test::random_map(box(), 0.1, 5);

  save_octomap(map, path("map.ot"));
  const std::unique_ptr<octomap::OcTree> tree = octomap_read_ot(path("map.ot"));

  ASSERT_NE(tree, nullptr);
  expect_every_voxel(map, *tree, [](int log_odds, const octomap::OcTreeNode& leaf) {
    ASSERT_FLOAT_EQ(leaf.getLogOdds(), static_cast<float>(log_odds * SensorModel::kLogOddsUnit));
  });
}

TEST_F(OctomapIo, OctomapReadsOurBt) {
  const MapSnapshot map = test::random_map(box(), 0.1, 6);

  save_octomap(map, path("map.bt"));
  octomap::OcTree tree(0.1);

  ASSERT_TRUE(tree.readBinary(path("map.bt")));
  expect_every_voxel(map, tree, [](int log_odds, const octomap::OcTreeNode& leaf) {
    ASSERT_EQ(leaf.getLogOdds() < 0.0F, log_odds < 0);
  });
}

TEST_F(OctomapIo, OurOtIsAsPrunedAsOctomapWouldMakeIt) {
  save_octomap(test::random_map(box(), 0.1, 7), path("ours.ot"));
  const std::unique_ptr<octomap::OcTree> tree = octomap_read_ot(path("ours.ot"));
  ASSERT_NE(tree, nullptr);

  tree->updateInnerOccupancy();
  tree->prune();
  ASSERT_TRUE(tree->write(path("theirs.ot")));

  EXPECT_EQ(bytes_of(path("ours.ot")), bytes_of(path("theirs.ot")));
}

TEST_F(OctomapIo, PrunedTreesOfOctomapAreExpanded) {
  octomap::OcTree tree(0.1);
  for (int x = 0; x < 8; ++x) {
    for (int y = 0; y < 8; ++y) {
      for (int z = 0; z < 8; ++z) {
        tree.setNodeValue(0.1 * x + 0.05, 0.1 * y + 0.05, 0.1 * z + 0.05, -1.0F);
      }
    }
  }
  tree.setNodeValue(-1.95, 2.75, 1.95, 2.0F);
  tree.updateInnerOccupancy();
  tree.prune();
  ASSERT_TRUE(tree.write(path("map.ot")));
  ASSERT_TRUE(tree.writeBinary(path("map.bt")));

  for (const char* name : {"map.ot", "map.bt"}) {
    const MapSnapshot map = load(path(name));

    std::size_t known = 0;
    test::for_each_voxel(map.geometry.voxels(),
                         [&](const VoxelIndex& voxel) { known += map.is_known(voxel) ? 1U : 0U; });
    EXPECT_EQ(known, 513U) << name;
    EXPECT_TRUE(map.is_free({7, 7, 7})) << name;
    EXPECT_FALSE(map.is_known({8, 7, 7})) << name;
    EXPECT_EQ(map.state({-20, 27, 19}), VoxelState::kOccupied) << name;
  }
}

TEST_F(OctomapIo, EqualMapsGiveEqualBytes) {
  save_octomap(test::random_map(box(), 0.1, 8), path("a.ot"));
  save_octomap(test::random_map(box(), 0.1, 8), path("b.ot"));

  EXPECT_EQ(bytes_of(path("a.ot")), bytes_of(path("b.ot")));
}

TEST_F(OctomapIo, SavingReplacesAnOlderFileAndLeavesNothingElse) {
  save_octomap(test::random_map(box(), 0.1, 9), path("map.ot"));
  const MapSnapshot newer = test::random_map(box(), 0.1, 10);

  save_octomap(newer, path("map.ot"));

  EXPECT_TRUE(test::same_content(load(path("map.ot")), newer));
  EXPECT_FALSE(std::filesystem::exists(path("map.ot.part")));
}

TEST_F(OctomapIo, WhollyUnknownMapIsSavedAndLoaded) {
  Mapper mapper(MapConfig{}, box());
  for (const char* name : {"map.ot", "map.bt"}) {
    save_octomap(*mapper.publish(), path(name));

    EXPECT_TRUE(load(path(name)).changed_tiles.empty());
  }
}

TEST_F(OctomapIo, ForeignLogOddsAreRoundedAndClamped) {
  octomap::OcTree tree(0.1);
  tree.setClampingThresMax(0.999);
  tree.setClampingThresMin(0.001);
  tree.setNodeValue(0.05, 0.05, 0.05, 6.0F);
  tree.setNodeValue(0.15, 0.05, 0.05, -6.0F);
  tree.setNodeValue(0.25, 0.05, 0.05, -0.001F);  // as good as undecided: not free
  ASSERT_TRUE(tree.write(path("map.ot")));

  const MapSnapshot map = load(path("map.ot"));

  EXPECT_EQ(test::log_odds_at(map, {0, 0, 0}), map.sensor_model.max);
  EXPECT_EQ(test::log_odds_at(map, {1, 0, 0}), map.sensor_model.min);
  EXPECT_EQ(map.state({2, 0, 0}), VoxelState::kUncertain);
}

TEST_F(OctomapIo, FileThatIsNotThereOrNoFileIsNamed) {
  EXPECT_EQ(error_of(path("missing.ot")), "no such file");
  std::filesystem::create_directory(path("folder.bt"));
  EXPECT_EQ(error_of(path("folder.bt")), "not a file");
  EXPECT_EQ(error_of(write("empty.ot", "")), "is empty");
  EXPECT_EQ(error_of(write("map.ply", "ply\n")), "a map's name must end in .ot or .bt");
}

TEST_F(OctomapIo, EveryTruncationIsAnError) {
  for (const char* name : {"map.ot", "map.bt"}) {
    const Box3d small(Vector3d::Zero(), Vector3d::Constant(0.7));
    save_octomap(test::random_map(small, 0.1, 11), path(name));
    const std::string whole = bytes_of(path(name));
    ASSERT_GT(whole.size(), 200U);

    // All of the header and the first nodes, then samples at every alignment within a node.
    for (std::size_t length = 0; length < whole.size(); length += length < 250 ? 1 : 13) {
      const std::string cut = write(std::string("cut_") + name, whole.substr(0, length));
      ASSERT_THROW((void)load(cut), MapFileError) << name << " cut to " << length;
    }
  }
}

TEST_F(OctomapIo, EveryFlippedBitIsReadOrRefusedButNeverHarmful) {
  for (const char* name : {"map.ot", "map.bt"}) {
    const Box3d small(Vector3d::Zero(), Vector3d::Constant(0.3));
    save_octomap(test::random_map(small, 0.1, 12), path(name));
    const std::string whole = bytes_of(path(name));
    std::size_t refused = 0;

    for (std::size_t bit = 0; bit < 8 * whole.size(); ++bit) {
      std::string flipped = whole;
      flipped[bit / 8] = static_cast<char>(flipped[bit / 8] ^ (1 << (bit % 8)));
      const std::string damaged = write(std::string("flipped_") + name, flipped);
      try {
        EXPECT_EQ(test::inconsistent_voxels(load(damaged)), 0U);
      } catch (const MapFileError&) {
        ++refused;
      }
    }

    EXPECT_GT(refused, whole.size()) << name;
  }
}

TEST_F(OctomapIo, GarbageIsRefused) {
  EXPECT_NE(error_of(write("a.ot", "garbage")), "no error");
  EXPECT_NE(error_of(write("b.bt", std::string(5000, '\xFF'))), "no error");
  EXPECT_NE(error_of(write("c.ot", "# Octomap OcTree file\n" + std::string(100000, '#'))),
            "no error");
}

TEST_F(OctomapIo, TreeOfEndlessDepthIsRefused) {
  std::string chain;
  for (int level = 0; level < 100000; ++level) {
    chain += node(0.0F, 1);
  }

  EXPECT_EQ(error_of(write("deep.ot", ot_header("100000") + chain)),
            "has a tree deeper than OctoMap's 16 levels");
}

TEST_F(OctomapIo, NameThatContradictsTheContentsIsRefused) {
  const MapSnapshot map = test::random_map(box(), 0.1, 13);
  save_octomap(map, path("map.ot"));
  save_octomap(map, path("map.bt"));

  EXPECT_NE(error_of(write("ot_inside.bt", bytes_of(path("map.ot")))).find("first line"),
            std::string::npos);
  EXPECT_NE(error_of(write("bt_inside.ot", bytes_of(path("map.bt")))).find("first line"),
            std::string::npos);
}

TEST_F(OctomapIo, HeaderFaultsAreNamed) {
  const std::string tree = node(0.0F, 0);

  EXPECT_EQ(error_of(write("a.ot", ot_header("many") + tree)), "header has no valid 'size'");
  EXPECT_EQ(error_of(write("b.ot", ot_header("-1") + tree)), "header has no valid 'size'");
  EXPECT_EQ(error_of(write("c.ot", ot_header("1", "nan") + tree)), "header has no valid 'res'");
  EXPECT_EQ(error_of(write("d.ot", ot_header("1", "0.2") + tree)),
            "has voxels of 0.2 m, the configuration says 0.1 m");
  EXPECT_EQ(
      error_of(write("e.ot", "# Octomap OcTree file\nid ColorOcTree\nsize 1\nres 0.1\ndata\n")),
      "holds a tree of type 'ColorOcTree', not 'OcTree'");
  EXPECT_EQ(error_of(write("f.ot", "# Octomap OcTree file\nid OcTree\nsize 1\nres 0.1\n")),
            "header ends without 'data'");
  EXPECT_EQ(error_of(write("g.ot", "# Octomap OcTree file\nsice 1\n")),
            "header has an unknown key 'sice'");
}

TEST_F(OctomapIo, LogOddsThatIsNoNumberIsRefused) {
  for (const float value :
       {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()}) {
    EXPECT_EQ(error_of(write("nan.ot", ot_header("1") + node(value, 0))),
              "has a log-odds that is not a number");
  }
}

TEST_F(OctomapIo, TreeBeyondTheBoxIsRefused) {
  save_octomap(test::random_map({Vector3d(-3.0, 0.0, 0.0), Vector3d(0.0, 1.0, 1.0)}, 0.1, 14),
               path("wide.ot"));
  save_octomap(test::random_map({Vector3d(-3.0, 0.0, 0.0), Vector3d(0.0, 1.0, 1.0)}, 0.1, 14),
               path("wide.bt"));

  EXPECT_EQ(error_of(path("wide.ot")), "has known voxels outside the map's box");
  EXPECT_EQ(error_of(path("wide.bt")), "has known voxels outside the map's box");
  EXPECT_EQ(error_of(write("all.ot", ot_header("1") + node(-1.0F, 0))),
            "has known voxels outside the map's box");
}

TEST_F(OctomapIo, WrongNodeCountAndTrailingBytesAreRefused) {
  save_octomap(test::random_map(box(), 0.1, 15), path("map.ot"));
  const std::string whole = bytes_of(path("map.ot"));
  std::string miscounted = whole;
  miscounted.insert(miscounted.find("size ") + 5, "1");

  EXPECT_NE(error_of(write("miscounted.ot", miscounted)).find("its header says"),
            std::string::npos);
  EXPECT_EQ(error_of(write("longer.ot", whole + "x")), "has bytes after the end of its tree");
}

TEST_F(OctomapIo, FileTooLargeForTheBoxIsRefusedUnread) {
  (void)write("sparse.ot", "# Octomap OcTree file\n");
  std::filesystem::resize_file(path("sparse.ot"), 1ULL << 40U);

  EXPECT_EQ(error_of(path("sparse.ot")), "is larger than any map of this box");
}

TEST_F(OctomapIo, SavingWhereItCannotIsAnErrorThatNamesTheFile) {
  const MapSnapshot map = test::random_map(box(), 0.1, 16);
  const std::string nowhere = path("no/such/folder/map.ot");

  EXPECT_THROW(save_octomap(map, path("map.txt")), MapFileError);
  try {
    save_octomap(map, nowhere);
    FAIL() << "saved into a folder that is not there";
  } catch (const MapFileError& error) {
    EXPECT_EQ(error.what(), nowhere + ": cannot be written: No such file or directory");
  }
}

TEST_F(OctomapIo, FullDiskIsAnErrorAndTheOlderFileStays) {
  if (!std::filesystem::exists("/dev/full")) {
    GTEST_SKIP() << "no /dev/full on this system";
  }
  const MapSnapshot map = test::random_map(box(), 0.1, 17);
  save_octomap(map, path("map.ot"));
  const std::string before = bytes_of(path("map.ot"));
  std::filesystem::create_symlink("/dev/full", path("map.ot.part"));

  EXPECT_THROW(save_octomap(map, path("map.ot")), MapFileError);

  EXPECT_EQ(bytes_of(path("map.ot")), before);
}

}  // namespace
}  // namespace understory
