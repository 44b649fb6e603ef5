// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/team/own_state.hpp"

namespace understory::team {

OwnState own_state(const Mission& mission, const TrajectoryPoint& here) {
  OwnState own;
  own.position_m = here.position_m;
  own.velocity_mps = here.velocity_mps;
  own.yaw_rad = here.yaw_rad;
  own.mode = mission.explorer().mode();
  own.state = mission.state();
  own.trajectory = mission.pilot().follower().newest();
  // Who has found nothing left wants nothing for itself.
  if (mission.state() == MissionState::kExplore && mission.explorer().target()) {
    own.target_m = mission.explorer().target()->candidate.viewpoint.position_m;
  }
  return own;
}

}  // namespace understory::team
