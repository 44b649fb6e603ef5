// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// What can be seen from where, as far as the map knows. World frame, metres; pure function.
#pragma once

#include "understory/plan/clearance_map.hpp"

namespace understory {

// Straight line through known free space, both ends included.
[[nodiscard]] bool line_is_free(const ClearanceMap& map,
                                const Vector3d& from_m,
                                const Vector3d& to_m);

}  // namespace understory
