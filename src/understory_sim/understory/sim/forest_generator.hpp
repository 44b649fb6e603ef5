// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// Random forests: centres uniform in a rectangle, radii uniform, a trunk is rejected when its
// surface is nearer than `clear_radius_m` to a start or nearer than `min_gap_m` to an earlier
// trunk. World frame, metres, to a tenth of a millimetre as in the CSV files. The same
// configuration and Rng give the same forest. Throws ForestError naming the key when the rules
// cannot be met; never loops for ever.
#pragma once

#include <vector>

#include "understory/base/config.hpp"
#include "understory/base/rng.hpp"
#include "understory/sim/forest.hpp"

namespace understory {

struct ForestRegionConfig {
  double x_min_m = -25.0;
  double y_min_m = -25.0;
  double x_max_m = 25.0;
  double y_max_m = 25.0;
  double trees_per_m2 = 0.10;

  void visit(FieldVisitor& f) {
    f.field("x_min_m", x_min_m, in_range(-1e4, 1e4), "west side");
    f.field("y_min_m", y_min_m, in_range(-1e4, 1e4), "south side");
    f.field("x_max_m", x_max_m, in_range(-1e4, 1e4), "east side");
    f.field("y_max_m", y_max_m, in_range(-1e4, 1e4), "north side");
    f.field("trees_per_m2", trees_per_m2, in_range(0.0, 10.0), "trunks per square metre");
  }
};

struct ForestStartConfig {
  double x_m = 0.0;
  double y_m = 0.0;

  void visit(FieldVisitor& f) {
    f.field("x_m", x_m, in_range(-1e4, 1e4), "east");
    f.field("y_m", y_m, in_range(-1e4, 1e4), "north");
  }
};

struct GeneratorConfig {
  // The trunks of one region after the other; regions may touch and overlap.
  std::vector<ForestRegionConfig> regions = {ForestRegionConfig{}};
  std::vector<ForestStartConfig> starts = {ForestStartConfig{}};
  double clear_radius_m = 2.0;
  double min_gap_m = 0.10;
  double min_radius_m = 0.10;
  double max_radius_m = 0.30;
  double trunk_height_m = 3.0;

  void visit(FieldVisitor& f) {
    f.list("regions", regions, "Rectangles with their densities.");
    f.list("starts", starts, "Where vehicles start.");
    f.field("clear_radius_m", clear_radius_m, in_range(0.0, 100.0), "no trunk so near to a start");
    f.field("min_gap_m", min_gap_m, in_range(0.0, 10.0), "between the surfaces of two trunks");
    f.field("min_radius_m", min_radius_m, in_range(0.01, 5.0), "thinnest trunk");
    f.field("max_radius_m", max_radius_m, in_range(0.01, 5.0), "thickest trunk");
    f.field("trunk_height_m", trunk_height_m, in_range(0.1, 100.0), "from the ground");
  }
};

[[nodiscard]] Forest generate_forest(const GeneratorConfig& config, Rng rng);

}  // namespace understory
