// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// What is known of team mates on its way between nodelets: by value within the process
// (trajectories by pointer), as understory_msgs/TeamPeers to others. Immutable once published. What
// arrives from another process is checked; a team mate that does not make sense is left out. World
// frame, SI units, times of this vehicle's clock.
#pragma once

#include <std_msgs/Header.h>
#include <understory_msgs/TeamPeers.h>

#include "understory/team/peer.hpp"

namespace understory {

struct PeersUpdate {
  std_msgs::Header header;  // stamp: when this was so
  team::Peers peers;
};
using PeersUpdatePtr = boost::shared_ptr<const PeersUpdate>;

[[nodiscard]] understory_msgs::TeamPeers to_msg(const PeersUpdate& update);
[[nodiscard]] team::Peers from_msg(const understory_msgs::TeamPeers& msg);

// Where they are at a time, as far as is known; of those that may be within `radius_m` of a place.
// Nobody if there is no update.
[[nodiscard]] std::vector<Vector3d> places_near(const PeersUpdatePtr& update,
                                                Time time,
                                                const Vector3d& place_m,
                                                double radius_m);

}  // namespace understory

namespace ros {
namespace message_traits {

template <>
struct MD5Sum<understory::PeersUpdate> : MD5Sum<understory_msgs::TeamPeers> {
  static const char* value(const understory::PeersUpdate& /*update*/) { return value(); }
  using MD5Sum<understory_msgs::TeamPeers>::value;
};
template <>
struct DataType<understory::PeersUpdate> : DataType<understory_msgs::TeamPeers> {
  static const char* value(const understory::PeersUpdate& /*update*/) { return value(); }
  using DataType<understory_msgs::TeamPeers>::value;
};
template <>
struct Definition<understory::PeersUpdate> : Definition<understory_msgs::TeamPeers> {
  static const char* value(const understory::PeersUpdate& /*update*/) { return value(); }
  using Definition<understory_msgs::TeamPeers>::value;
};
template <>
struct HasHeader<understory::PeersUpdate> : FalseType {};

}  // namespace message_traits

namespace serialization {

template <>
struct Serializer<understory::PeersUpdate> {
  template <typename Stream>
  static void write(Stream& stream, const understory::PeersUpdate& update) {
    stream.next(understory::to_msg(update));
  }
  template <typename Stream>
  static void read(Stream& stream, understory::PeersUpdate& update) {
    understory_msgs::TeamPeers msg;
    stream.next(msg);
    update.header = msg.header;
    update.peers = understory::from_msg(msg);
  }
  // NOLINTNEXTLINE(readability-identifier-naming): roscpp's name
  static std::uint32_t serializedLength(const understory::PeersUpdate& update) {
    return serializationLength(understory::to_msg(update));
  }
};

}  // namespace serialization
}  // namespace ros
