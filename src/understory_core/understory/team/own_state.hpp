// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// What a vehicle tells its team of itself. World frame, SI units. A value; cannot fail.
#pragma once

#include "understory/mission.hpp"
#include "understory/team/exchange.hpp"

namespace understory::team {

// `here`: where it measures itself to be; of it position, velocity and yaw count.
[[nodiscard]] OwnState own_state(const Mission& mission, const TrajectoryPoint& here);

}  // namespace understory::team
