// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// Many seeds of one scenario, a row of CSV on stdout each, nothing dropped: a failed run is a row
// as well. SI units.
#pragma once

#include <functional>

#include "understory/simulate/options.hpp"

namespace understory {

// Exit status: 0 when every run completed without collision.
[[nodiscard]] int fly_batch(const Options& options, const std::function<bool()>& interrupted);

}  // namespace understory
