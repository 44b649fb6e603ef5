// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// In: camera/depth/image_rect and camera/depth/camera_info of any driver (remap them). Out:
// camera/depth/points (organised, optical frame, stamp of the image) and, of that cloud,
// camera/depth/points_info. Publishes body -> camera from the configuration, unless told not to.
#include <memory>

#include <pcl_conversions/pcl_conversions.h>
#include <pcl_ros/point_cloud.h>
#include <pluginlib/class_list_macros.hpp>
#include <tf2_eigen/tf2_eigen.h>
#include <tf2_ros/static_transform_broadcaster.h>

#include "understory/nodelets/conversions.hpp"
#include "understory/nodelets/depth_to_cloud.hpp"
#include "understory/nodelets/flight_setup.hpp"
#include "understory/nodelets/guarded_nodelet.hpp"
#include "understory/nodelets/pool.hpp"

namespace understory {

class DepthCloudNodelet : public GuardedNodelet {
 private:
  void start() override {
    ros::NodeHandle& nh = getNodeHandle();
    const FlightSetup setup = load_flight_setup(nh);
    config_ = setup.onboard.cloud;
    max_range_m_ = setup.config.explorer.camera.max_range_m;
    if (setup.onboard.frames.publish_extrinsics) {
      publish_extrinsics(setup);
    }
    cloud_publisher_ = nh.advertise<Cloud>("camera/depth/points", 1);
    info_publisher_ = nh.advertise<sensor_msgs::CameraInfo>("camera/depth/points_info", 1);
    info_subscriber_ =
        nh.subscribe("camera/depth/camera_info", 1, &DepthCloudNodelet::on_info, this);
    image_subscriber_ = nh.subscribe("camera/depth/image_rect",
                                     1,
                                     &DepthCloudNodelet::on_image,
                                     this,
                                     ros::TransportHints().tcpNoDelay());
  }

  void publish_extrinsics(const FlightSetup& setup) {
    geometry_msgs::TransformStamped mount =
        tf2::eigenToTransform(body_from_optical(setup.config.explorer.camera));
    mount.header.stamp = ros::Time::now();
    mount.header.frame_id = setup.onboard.frames.body;
    mount.child_frame_id = setup.onboard.frames.camera;
    broadcaster_.sendTransform(mount);
  }

  void on_info(const sensor_msgs::CameraInfoConstPtr& info) {
    guarded([&] {
      camera_ = to_camera_model(*info, max_range_m_);
      if (!camera_) {
        skip("bad_camera_info", "camera_info is of no calibrated pinhole camera");
      }
    });
  }

  void on_image(const sensor_msgs::ImageConstPtr& image) {
    guarded([&] { convert(*image); });
  }

  void convert(const sensor_msgs::Image& image) {
    const std::int64_t begin_ns = steady_ns();
    if (!camera_) {
      skip("images_without_camera_info", "image without camera_info");
      return;
    }
    if (image.header.stamp <= last_stamp_) {
      skip("images_not_newer", "image no newer than the one before");
      return;
    }
    const std::shared_ptr<Cloud> cloud = clouds_.take();
    const Result<std::size_t, ImageError> measured = fill_cloud(image, *camera_, config_, *cloud);
    if (!measured) {
      skip("bad_images", to_string(measured.error()));
      return;
    }
    last_stamp_ = image.header.stamp;
    pcl_conversions::toPCL(image.header, cloud->header);
    auto info = boost::make_shared<sensor_msgs::CameraInfo>(
        to_camera_info(decimated(*camera_, config_.decimation)));
    info->header = pcl_conversions::fromPCL(cloud->header);  // the same stamp, in microseconds
    info_publisher_.publish(sensor_msgs::CameraInfoConstPtr(info));
    cloud_publisher_.publish(to_boost<Cloud>(cloud));
    trace("cloud", image.header.stamp, begin_ns);
    count("clouds");
    count("measured_points", *measured);
  }

  CloudConfig config_;
  double max_range_m_ = 0.0;
  std::optional<CameraModel> camera_;
  ros::Time last_stamp_;
  Pool<Cloud> clouds_;
  tf2_ros::StaticTransformBroadcaster broadcaster_;
  ros::Publisher cloud_publisher_;
  ros::Publisher info_publisher_;
  ros::Subscriber info_subscriber_;
  ros::Subscriber image_subscriber_;
};

}  // namespace understory

PLUGINLIB_EXPORT_CLASS(understory::DepthCloudNodelet, nodelet::Nodelet)
