// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// Stem maps as CSV files, metres. Two layouts, told apart by their first line: `# comment` and then
// rows `x,y,radius`; or the header `x_m,y_m,dbh_m` and then rows with the trunk's DIAMETER. Blank
// lines and later `#` lines are skipped. Everything wrong throws ForestError naming file and line.
#pragma once

#include <string>

#include "understory/sim/forest.hpp"

namespace understory {

[[nodiscard]] Forest read_forest_csv(const std::string& path);

// In the `# comment`, `x,y,radius` layout, to a tenth of a millimetre.
void write_forest_csv(const Forest& forest, const std::string& path);

}  // namespace understory
