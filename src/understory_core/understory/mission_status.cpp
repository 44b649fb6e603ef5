// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/mission_status.hpp"

namespace understory {

MissionStatus status_of(const Mission& mission, Time now) {
  const Explorer& explorer = mission.explorer();
  const Pilot& pilot = mission.pilot();
  MissionStatus status;
  status.time = now;
  status.state = mission.state();
  status.stop_reason = mission.stop_reason();
  status.mode = pilot.follower().at(now).mode;
  status.at_rest = pilot.is_at_rest(now);
  status.started_at = mission.started_at();
  if (mission.stop_reason() != StopReason::kNone) {
    status.explored_at = mission.explored_at();
  }
  status.clusters = explorer.clusters().size();
  for (const ClusterPtr& cluster : explorer.clusters()) {
    status.trails += cluster->is_trail() ? 1U : 0U;
    status.dormant += cluster->is_dormant() ? 1U : 0U;
  }
  status.set_aside = explorer.set_aside().size();
  if (explorer.target()) {
    const Candidate& target = explorer.target()->candidate;
    status.target_id = target.cluster->id;
    status.target_m = target.viewpoint.position_m;
  }
  status.replans = pilot.counters().plans;
  status.counters = {{"failed_plans", pilot.counters().failed_plans},
                     {"brakes", pilot.counters().brakes},
                     {"failed_brakes", pilot.counters().failed_brakes},
                     {"traffic_conflicts", pilot.counters().traffic_conflicts},
                     {"decisions", explorer.counters().decisions},
                     {"full_searches", explorer.counters().full_searches},
                     {"set_aside", explorer.counters().set_aside},
                     {"given_up", explorer.counters().given_up}};
  return status;
}

}  // namespace understory
