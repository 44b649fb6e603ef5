// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// What makes a vehicle of the lockstep simulator one of a team: what it hears and tells over its
// link, once per camera frame. World frame, SI units. One thread; deterministic; nothing fails
// after construction.
#pragma once

#include "understory/autopilot/control_law.hpp"
#include "understory/mission.hpp"
#include "understory/team/exchange.hpp"
#include "understory/team/link.hpp"

namespace understory {

class TeamMember {
 public:
  // The link must outlive it.
  TeamMember(const team::TeamConfig& config, const MapSnapshot& own, team::Link& link);

  // Without what the camera sees of the others.
  [[nodiscard]] DepthImage mask(DepthImage image,
                                const CameraModel& camera,
                                const Pose& world_from_optical,
                                Time now) const;
  // The team's map, as far as it is known here.
  [[nodiscard]] MapSnapshotPtr fuse(const MapSnapshot& own, Time now);
  [[nodiscard]] team::Peers peers(Time now) const { return exchange_.peers(now); }
  void tell(const VehicleState& vehicle, const Mission& mission, Time now);

  [[nodiscard]] const team::Exchange& exchange() const { return exchange_; }

 private:
  team::TeamConfig config_;
  team::Exchange exchange_;
  team::Link& link_;
};

}  // namespace understory
