// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// A trajectory on its way between nodelets: by pointer within the process, as
// understory_msgs/Trajectory to others. Immutable once published. What arrives from another process
// is checked; a trajectory that does not make sense is a null one.
#pragma once

#include <std_msgs/Header.h>
#include <understory_msgs/Trajectory.h>

#include "understory/plan/trajectory.hpp"

namespace understory {

struct TrajectoryUpdate {
  std_msgs::Header header;  // stamp: when it takes over
  TrajectoryPtr trajectory;
};
using TrajectoryUpdatePtr = boost::shared_ptr<const TrajectoryUpdate>;

[[nodiscard]] understory_msgs::Trajectory to_msg(const TrajectoryUpdate& update);
[[nodiscard]] TrajectoryPtr from_msg(const understory_msgs::Trajectory& msg);

}  // namespace understory

namespace ros {
namespace message_traits {

template <>
struct MD5Sum<understory::TrajectoryUpdate> : MD5Sum<understory_msgs::Trajectory> {
  static const char* value(const understory::TrajectoryUpdate& /*update*/) { return value(); }
  using MD5Sum<understory_msgs::Trajectory>::value;
};
template <>
struct DataType<understory::TrajectoryUpdate> : DataType<understory_msgs::Trajectory> {
  static const char* value(const understory::TrajectoryUpdate& /*update*/) { return value(); }
  using DataType<understory_msgs::Trajectory>::value;
};
template <>
struct Definition<understory::TrajectoryUpdate> : Definition<understory_msgs::Trajectory> {
  static const char* value(const understory::TrajectoryUpdate& /*update*/) { return value(); }
  using Definition<understory_msgs::Trajectory>::value;
};
template <>
struct HasHeader<understory::TrajectoryUpdate> : FalseType {};

}  // namespace message_traits

namespace serialization {

template <>
struct Serializer<understory::TrajectoryUpdate> {
  template <typename Stream>
  static void write(Stream& stream, const understory::TrajectoryUpdate& update) {
    stream.next(understory::to_msg(update));
  }
  template <typename Stream>
  static void read(Stream& stream, understory::TrajectoryUpdate& update) {
    understory_msgs::Trajectory msg;
    stream.next(msg);
    update.header = msg.header;
    update.trajectory = understory::from_msg(msg);
  }
  // NOLINTNEXTLINE(readability-identifier-naming): roscpp's name
  static std::uint32_t serializedLength(const understory::TrajectoryUpdate& update) {
    return serializationLength(understory::to_msg(update));
  }
};

}  // namespace serialization
}  // namespace ros
