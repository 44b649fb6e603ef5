// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// The map on its way between nodelets. Within the process the snapshot travels by pointer; to other
// processes it serialises as understory_msgs/MapUpdate: the changed tiles, or all of them where
// `is_whole`. MapReceiver gives subscribers a snapshot either way. Immutable once published; a
// receiver is used by one thread. What does not fit is refused and no value.
#pragma once

#include <optional>

#include <std_msgs/Header.h>
#include <understory_msgs/MapUpdate.h>

#include "understory/map/mapper.hpp"

namespace understory {

struct MapUpdate {
  std_msgs::Header header;  // stamp: exposure of the newest cloud in the map
  bool is_whole = false;
  MapSnapshotPtr map;                  // null once it came from another process
  understory_msgs::MapUpdate arrived;  // then this holds what came
};
using MapUpdatePtr = boost::shared_ptr<const MapUpdate>;

[[nodiscard]] understory_msgs::MapUpdate to_msg(const MapUpdate& update);

class MapReceiver {
 public:
  MapReceiver(const MapConfig& config, const Box3d& box_m);

  // Nothing when the update is of another map, or does not follow on what was received before:
  // then a whole one must come first.
  [[nodiscard]] MapSnapshotPtr accept(const MapUpdate& update);

 private:
  [[nodiscard]] bool fits(const understory_msgs::MapUpdate& msg) const;

  MapSnapshot unknown_;
  MapSnapshotPtr newest_;
};

}  // namespace understory

namespace ros {
namespace message_traits {

template <>
struct MD5Sum<understory::MapUpdate> : MD5Sum<understory_msgs::MapUpdate> {
  static const char* value(const understory::MapUpdate& /*update*/) { return value(); }
  using MD5Sum<understory_msgs::MapUpdate>::value;
};
template <>
struct DataType<understory::MapUpdate> : DataType<understory_msgs::MapUpdate> {
  static const char* value(const understory::MapUpdate& /*update*/) { return value(); }
  using DataType<understory_msgs::MapUpdate>::value;
};
template <>
struct Definition<understory::MapUpdate> : Definition<understory_msgs::MapUpdate> {
  static const char* value(const understory::MapUpdate& /*update*/) { return value(); }
  using Definition<understory_msgs::MapUpdate>::value;
};
template <>
struct HasHeader<understory::MapUpdate> : FalseType {};

}  // namespace message_traits

namespace serialization {

template <>
struct Serializer<understory::MapUpdate> {
  template <typename Stream>
  static void write(Stream& stream, const understory::MapUpdate& update) {
    stream.next(understory::to_msg(update));
  }
  template <typename Stream>
  static void read(Stream& stream, understory::MapUpdate& update) {
    stream.next(update.arrived);
    update.header = update.arrived.header;
    update.is_whole = update.arrived.is_whole != 0;
  }
  // Off the fast path: only for subscribers in other processes.
  // NOLINTNEXTLINE(readability-identifier-naming): roscpp's name
  static std::uint32_t serializedLength(const understory::MapUpdate& update) {
    return serializationLength(understory::to_msg(update));
  }
};

}  // namespace serialization
}  // namespace ros
