// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// What CycloneDDS is told before it starts, and whether it can start. Throws ConfigError, in one
// line, for what the network of this machine does not have.
#pragma once

#include <string>

#include "understory/dds/dds_config.hpp"

namespace understory::dds {

// XML, as in the variable CYCLONEDDS_URI.
[[nodiscard]] std::string cyclone_settings(const DdsConfig& config);

// The interface is there and up.
void check_interface(const std::string& interface);

}  // namespace understory::dds
