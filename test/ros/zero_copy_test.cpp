// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// Within the process images, clouds, maps and trajectories travel by pointer: what a subscriber
// gets is the object that was published. Shown by addresses.
#include <map>
#include <set>

#include <gtest/gtest.h>
#include <pcl_conversions/pcl_conversions.h>
#include <pcl_ros/point_cloud.h>
#include <sensor_msgs/Image.h>

#include "in_process.hpp"
#include "understory/nodelets/depth_to_cloud.hpp"
#include "understory/nodelets/map_update.hpp"
#include "understory/nodelets/trajectory_update.hpp"

namespace understory {
namespace {

using test::InProcess;
using test::wait_until;
using test::Witness;

template <class Message>
class TwoWitnesses {
 public:
  explicit TwoWitnesses(const std::string& topic) : first_(topic), second_(topic) {}

  [[nodiscard]] bool have_seen(std::size_t count) const {
    return first_.seen.size() >= count && second_.seen.size() >= count;
  }
  [[nodiscard]] const std::vector<boost::shared_ptr<const Message>>& seen() const {
    return first_.seen;
  }
  [[nodiscard]] bool have_both_seen(const Message* message) const {
    return first_.seen.size() == 1 && second_.seen.size() == 1 && first_.seen[0].get() == message &&
           second_.seen[0].get() == message;
  }
  // They may have begun to listen at different messages.
  [[nodiscard]] std::size_t seen_by_both() const {
    std::set<const Message*> addresses;
    for (const auto& message : first_.seen) {
      addresses.insert(message.get());
    }
    std::size_t both = 0;
    for (const auto& message : second_.seen) {
      both += addresses.count(message.get());
    }
    return both;
  }

 private:
  Witness<Message> first_;
  Witness<Message> second_;
};

// Beside the nodelets that read them too.
class PublishedByUs : public ::testing::Test {
 protected:
  template <class Message>
  void expect_to_arrive_itself(const std::string& topic,
                               const boost::shared_ptr<const Message>& message) {
    ASSERT_TRUE(readers_.is_loaded());
    TwoWitnesses<Message> witnesses(topic);
    ros::Publisher publisher = ros::NodeHandle().advertise<Message>(topic, 1);
    ASSERT_TRUE(wait_until([&] { return publisher.getNumSubscribers() > 0; }));

    publisher.publish(message);

    ASSERT_TRUE(wait_until([&] { return witnesses.have_seen(1); }));
    EXPECT_TRUE(witnesses.have_both_seen(message.get()));
  }

 private:
  InProcess readers_{{"Recorder", "Monitor", "MapPublisher", "Explorer", "Mapper", "DepthCloud"}};
};

TEST_F(PublishedByUs, ImageArrivesItself) {
  expect_to_arrive_itself<sensor_msgs::Image>("camera/depth/image_rect",
                                              boost::make_shared<sensor_msgs::Image>());
}

TEST_F(PublishedByUs, CloudArrivesItself) {
  auto cloud = boost::make_shared<Cloud>(64, 48);
  cloud->header.frame_id = "camera_optical";
  expect_to_arrive_itself<Cloud>("camera/depth/points", cloud);
}

TEST_F(PublishedByUs, MapArrivesItself) {
  const Box3d box(Vector3d(-5.0, -5.0, 0.0), Vector3d(5.0, 5.0, 2.0));
  auto update = boost::make_shared<MapUpdate>();
  update->map = Mapper(MapConfig(), box).publish();
  expect_to_arrive_itself<MapUpdate>("map_updates", update);
}

TEST_F(PublishedByUs, TrajectoryArrivesItself) {
  auto update = boost::make_shared<TrajectoryUpdate>();
  update->trajectory = std::make_shared<Trajectory>();
  expect_to_arrive_itself<TrajectoryUpdate>("trajectory", update);
}

// The whole pipeline, flying.
class Pipeline : public ::testing::Test {
 protected:
  void SetUp() override { ASSERT_TRUE(nodelets_.is_loaded()); }

 private:
  InProcess nodelets_{{"Recorder",
                       "Monitor",
                       "MapPublisher",
                       "Explorer",
                       "Mapper",
                       "DepthCloud",
                       "SimCamera",
                       "Bridge"}};
};

TEST_F(Pipeline, SubscribersShareWhatTheNodeletsPublish) {
  constexpr std::size_t kFrames = 20;
  TwoWitnesses<sensor_msgs::Image> images("camera/depth/image_rect");
  TwoWitnesses<Cloud> clouds("camera/depth/points");
  TwoWitnesses<MapUpdate> maps("map_updates");
  TwoWitnesses<TrajectoryUpdate> trajectories("trajectory");

  ASSERT_TRUE(wait_until([&] {
    return images.have_seen(kFrames) && clouds.have_seen(kFrames) && maps.have_seen(kFrames) &&
           trajectories.have_seen(1);
  }));

  EXPECT_GE(images.seen_by_both(), kFrames - 1);
  EXPECT_GE(clouds.seen_by_both(), kFrames - 1);
  EXPECT_GE(maps.seen_by_both(), kFrames - 1);
  EXPECT_GE(trajectories.seen_by_both(), 1U);
}

TEST_F(Pipeline, MapsArriveAsSnapshotsThatShareUnchangedTiles) {
  TwoWitnesses<MapUpdate> maps("map_updates");
  ASSERT_TRUE(wait_until([&] { return maps.have_seen(20); }));

  std::size_t shared = 0;
  std::size_t written = 0;
  for (std::size_t i = 1; i < maps.seen().size(); ++i) {
    ASSERT_NE(maps.seen()[i - 1]->map, nullptr);
    ASSERT_NE(maps.seen()[i]->map, nullptr);
    EXPECT_TRUE(maps.seen()[i]->arrived.tiles.empty());
    const MapSnapshot& older = *maps.seen()[i - 1]->map;
    const MapSnapshot& newer = *maps.seen()[i]->map;
    ASSERT_EQ(newer.revision, older.revision + 1);
    const std::set<TileSlot> changed(newer.changed_tiles.begin(), newer.changed_tiles.end());
    for (TileSlot slot = 0; slot < newer.tiles.size(); ++slot) {
      const bool is_same_object = newer.tiles[slot] == older.tiles[slot];
      EXPECT_EQ(is_same_object, changed.count(slot) == 0) << "slot " << slot;
      shared += newer.tiles[slot] != nullptr && is_same_object ? 1U : 0U;
      written += is_same_object ? 0U : 1U;
    }
  }
  EXPECT_GT(shared, 0U);
  EXPECT_GT(written, 0U);
}

}  // namespace
}  // namespace understory

int main(int argc, char** argv) {
  return understory::test::run_with_ros(argc, argv, "zero_copy");
}
