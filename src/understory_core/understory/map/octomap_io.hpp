// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// Maps to and from OctoMap's files (Hornung et al. 2013): `.ot` keeps every log-odds exactly, `.bt`
// only whether a voxel is free. Off the flight path; any thread. Everything wrong with a file (not
// there, not a map, damaged, another resolution, voxels outside the box, a full disk) throws
// MapFileError in one line that names it. Equal maps give equal bytes. The format is read here and
// not by the library, whose reader follows damaged data without bound.
#pragma once

#include <stdexcept>
#include <string>

#include "understory/map/map_snapshot.hpp"
#include "understory/map/mapper.hpp"

namespace understory {

class MapFileError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// By extension. In a `.bt` every observed voxel that is not free is occupied. An existing file is
// replaced only once the new one is complete.
void save_octomap(const MapSnapshot& map, const std::string& path);

// The tree alone, as `octomap_msgs/Octomap` carries it in `data`: with every log-odds (as in
// `.ot`), or only whether voxels are free (`is_binary`, as in `.bt`). Throws MapFileError for a box
// that an OctoMap cannot hold.
[[nodiscard]] std::string octomap_tree(const MapSnapshot& map, bool is_binary);

// For Mapper(MapSnapshot) to go on from. Log-odds of other makers are rounded to our units and
// clamped as `config` has it; in a `.bt` free and occupied stand at the clamps. ConfigError for a
// wrong config or box.
[[nodiscard]] MapSnapshot load_octomap(const std::string& path,
                                       const MapConfig& config,
                                       const Box3d& box_m);

}  // namespace understory
