// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// Maps and trajectories on their way between processes: what arrives is what was sent, and what
// does not fit is refused.
#include <limits>

#include <gtest/gtest.h>
#include <ros/serialization.h>

#include "understory/nodelets/map_update.hpp"
#include "understory/nodelets/trajectory_update.hpp"

namespace understory {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
const Box3d kBox(Vector3d(-5.0, -5.0, 0.0), Vector3d(5.0, 5.0, 2.0));

template <class Message>
Message through_the_wire(const Message& sent) {
  const ros::SerializedMessage bytes = ros::serialization::serializeMessage(sent);
  ros::serialization::IStream stream(bytes.message_start,
                                     static_cast<std::uint32_t>(bytes.num_bytes) - 4U);
  Message arrived;
  ros::serialization::deserialize(stream, arrived);
  return arrived;
}

// A mapper that sees a plane at 2 m from a point that moves on with every frame.
class Flight {
 public:
  explicit Flight(const MapConfig& config = {}) : mapper_(config, kBox) {
    CameraConfig camera;
    camera.width_px = 64;
    camera.height_px = 48;
    camera_ = CameraModel(camera);
    depth_m_.assign(std::size_t{64} * 48, 2.0F);
  }

  MapUpdate next(bool is_whole) {
    Pose world_from_optical = body_from_optical(CameraConfig());
    world_from_optical.translation() += Vector3d(0.3 * frames_ - 3.0, 0.1, 1.0);
    ++frames_;
    const DepthView view{depth_m_.data(), 1, 64, 48};
    const Time exposure(std::chrono::milliseconds(100 * frames_));
    EXPECT_TRUE(mapper_.integrate(camera_, view, world_from_optical, exposure));
    MapUpdate update;
    update.header.frame_id = "map";
    update.header.stamp.fromNSec(100000000U * static_cast<std::uint64_t>(frames_));
    update.is_whole = is_whole;
    update.map = mapper_.publish();
    return update;
  }

 private:
  Mapper mapper_;
  CameraModel camera_;
  std::vector<float> depth_m_;
  int frames_ = 0;
};

void expect_same_tiles(const MapSnapshot& map, const MapSnapshot& other) {
  ASSERT_EQ(map.tiles.size(), other.tiles.size());
  std::size_t known = 0;
  for (TileSlot slot = 0; slot < map.tiles.size(); ++slot) {
    ASSERT_EQ(map.tiles[slot] == nullptr, other.tiles[slot] == nullptr) << "slot " << slot;
    if (map.tiles[slot]) {
      EXPECT_EQ(map.tiles[slot]->log_odds, other.tiles[slot]->log_odds) << "slot " << slot;
      EXPECT_EQ(map.tiles[slot]->free_rows, other.tiles[slot]->free_rows) << "slot " << slot;
      EXPECT_EQ(map.tiles[slot]->known_rows, other.tiles[slot]->known_rows) << "slot " << slot;
      ++known;
    }
  }
  EXPECT_GT(known, 4U);
}

TEST(MapUpdate, WholeMapArrivesBitForBit) {
  const MapUpdate sent = Flight().next(true);
  MapReceiver receiver(MapConfig(), kBox);

  const MapUpdate arrived = through_the_wire(sent);
  const MapSnapshotPtr map = receiver.accept(arrived);

  EXPECT_EQ(arrived.map, nullptr);
  EXPECT_TRUE(arrived.is_whole);
  EXPECT_EQ(arrived.header.stamp, sent.header.stamp);
  EXPECT_EQ(arrived.header.frame_id, "map");
  ASSERT_NE(map, nullptr);
  EXPECT_EQ(map->revision, sent.map->revision);
  EXPECT_EQ(map->stamp, sent.map->stamp);
  expect_same_tiles(*map, *sent.map);
}

TEST(MapUpdate, DeltasAddUpToTheMap) {
  Flight flight;
  MapReceiver receiver(MapConfig(), kBox);
  ASSERT_NE(receiver.accept(through_the_wire(flight.next(true))), nullptr);

  for (int frame = 0; frame < 8; ++frame) {
    const MapUpdate sent = flight.next(false);
    const MapSnapshotPtr map = receiver.accept(through_the_wire(sent));

    ASSERT_NE(map, nullptr);
    expect_same_tiles(*map, *sent.map);
    EXPECT_EQ(map->changed_tiles, sent.map->changed_tiles);
  }
}

TEST(MapUpdate, DeltaIsSmallerThanTheWholeMap) {
  Flight flight;
  for (int frame = 0; frame < 10; ++frame) {
    static_cast<void>(flight.next(false));
  }
  const MapUpdate delta = flight.next(false);
  MapUpdate whole = delta;
  whole.is_whole = true;

  EXPECT_LT(ros::serialization::serializationLength(delta),
            ros::serialization::serializationLength(whole));
}

TEST(MapReceiver, RefusesDeltasUntilAWholeMapCame) {
  Flight flight;
  MapReceiver receiver(MapConfig(), kBox);

  EXPECT_EQ(receiver.accept(through_the_wire(flight.next(false))), nullptr);
  EXPECT_EQ(receiver.accept(through_the_wire(flight.next(false))), nullptr);
  EXPECT_NE(receiver.accept(through_the_wire(flight.next(true))), nullptr);
  EXPECT_NE(receiver.accept(through_the_wire(flight.next(false))), nullptr);
}

TEST(MapReceiver, RefusesDeltasAfterAGapUntilAWholeMapCame) {
  Flight flight;
  MapReceiver receiver(MapConfig(), kBox);
  ASSERT_NE(receiver.accept(through_the_wire(flight.next(true))), nullptr);
  static_cast<void>(flight.next(false));  // is lost

  EXPECT_EQ(receiver.accept(through_the_wire(flight.next(false))), nullptr);
  EXPECT_EQ(receiver.accept(through_the_wire(flight.next(false))), nullptr);
  const MapUpdate whole = flight.next(true);
  const MapSnapshotPtr map = receiver.accept(through_the_wire(whole));

  ASSERT_NE(map, nullptr);
  expect_same_tiles(*map, *whole.map);
}

TEST(MapReceiver, RefusesADeltaThatCameTwice) {
  Flight flight;
  MapReceiver receiver(MapConfig(), kBox);
  ASSERT_NE(receiver.accept(through_the_wire(flight.next(true))), nullptr);
  const MapUpdate delta = through_the_wire(flight.next(false));

  EXPECT_NE(receiver.accept(delta), nullptr);
  EXPECT_EQ(receiver.accept(delta), nullptr);
}

TEST(MapReceiver, RefusesAMapOfAnotherBox) {
  const MapUpdate update = Flight().next(true);
  MapReceiver receiver(MapConfig(), Box3d(Vector3d(-5.0, -5.0, 0.0), Vector3d(5.0, 5.1, 2.0)));

  EXPECT_EQ(receiver.accept(update), nullptr);
  EXPECT_EQ(receiver.accept(through_the_wire(update)), nullptr);
}

TEST(MapReceiver, RefusesAMapOfAnotherResolution) {
  const MapUpdate update = Flight().next(true);
  MapConfig coarser;
  coarser.resolution_m = 0.2;
  MapReceiver receiver(coarser, kBox);

  EXPECT_EQ(receiver.accept(update), nullptr);
  EXPECT_EQ(receiver.accept(through_the_wire(update)), nullptr);
}

TEST(MapReceiver, RefusesATileBeyondTheTable) {
  MapUpdate update = through_the_wire(Flight().next(true));
  MapReceiver receiver(MapConfig(), kBox);
  ASSERT_FALSE(update.arrived.tiles.empty());
  update.arrived.tiles.back().slot = std::numeric_limits<std::uint32_t>::max();

  EXPECT_EQ(receiver.accept(update), nullptr);
}

TEST(MapReceiver, HandsOnTheSnapshotOfItsOwnProcess) {
  const MapUpdate update = Flight().next(false);
  MapReceiver receiver(MapConfig(), kBox);

  EXPECT_EQ(receiver.accept(update), update.map);
}

TrajectoryUpdate some_trajectory() {
  auto trajectory = std::make_shared<Trajectory>();
  trajectory->id = 7;
  trajectory->start = Time(std::chrono::microseconds(1700000000123456));
  trajectory->mode = FlightMode::kCollector;
  for (int i = 0; i < 6; ++i) {
    trajectory->position.control_points.emplace_back(0.1 * i, 1.0 / 3.0, 1.0 + 0.01 * i);
    trajectory->yaw.control_points.push_back(0.7 * i);
  }
  trajectory->position.knot_s = 0.15;
  trajectory->yaw.knot_s = 0.3;
  trajectory->limits = {1.1, 0.9, 0.8, 1.9};
  trajectory->depth_stamp = Time(std::chrono::microseconds(1700000000000001));
  TrajectoryUpdate update;
  update.header.frame_id = "map";
  update.header.stamp.fromNSec(1700000000123456000U);
  update.trajectory = trajectory;
  return update;
}

TEST(TrajectoryUpdate, ArrivesBitForBit) {
  const TrajectoryUpdate sent = some_trajectory();

  const TrajectoryUpdate update = through_the_wire(sent);

  ASSERT_NE(update.trajectory, nullptr);
  const Trajectory& arrived = *update.trajectory;
  EXPECT_EQ(update.header.frame_id, "map");
  EXPECT_EQ(arrived.id, sent.trajectory->id);
  EXPECT_EQ(arrived.start, sent.trajectory->start);
  EXPECT_EQ(arrived.mode, sent.trajectory->mode);
  EXPECT_EQ(arrived.position.control_points, sent.trajectory->position.control_points);
  EXPECT_EQ(arrived.position.knot_s, sent.trajectory->position.knot_s);
  EXPECT_EQ(arrived.yaw.control_points, sent.trajectory->yaw.control_points);
  EXPECT_EQ(arrived.yaw.knot_s, sent.trajectory->yaw.knot_s);
  EXPECT_EQ(arrived.limits.speed_mps, sent.trajectory->limits.speed_mps);
  EXPECT_EQ(arrived.limits.acceleration_mps2, sent.trajectory->limits.acceleration_mps2);
  EXPECT_EQ(arrived.limits.yaw_rate_radps, sent.trajectory->limits.yaw_rate_radps);
  EXPECT_EQ(arrived.limits.yaw_acceleration_radps2,
            sent.trajectory->limits.yaw_acceleration_radps2);
  EXPECT_EQ(arrived.depth_stamp, sent.trajectory->depth_stamp);
}

struct Malformed {
  const char* name;
  void (*spoil)(understory_msgs::Trajectory&);
};

class MalformedTrajectory : public ::testing::TestWithParam<Malformed> {};

TEST_P(MalformedTrajectory, BecomesNull) {
  understory_msgs::Trajectory msg = to_msg(some_trajectory());
  ASSERT_NE(from_msg(msg), nullptr);

  GetParam().spoil(msg);

  EXPECT_EQ(from_msg(msg), nullptr);
}

using Msg = understory_msgs::Trajectory;
const Malformed kMalformed[] = {
    {"NanPosition", [](Msg& msg) { msg.position_control_points[2].y = kNan; }},
    {"InfinitePosition", [](Msg& msg) { msg.position_control_points[5].z = 1.0 / 0.0; }},
    {"NanYaw", [](Msg& msg) { msg.yaw_control_points[0] = kNan; }},
    {"ThreePositions", [](Msg& msg) { msg.position_control_points.resize(3); }},
    {"NoPositions", [](Msg& msg) { msg.position_control_points.clear(); }},
    {"ThreeYaws", [](Msg& msg) { msg.yaw_control_points.resize(3); }},
    {"ZeroKnot", [](Msg& msg) { msg.position_knot_s = 0.0; }},
    {"NegativeKnot", [](Msg& msg) { msg.position_knot_s = -0.1; }},
    {"NanKnot", [](Msg& msg) { msg.position_knot_s = kNan; }},
    {"ZeroYawKnot", [](Msg& msg) { msg.yaw_knot_s = 0.0; }},
    {"InfiniteYawKnot", [](Msg& msg) { msg.yaw_knot_s = 1.0 / 0.0; }},
    {"UnknownMode", [](Msg& msg) { msg.mode = 9; }},
};
INSTANTIATE_TEST_SUITE_P(Message,
                         MalformedTrajectory,
                         ::testing::ValuesIn(kMalformed),
                         [](const auto& malformed) { return malformed.param.name; });

TEST(TrajectoryUpdate, MalformedBytesArriveAsNull) {
  Msg msg = to_msg(some_trajectory());
  msg.yaw_knot_s = kNan;
  const ros::SerializedMessage bytes = ros::serialization::serializeMessage(msg);
  ros::serialization::IStream stream(bytes.message_start,
                                     static_cast<std::uint32_t>(bytes.num_bytes) - 4U);
  TrajectoryUpdate arrived;

  ros::serialization::deserialize(stream, arrived);

  EXPECT_EQ(arrived.trajectory, nullptr);
}

}  // namespace
}  // namespace understory
