// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/nodelets/peers_update.hpp"

#include <cmath>

#include <understory_msgs/MissionStatus.h>

#include "understory/mission.hpp"
#include "understory/nodelets/conversions.hpp"
#include "understory/nodelets/trajectory_update.hpp"

namespace understory {
namespace {

understory_msgs::TeamPeer to_peer_msg(const team::Peer& peer) {
  understory_msgs::TeamPeer msg;
  msg.id = peer.id;
  msg.heard_at = to_ros(peer.heard_at);
  msg.stated_at = to_ros(peer.stated_at);
  msg.position = to_point(peer.position_m);
  msg.velocity.x = peer.velocity_mps.x();
  msg.velocity.y = peer.velocity_mps.y();
  msg.velocity.z = peer.velocity_mps.z();
  msg.yaw = peer.yaw_rad;
  msg.mode = static_cast<std::uint8_t>(peer.mode);
  msg.state = static_cast<std::uint8_t>(peer.state);
  msg.has_target = static_cast<std::uint8_t>(peer.target_m.has_value());
  msg.target = to_point(peer.target_m.value_or(Vector3d::Zero()));
  msg.has_trajectory = static_cast<std::uint8_t>(peer.trajectory != nullptr);
  if (peer.trajectory) {
    TrajectoryUpdate told;
    told.header.stamp = to_ros(peer.trajectory->start);
    told.trajectory = peer.trajectory;
    msg.trajectory = to_msg(told);
  }
  msg.in_contact = static_cast<std::uint8_t>(peer.in_contact);
  return msg;
}

team::Peer to_peer(const understory_msgs::TeamPeer& msg) {
  team::Peer peer;
  peer.id = msg.id;
  peer.heard_at = to_time(msg.heard_at);
  peer.stated_at = to_time(msg.stated_at);
  peer.position_m = to_vector(msg.position);
  peer.velocity_mps = {msg.velocity.x, msg.velocity.y, msg.velocity.z};
  peer.yaw_rad = msg.yaw;
  peer.mode = static_cast<FlightMode>(msg.mode);
  peer.state = static_cast<MissionState>(msg.state);
  if (msg.has_target != 0) {
    peer.target_m = to_vector(msg.target);
  }
  if (msg.has_trajectory != 0) {
    peer.trajectory = from_msg(msg.trajectory);
  }
  peer.in_contact = msg.in_contact != 0;
  return peer;
}

bool makes_sense(const understory_msgs::TeamPeer& msg) {
  const team::Peer peer = to_peer(msg);
  return msg.state <= understory_msgs::MissionStatus::MEET &&
         msg.mode <= understory_msgs::Trajectory::BRAKE && peer.position_m.allFinite() &&
         peer.velocity_mps.allFinite() && std::isfinite(peer.yaw_rad) &&
         (!peer.target_m || peer.target_m->allFinite());
}

}  // namespace

understory_msgs::TeamPeers to_msg(const PeersUpdate& update) {
  understory_msgs::TeamPeers msg;
  msg.header = update.header;
  for (const team::Peer& peer : update.peers) {
    msg.peers.push_back(to_peer_msg(peer));
  }
  return msg;
}

team::Peers from_msg(const understory_msgs::TeamPeers& msg) {
  team::Peers peers;
  for (const understory_msgs::TeamPeer& peer : msg.peers) {
    if (makes_sense(peer)) {
      peers.push_back(to_peer(peer));
    }
  }
  return peers;
}

std::vector<Vector3d> places_near(const PeersUpdatePtr& update,
                                  Time time,
                                  const Vector3d& place_m,
                                  double radius_m) {
  std::vector<Vector3d> places_m;
  if (update) {
    for (const team::Peer& peer : update->peers) {
      const Vector3d at_m = peer.position_at(time);
      if ((at_m - place_m).norm() <= radius_m) {
        places_m.push_back(at_m);
      }
    }
  }
  return places_m;
}

}  // namespace understory
