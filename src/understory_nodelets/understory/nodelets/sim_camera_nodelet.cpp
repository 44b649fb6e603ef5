// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// Stands in for a depth camera's driver: exposes at the odometry's stamps, so that tf2 knows the
// pose of every exposure exactly. In: odometry, and with a team peers: they are seen where they say
// they are. Out: camera/depth/image_rect (32FC1, metres, +inf
// beyond range), camera/depth/camera_info.
#include <memory>

#include <nav_msgs/Odometry.h>
#include <pluginlib/class_list_macros.hpp>
#include <sensor_msgs/Image.h>
#include <sensor_msgs/image_encodings.h>

#include "understory/nodelets/conversions.hpp"
#include "understory/nodelets/flight_setup.hpp"
#include "understory/nodelets/guarded_nodelet.hpp"
#include "understory/nodelets/peers_update.hpp"
#include "understory/nodelets/pool.hpp"
#include "understory/sim/depth_noise.hpp"
#include "understory/sim/depth_renderer.hpp"
#include "understory/sim/mission_record.hpp"
#include "understory/sim/teammates_in_view.hpp"

namespace understory {

class SimCameraNodelet : public GuardedNodelet {
 private:
  void start() override {
    ros::NodeHandle& nh = getNodeHandle();
    const FlightSetup setup = load_flight_setup(nh);
    const World world = World::of_vehicle(setup.config, setup.seed);
    camera_ = CameraModel(setup.config.explorer.camera);
    body_from_optical_ = body_from_optical(setup.config.explorer.camera);
    period_ = ros::Duration(1.0 / setup.config.explorer.camera.rate_hz);
    noise_ = setup.config.depth_noise;
    noise_rng_ = std::make_unique<Rng>(Rng(setup.seed).fork("depth noise"));
    renderer_ = std::make_unique<DepthRenderer>(world.truth->forest());
    info_ = to_camera_info(camera_);
    info_.header.frame_id = setup.onboard.frames.camera;
    image_publisher_ = nh.advertise<sensor_msgs::Image>("camera/depth/image_rect", 1);
    info_publisher_ = nh.advertise<sensor_msgs::CameraInfo>("camera/depth/camera_info", 1);
    vehicle_radius_m_ = setup.config.explorer.plan.vehicle_radius_m;
    if (setup.config.explorer.team.size > 1) {
      peers_subscriber_ = nh.subscribe("peers", 1, &SimCameraNodelet::on_peers, this);
    }
    odometry_subscriber_ = nh.subscribe(
        "odometry", 1, &SimCameraNodelet::on_odometry, this, ros::TransportHints().tcpNoDelay());
  }

  void on_peers(const PeersUpdatePtr& peers) { peers_ = peers; }

  void on_odometry(const nav_msgs::OdometryConstPtr& odometry) {
    const ros::Time stamp = odometry->header.stamp;
    if (stamp < next_exposure_) {
      return;
    }
    // Keeps the rate on average; after a stall it begins anew.
    next_exposure_ = stamp - next_exposure_ > period_ ? stamp + period_ : next_exposure_ + period_;
    guarded([&] { expose(*odometry); });
  }

  void expose(const nav_msgs::Odometry& odometry) {
    const std::optional<VehicleState> vehicle = to_vehicle_state(odometry);
    if (!vehicle) {
      skip("bad_odometry", "odometry that is not finite");
      return;
    }
    const std::int64_t begin_ns = steady_ns();
    Pose world_from_body = Pose::Identity();
    world_from_body.translation() = vehicle->position_m;
    world_from_body.linear() = vehicle->world_from_body.toRotationMatrix();
    const Pose world_from_optical = world_from_body * body_from_optical_;
    depth_ = renderer_->render(camera_, world_from_optical, std::move(depth_));
    const std::vector<Vector3d> mates_m = places_near(peers_,
                                                      to_time(odometry.header.stamp),
                                                      world_from_optical.translation(),
                                                      camera_.max_range_m + vehicle_radius_m_);
    depth_ =
        add_teammates(std::move(depth_), camera_, world_from_optical, mates_m, vehicle_radius_m_);
    depth_ = add_noise(std::move(depth_), noise_, *noise_rng_);
    const std::shared_ptr<sensor_msgs::Image> image = images_.take();
    fill(odometry.header.stamp, *image);
    auto info = boost::make_shared<sensor_msgs::CameraInfo>(info_);
    info->header.stamp = odometry.header.stamp;
    info_publisher_.publish(sensor_msgs::CameraInfoConstPtr(info));
    image_publisher_.publish(to_boost<sensor_msgs::Image>(image));
    trace("camera", odometry.header.stamp, begin_ns);
    count("frames");
  }

  void fill(const ros::Time& stamp, sensor_msgs::Image& image) const {
    const std::size_t bytes = depth_.z_m.size() * sizeof(float);
    image.header.stamp = stamp;
    image.header.frame_id = info_.header.frame_id;
    image.height = info_.height;
    image.width = info_.width;
    image.encoding = sensor_msgs::image_encodings::TYPE_32FC1;
    image.is_bigendian = 0;
    image.step = static_cast<std::uint32_t>(sizeof(float)) * info_.width;
    image.data.resize(bytes);
    std::memcpy(image.data.data(), depth_.z_m.data(), bytes);
  }

  CameraModel camera_;
  Pose body_from_optical_ = Pose::Identity();
  ros::Duration period_;
  ros::Time next_exposure_;
  DepthNoiseConfig noise_;
  std::unique_ptr<Rng> noise_rng_;
  std::unique_ptr<DepthRenderer> renderer_;
  double vehicle_radius_m_ = 0.0;
  PeersUpdatePtr peers_;  // newest
  DepthImage depth_;
  sensor_msgs::CameraInfo info_;
  Pool<sensor_msgs::Image> images_;
  ros::Publisher image_publisher_;
  ros::Publisher info_publisher_;
  ros::Subscriber odometry_subscriber_;
  ros::Subscriber peers_subscriber_;
};

}  // namespace understory

PLUGINLIB_EXPORT_CLASS(understory::SimCameraNodelet, nodelet::Nodelet)
