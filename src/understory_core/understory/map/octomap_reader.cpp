// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <locale>
#include <sstream>

#include "understory/map/octomap_format.hpp"
#include "understory/map/octomap_io.hpp"

namespace understory {
namespace {

using octomap_format::Encoding;

// OctoMap prints resolutions with six digits.
constexpr double kResolutionTolerance = 1e-5;
constexpr std::size_t kMaxHeaderBytes = 65536;
constexpr std::size_t kMaxBytesPerVoxel = 6;  // five per leaf, an eighth of that per level above

struct Header {
  std::size_t node_count = 0;
  double resolution_m = 0.0;
  std::size_t data_begin = 0;
};

std::string read_all(const std::string& path, std::size_t most_bytes) {
  std::error_code error;
  const std::filesystem::file_status status = std::filesystem::status(path, error);
  if (!std::filesystem::exists(status)) {
    throw MapFileError(path + ": no such file");
  }
  if (!std::filesystem::is_regular_file(status)) {
    throw MapFileError(path + ": not a file");
  }
  const std::uintmax_t size = std::filesystem::file_size(path, error);
  if (!error && size == 0) {
    throw MapFileError(path + ": is empty");
  }
  if (!error && size > most_bytes) {
    throw MapFileError(path + ": is larger than any map of this box");
  }
  std::ifstream file(path, std::ios::binary);
  std::string bytes(error ? 0 : static_cast<std::size_t>(size), '\0');
  file.read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  if (error || !file) {
    throw MapFileError(path + ": cannot be read");
  }
  return bytes;
}

template <class Number>
Number number_in(const std::string& text, const std::string& key, const std::string& path) {
  std::istringstream in(text);
  in.imbue(std::locale::classic());
  Number number{};
  std::string rest;
  if (text.find('-') != std::string::npos || !(in >> number) || (in >> rest)) {
    throw MapFileError(path + ": header has no valid '" + key + "'");
  }
  return number;
}

Header parse_header(const std::string& bytes, Encoding encoding, const std::string& path) {
  std::istringstream in(bytes.substr(0, kMaxHeaderBytes));
  std::string line;
  std::getline(in, line);
  const char* expected = encoding == Encoding::kLogOdds
                             ? octomap_format::kLogOddsFirstLine
                             : octomap_format::kMaximumLikelihoodFirstLine;
  if (line != expected) {
    throw MapFileError(path +
                       ": is not the kind of map that its name says: its first line is not '" +
                       expected + "'");
  }
  std::string id;
  std::string size;
  std::string resolution;
  while (std::getline(in, line)) {
    if (line == "data" && in.good()) {
      if (id != octomap_format::kTreeType) {
        throw MapFileError(path + ": holds a tree of type '" + id.substr(0, 32) + "', not '" +
                           octomap_format::kTreeType + "'");
      }
      return {number_in<std::size_t>(size, "size", path),
              number_in<double>(resolution, "res", path),
              static_cast<std::size_t>(in.tellg())};
    }
    const std::size_t space = line.find(' ');
    const std::string key = line.substr(0, space);
    const std::string value = space == std::string::npos ? "" : line.substr(space + 1);
    if (key == "id") {
      id = value;
    } else if (key == "size") {
      size = value;
    } else if (key == "res") {
      resolution = value;
    } else if (key.empty() || key.front() != '#') {
      throw MapFileError(path + ": header has an unknown key '" + key.substr(0, 32) + "'");
    }
  }
  throw MapFileError(path + ": header ends without 'data'");
}

// Decodes into tiles; depth and size are bounded whatever the bytes say.
class TreeDecoder {
 public:
  TreeDecoder(const std::string& path,
              const std::string& bytes,
              std::size_t begin,
              MapSnapshot& map)
      : path_(path),
        bytes_(bytes),
        position_(begin),
        geometry_(map.geometry),
        sensor_model_(map.sensor_model),
        tiles_(map.tiles.size()) {}

  void decode(Encoding encoding, std::size_t node_count) {
    if (node_count > 0) {
      if (encoding == Encoding::kLogOdds) {
        read_log_odds_node(octomap_format::root_corner(), octomap_format::kTreeLevels);
      } else {
        ++nodes_read_;
        read_likelihood_node(octomap_format::root_corner(), octomap_format::kTreeLevels);
      }
    }
    if (position_ != bytes_.size()) {
      throw MapFileError(path_ + ": has bytes after the end of its tree");
    }
    if (nodes_read_ != node_count) {
      throw MapFileError(path_ + ": holds " + std::to_string(nodes_read_) +
                         " nodes, its header says " + std::to_string(node_count));
    }
  }

  [[nodiscard]] std::vector<TilePtr> tiles() const { return {tiles_.begin(), tiles_.end()}; }

 private:
  void read_log_odds_node(const VoxelIndex& corner, int level) {
    ++nodes_read_;
    float log_odds = 0.0F;
    std::memcpy(&log_odds, take(sizeof(log_odds)), sizeof(log_odds));
    const auto child_bits = static_cast<unsigned>(static_cast<std::uint8_t>(*take(1)));
    if (!std::isfinite(log_odds)) {
      throw MapFileError(path_ + ": has a log-odds that is not a number");
    }
    if (child_bits == 0) {
      fill(corner, level, quantised(static_cast<double>(log_odds)));
      return;
    }
    check_may_have_children(level);
    for (unsigned i = 0; i < 8; ++i) {
      if (((child_bits >> i) & 1U) != 0) {
        const int child_edge = 1 << (level - 1);
        read_log_odds_node(octomap_format::child_corner(corner, child_edge, i), level - 1);
      }
    }
  }

  void read_likelihood_node(const VoxelIndex& corner, int level) {
    check_may_have_children(level);
    const char* field = take(2);
    const unsigned codes = static_cast<unsigned>(static_cast<std::uint8_t>(field[0])) |
                           (static_cast<unsigned>(static_cast<std::uint8_t>(field[1])) << 8U);
    const auto code_of = [codes](unsigned i) { return (codes >> (2U * i)) & 3U; };
    const int child_edge = 1 << (level - 1);
    for (unsigned i = 0; i < 8; ++i) {
      nodes_read_ += code_of(i) != 0 ? 1U : 0U;
      if (code_of(i) == octomap_format::kInnerNode) {
        read_likelihood_node(octomap_format::child_corner(corner, child_edge, i), level - 1);
      } else if (code_of(i) != 0) {
        const int log_odds =
            code_of(i) == octomap_format::kFreeLeaf ? sensor_model_.min : sensor_model_.max;
        fill(octomap_format::child_corner(corner, child_edge, i), level - 1, log_odds);
      }
    }
  }

  const char* take(std::size_t count) {
    if (bytes_.size() - position_ < count) {
      throw MapFileError(path_ + ": is truncated");
    }
    const char* taken = bytes_.data() + position_;
    position_ += count;
    return taken;
  }

  void check_may_have_children(int level) const {
    if (level == 0) {
      throw MapFileError(path_ + ": has a tree deeper than OctoMap's 16 levels");
    }
  }

  // Never below 0 unless it was: nothing becomes free by rounding.
  [[nodiscard]] int quantised(double log_odds) const {
    const double units = std::round(log_odds / SensorModel::kLogOddsUnit);
    return static_cast<int>(std::clamp(
        units, static_cast<double>(sensor_model_.min), static_cast<double>(sensor_model_.max)));
  }

  void fill(const VoxelIndex& corner, int level, int log_odds) {
    const VoxelIndex end = corner.array() + (1 << level);
    const VoxelBox& box = geometry_.voxels();
    if ((corner.array() < box.min.array()).any() || (end.array() > box.end.array()).any()) {
      throw MapFileError(path_ + ": has known voxels outside the map's box");
    }
    for (int z = corner.z(); z < end.z(); ++z) {
      for (int y = corner.y(); y < end.y(); ++y) {
        for (int x = corner.x(); x < end.x(); ++x) {
          const VoxelIndex voxel(x, y, z);
          std::shared_ptr<Tile>& tile = tiles_[geometry_.slot_of(voxel)];
          if (!tile) {
            tile = std::make_shared<Tile>();
          }
          tile->set(offset_in_tile(voxel), static_cast<std::int8_t>(log_odds));
        }
      }
    }
  }

  const std::string& path_;
  const std::string& bytes_;
  std::size_t position_;
  const GridGeometry& geometry_;
  const SensorModel& sensor_model_;
  std::vector<std::shared_ptr<Tile>> tiles_;
  std::size_t nodes_read_ = 0;
};

}  // namespace

MapSnapshot load_octomap(const std::string& path, const MapConfig& config, const Box3d& box_m) {
  const std::optional<Encoding> encoding = octomap_format::encoding_of(path);
  if (!encoding) {
    throw MapFileError(path + ": a map's name must end in .ot or .bt");
  }
  MapSnapshot map{
      GridGeometry(config.resolution_m, box_m), SensorModel(config.sensor), 0, Time{}, {}, {}};
  map.tiles.resize(map.geometry.slot_count());
  const std::string bytes = read_all(
      path, kMaxHeaderBytes + kMaxBytesPerVoxel * kVoxelsPerTile * map.geometry.slot_count());
  const Header header = parse_header(bytes, *encoding, path);
  if (!(std::abs(header.resolution_m - config.resolution_m) <=
        kResolutionTolerance * config.resolution_m)) {
    std::ostringstream message;
    message << path << ": has voxels of " << header.resolution_m << " m, the configuration says "
            << config.resolution_m << " m";
    throw MapFileError(message.str());
  }
  TreeDecoder decoder(path, bytes, header.data_begin, map);
  decoder.decode(*encoding, header.node_count);
  map.tiles = decoder.tiles();
  for (TileSlot slot = 0; slot < map.tiles.size(); ++slot) {
    if (map.tiles[slot]) {
      map.changed_tiles.push_back(slot);
    }
  }
  return map;
}

}  // namespace understory
