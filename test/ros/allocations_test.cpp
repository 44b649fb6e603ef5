// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// What one 640 x 480 frame allocates on its way from image to map: far less than a copy of the
// image (1.2 MB) or of the cloud (4.9 MB). This program's malloc and its kin count every byte that
// anything in the process asks for.
#include <atomic>
#include <cerrno>
#include <cstdio>

#include <pcl_ros/point_cloud.h>
#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/Image.h>
#include <sensor_msgs/image_encodings.h>
#include <tf2_eigen/tf2_eigen.h>
#include <tf2_ros/transform_broadcaster.h>

#include "in_process.hpp"
#include "understory/nodelets/conversions.hpp"
#include "understory/nodelets/flight_setup.hpp"
#include "understory/nodelets/map_update.hpp"
#include "understory/sim/depth_renderer.hpp"
#include "understory/sim/mission_record.hpp"

namespace {

// What replaces malloc has no other place to count.
std::atomic<std::size_t> g_bytes{0};        // NOLINT
std::atomic<std::size_t> g_allocations{0};  // NOLINT
std::atomic<std::size_t> g_largest{0};      // NOLINT

void count(std::size_t bytes) {
  g_bytes.fetch_add(bytes, std::memory_order_relaxed);
  g_allocations.fetch_add(1, std::memory_order_relaxed);
  std::size_t largest = g_largest.load(std::memory_order_relaxed);
  while (bytes > largest && !g_largest.compare_exchange_weak(largest, bytes)) {
  }
}

}  // namespace

// NOLINTBEGIN: names and signatures are the C library's
extern "C" {
void* __libc_malloc(std::size_t);
void* __libc_calloc(std::size_t, std::size_t);
void* __libc_realloc(void*, std::size_t);
void* __libc_memalign(std::size_t, std::size_t);
void __libc_free(void*);

void* malloc(std::size_t bytes) noexcept {
  count(bytes);
  return __libc_malloc(bytes);
}
void* calloc(std::size_t items, std::size_t bytes) noexcept {
  count(items * bytes);
  return __libc_calloc(items, bytes);
}
void* realloc(void* memory, std::size_t bytes) noexcept {
  count(bytes);
  return __libc_realloc(memory, bytes);
}
void* memalign(std::size_t alignment, std::size_t bytes) noexcept {
  count(bytes);
  return __libc_memalign(alignment, bytes);
}
void* aligned_alloc(std::size_t alignment, std::size_t bytes) noexcept {
  count(bytes);
  return __libc_memalign(alignment, bytes);
}
int posix_memalign(void** memory, std::size_t alignment, std::size_t bytes) noexcept {
  count(bytes);
  *memory = __libc_memalign(alignment, bytes);
  return *memory == nullptr ? ENOMEM : 0;
}
void free(void* memory) noexcept {
  __libc_free(memory);
}
}
// NOLINTEND

namespace understory {
namespace {

constexpr int kWarmUpFrames = 10;
constexpr int kFrames = 50;
constexpr double kStepM = 0.05;
constexpr double kMostMeanBytes = 0.2e6;  // 0.06e6 measured, nearly all of it changed tiles

// A camera that moves on straight ahead through the scenario's forest, and its driver.
class Driver {
 public:
  Driver()
      : setup_(load_flight_setup(nh_)),
        camera_(setup_.config.explorer.camera),
        world_(setup_.config, setup_.seed),
        renderer_(world_.truth->forest()),
        first_stamp_(ros::Time::now()),
        info_publisher_(nh_.advertise<sensor_msgs::CameraInfo>("camera/depth/camera_info", 1)),
        image_publisher_(nh_.advertise<sensor_msgs::Image>("camera/depth/image_rect", 1)),
        map_subscriber_(nh_.subscribe("map_updates", 1, &Driver::on_map, this)) {}

  // Everything but the image is there before bytes are counted.
  [[nodiscard]] sensor_msgs::ImageConstPtr prepare(int frame) {
    Pose world_from_body = Pose::Identity();
    world_from_body.translation() = Vector3d(kStepM * frame - 2.0, 0.0, 1.0);
    const Pose world_from_optical =
        world_from_body * body_from_optical(setup_.config.explorer.camera);
    const DepthImage depth = renderer_.render(camera_, world_from_optical);
    auto image = boost::make_shared<sensor_msgs::Image>();
    // Clouds keep whole microseconds.
    image->header.stamp = to_ros(to_time(first_stamp_ + ros::Duration(frame / 30.0)));
    image->header.frame_id = setup_.onboard.frames.camera;
    image->width = static_cast<std::uint32_t>(depth.width_px);
    image->height = static_cast<std::uint32_t>(depth.height_px);
    image->encoding = sensor_msgs::image_encodings::TYPE_32FC1;
    image->step = image->width * static_cast<std::uint32_t>(sizeof(float));
    image->data.resize(depth.z_m.size() * sizeof(float));
    std::memcpy(image->data.data(), depth.z_m.data(), image->data.size());
    publish_pose(world_from_body, image->header.stamp);
    auto info = boost::make_shared<sensor_msgs::CameraInfo>(to_camera_info(camera_));
    info->header = image->header;
    info_publisher_.publish(sensor_msgs::CameraInfoConstPtr(info));
    return image;
  }

  // Until it is in the map.
  [[nodiscard]] bool send(const sensor_msgs::ImageConstPtr& image) {
    image_publisher_.publish(image);
    return test::wait_until([&] { return map_ && map_->header.stamp == image->header.stamp; });
  }

  [[nodiscard]] const MapUpdate& map() const { return *map_; }

 private:
  void on_map(const MapUpdatePtr& map) { map_ = map; }

  void publish_pose(const Pose& world_from_body, const ros::Time& stamp) {
    geometry_msgs::TransformStamped transform = tf2::eigenToTransform(world_from_body);
    transform.header.stamp = stamp;
    transform.header.frame_id = setup_.onboard.frames.map;
    transform.child_frame_id = setup_.onboard.frames.body;
    broadcaster_.sendTransform(transform);
  }

  ros::NodeHandle nh_;
  FlightSetup setup_;
  CameraModel camera_;
  World world_;
  DepthRenderer renderer_;
  ros::Time first_stamp_;
  tf2_ros::TransformBroadcaster broadcaster_;
  ros::Publisher info_publisher_;
  ros::Publisher image_publisher_;
  ros::Subscriber map_subscriber_;
  MapUpdatePtr map_;
};

TEST(Allocations, AFrameTakesLessThanACopyOfItsImage) {
  const test::InProcess nodelets({"Mapper", "DepthCloud"});
  ASSERT_TRUE(nodelets.is_loaded());
  Driver driver;

  std::size_t bytes = 0;
  std::size_t most_bytes = 0;
  std::size_t allocations = 0;
  std::size_t changed_tiles = 0;
  for (int frame = 0; frame < kWarmUpFrames + kFrames; ++frame) {
    const sensor_msgs::ImageConstPtr image = driver.prepare(frame);
    ASSERT_EQ(image->data.size(), std::size_t{640} * 480 * 4);
    if (frame == kWarmUpFrames) {
      g_largest = 0;
    }
    const std::size_t bytes_before = g_bytes;
    const std::size_t allocations_before = g_allocations;

    ASSERT_TRUE(driver.send(image)) << "frame " << frame;

    if (frame >= kWarmUpFrames) {
      const std::size_t taken = g_bytes - bytes_before;
      bytes += taken;
      most_bytes = std::max(most_bytes, taken);
      allocations += g_allocations - allocations_before;
      changed_tiles += driver.map().map->changed_tiles.size();
    }
  }

  const double mean_bytes = static_cast<double>(bytes) / kFrames;
  std::printf("%.0f bytes per frame (at most %zu) in %.0f allocations, %.1f tiles changed\n",
              mean_bytes,
              most_bytes,
              static_cast<double>(allocations) / kFrames,
              static_cast<double>(changed_tiles) / kFrames);
  RecordProperty("bytes_per_frame", static_cast<int>(mean_bytes));
  RecordProperty("most_bytes_per_frame", static_cast<int>(most_bytes));
  RecordProperty("allocations_per_frame", static_cast<int>(allocations / kFrames));
  EXPECT_GT(changed_tiles, std::size_t{kFrames});
  EXPECT_LT(mean_bytes, kMostMeanBytes);
}

// A count that counts nothing would pass any limit.
TEST(Allocations, AreCounted) {
  const std::size_t before = g_bytes;

  const std::vector<char> memory(1000000);
  const auto cloud = std::make_shared<pcl::PointCloud<pcl::PointXYZ>>(640, 480);

  EXPECT_GE(g_bytes - before, memory.size() + cloud->size() * sizeof(pcl::PointXYZ));
}

}  // namespace
}  // namespace understory

int main(int argc, char** argv) {
  return understory::test::run_with_ros(argc, argv, "allocations");
}
