// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// Tells whether a PLY file is whole, before Assimp sees it: Assimp 5.2 reads a header that does not
// end for ever and crashes on a binary body that is cut short. Nothing can fail.
#pragma once

#include <string>

namespace understory {

// What is wrong with the content of a PLY file; empty when it holds all that its header announces.
[[nodiscard]] std::string ply_defect(const std::string& content);

}  // namespace understory
