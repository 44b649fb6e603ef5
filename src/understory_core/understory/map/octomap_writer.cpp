// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <locale>
#include <sstream>

#include "understory/map/octomap_format.hpp"
#include "understory/map/octomap_io.hpp"

namespace understory {
namespace octomap_format {

std::optional<Encoding> encoding_of(const std::string& path) {
  const std::string extension = std::filesystem::path(path).extension().string();
  if (extension == ".ot") {
    return Encoding::kLogOdds;
  }
  if (extension == ".bt") {
    return Encoding::kMaximumLikelihood;
  }
  return std::nullopt;
}

}  // namespace octomap_format

namespace {

using octomap_format::Encoding;

// A cube of the tree as its parent sees it.
struct Node {
  int log_odds = static_cast<int>(kUnknownLogOdds);  // of an inner node: the highest below it
  bool is_leaf = true;

  [[nodiscard]] bool is_known() const { return log_odds != static_cast<int>(kUnknownLogOdds); }
  [[nodiscard]] bool operator==(const Node& other) const {
    return log_odds == other.log_odds && is_leaf == other.is_leaf;
  }
};

// Encodes bottom-up with pruning, so that the whole tree never exists in memory as nodes.
class TreeEncoder {
 public:
  TreeEncoder(const MapSnapshot& map, Encoding encoding) : map_(map), encoding_(encoding) {
    (void)append(octomap_format::root_corner(), octomap_format::kTreeLevels);
  }

  [[nodiscard]] const std::string& bytes() const { return bytes_; }
  [[nodiscard]] std::size_t node_count() const { return node_count_; }

 private:
  // The cube of 2^level voxels from `corner`.
  Node append(const VoxelIndex& corner, int level) {
    if (level == 0) {
      return append_voxel(corner);
    }
    const int edge = 1 << level;
    const VoxelIndex end = corner.array() + edge;
    const VoxelBox common = VoxelBox{corner, end}.clipped_to(map_.geometry.voxels());
    if (common.empty() || (level <= kTileShift && map_.tile_at(common.min) == nullptr)) {
      return {};
    }
    const std::size_t start = bytes_.size();
    const std::size_t nodes_before = node_count_;
    bytes_.append(inner_bytes(), '\0');
    std::array<Node, 8> children;
    for (unsigned i = 0; i < 8; ++i) {
      children[i] = append(octomap_format::child_corner(corner, edge / 2, i), level - 1);
    }
    const bool all_equal = std::all_of(
        children.begin(), children.end(), [&](const Node& child) { return child == children[0]; });
    if (all_equal && children[0].is_leaf) {  // prune
      bytes_.resize(start);
      node_count_ = nodes_before;
      return append_leaf(children[0].log_odds);
    }
    return patch_inner(start, children);
  }

  Node append_voxel(const VoxelIndex& voxel) {
    const Tile* tile = map_.tile_at(voxel);
    const int log_odds = tile == nullptr ? static_cast<int>(kUnknownLogOdds)
                                         : tile->log_odds_at(offset_in_tile(voxel));
    if (log_odds == static_cast<int>(kUnknownLogOdds) || encoding_ == Encoding::kLogOdds) {
      return append_leaf(log_odds);
    }
    return append_leaf(log_odds < 0 ? map_.sensor_model.min : map_.sensor_model.max);
  }

  Node append_leaf(int log_odds) {
    const Node leaf{log_odds, true};
    if (leaf.is_known()) {
      ++node_count_;
      if (encoding_ == Encoding::kLogOdds) {
        bytes_.append(inner_bytes(), '\0');
        patch_log_odds(bytes_.size() - inner_bytes(), log_odds, 0);
      }
    }
    return leaf;
  }

  Node patch_inner(std::size_t start, const std::array<Node, 8>& children) {
    Node node{static_cast<int>(kUnknownLogOdds), false};
    unsigned child_bits = 0;
    unsigned child_codes = 0;
    for (unsigned i = 0; i < 8; ++i) {
      const Node& child = children[i];
      if (!child.is_known()) {
        continue;
      }
      node.log_odds = std::max(node.log_odds, child.log_odds);
      child_bits |= 1U << i;
      const unsigned leaf_code =
          child.log_odds < 0 ? octomap_format::kFreeLeaf : octomap_format::kOccupiedLeaf;
      child_codes |= (child.is_leaf ? leaf_code : octomap_format::kInnerNode) << (2U * i);
    }
    ++node_count_;
    if (encoding_ == Encoding::kLogOdds) {
      patch_log_odds(start, node.log_odds, child_bits);
    } else {
      bytes_[start] = static_cast<char>(child_codes & 0xFFU);
      bytes_[start + 1] = static_cast<char>(child_codes >> 8U);
    }
    return node;
  }

  void patch_log_odds(std::size_t position, int log_odds, unsigned child_bits) {
    const auto value = static_cast<float>(log_odds * SensorModel::kLogOddsUnit);
    std::memcpy(&bytes_[position], &value, sizeof(value));
    bytes_[position + sizeof(value)] = static_cast<char>(child_bits);
  }

  [[nodiscard]] std::size_t inner_bytes() const {
    return encoding_ == Encoding::kLogOdds ? sizeof(float) + 1 : 2;
  }

  const MapSnapshot& map_;
  Encoding encoding_;
  std::string bytes_;
  std::size_t node_count_ = 0;
};

// The shortest decimal that reads back as the same number.
std::string shortest(double value) {
  std::string text;
  for (int digits = 6; digits <= 17; ++digits) {
    std::ostringstream out;
    out.imbue(std::locale::classic());
    out.precision(digits);
    out << value;
    text = out.str();
    std::istringstream in(text);
    in.imbue(std::locale::classic());
    double back = 0.0;
    in >> back;
    if (back == value) {
      break;
    }
  }
  return text;
}

std::string header(const MapSnapshot& map, Encoding encoding, std::size_t node_count) {
  const char* first_line = encoding == Encoding::kLogOdds
                               ? octomap_format::kLogOddsFirstLine
                               : octomap_format::kMaximumLikelihoodFirstLine;
  return std::string(first_line) +
         "\n# (feel free to add / change comments, but leave the first line as it is!)\n#\nid " +
         octomap_format::kTreeType + "\nsize " + std::to_string(node_count) + "\nres " +
         shortest(map.geometry.resolution_m()) + "\ndata\n";
}

void require_representable(const MapSnapshot& map, const std::string& name) {
  const VoxelBox& voxels = map.geometry.voxels();
  if ((voxels.min.array() < -octomap_format::kKeyOrigin).any() ||
      (voxels.end.array() > octomap_format::kKeyOrigin).any()) {
    throw MapFileError(name +
                       ": the box reaches beyond the 32768 voxels from the origin that an "
                       "OctoMap can hold");
  }
}

}  // namespace

std::string octomap_tree(const MapSnapshot& map, bool is_binary) {
  require_representable(map, "octomap");
  return TreeEncoder(map, is_binary ? Encoding::kMaximumLikelihood : Encoding::kLogOdds).bytes();
}

void save_octomap(const MapSnapshot& map, const std::string& path) {
  const std::optional<Encoding> encoding = octomap_format::encoding_of(path);
  if (!encoding) {
    throw MapFileError(path + ": a map's name must end in .ot or .bt");
  }
  require_representable(map, path);
  const TreeEncoder tree(map, *encoding);

  const std::string unfinished = path + ".part";
  std::error_code error;
  errno = 0;
  std::ofstream file(unfinished, std::ios::binary | std::ios::trunc);
  file << header(map, *encoding, tree.node_count()) << tree.bytes();
  file.close();
  if (file) {
    std::filesystem::rename(unfinished, path, error);
  }
  if (!file) {
    error = std::error_code(errno, std::generic_category());
  }
  if (!file || error) {
    std::error_code ignored;
    std::filesystem::remove(unfinished, ignored);
    throw MapFileError(path + ": cannot be written: " + error.message());
  }
}

}  // namespace understory
