// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/sim/team_member.hpp"

#include "understory/team/own_state.hpp"
#include "understory/team/teammate_mask.hpp"

namespace understory {
namespace {

constexpr std::uint64_t kSession = 1;  // a simulated vehicle starts once

}  // namespace

TeamMember::TeamMember(const team::TeamConfig& config, const MapSnapshot& own, team::Link& link)
    : config_(config), exchange_(config, own.geometry, own.sensor_model, kSession), link_(link) {}

DepthImage TeamMember::mask(DepthImage image,
                            const CameraModel& camera,
                            const Pose& world_from_optical,
                            Time now) const {
  std::vector<Vector3d> centers_m;
  for (const team::Peer& peer : exchange_.peers(now)) {
    centers_m.push_back(peer.position_at(now));
  }
  return team::mask_teammates(
      std::move(image), camera, world_from_optical, centers_m, config_.separation.mask_radius_m);
}

MapSnapshotPtr TeamMember::fuse(const MapSnapshot& own, Time now) {
  for (const team::Sample& sample : link_.take()) {
    exchange_.receive(sample, now);
  }
  return exchange_.on_map(own, now);
}

void TeamMember::tell(const VehicleState& vehicle, const Mission& mission, Time now) {
  TrajectoryPoint here;
  here.position_m = vehicle.position_m;
  here.velocity_mps = vehicle.velocity_mps;
  here.yaw_rad = yaw_of(vehicle.world_from_body);
  for (team::Sample& sample : exchange_.due(team::own_state(mission, here), now)) {
    link_.publish(std::move(sample));
  }
}

}  // namespace understory
