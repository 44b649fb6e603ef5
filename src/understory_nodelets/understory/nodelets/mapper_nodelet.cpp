// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// In: camera/depth/points with points_info (organised) and lidar/points (any cloud), each with its
// pose from tf2 at its own stamp. Out: map_updates. A cloud whose pose is not known in time is
// skipped and counted. The first pose is where the vehicle starts: the launch site is free. With a
// team, what is measured on team mates (peers) is not mapped.
#include <algorithm>
#include <memory>

#include <pcl/filters/voxel_grid.h>
#include <pcl_conversions/pcl_conversions.h>
#include <pcl_ros/point_cloud.h>
#include <pluginlib/class_list_macros.hpp>
#include <tf2_eigen/tf2_eigen.h>
#include <tf2_ros/transform_listener.h>

#include "understory/map/octomap_io.hpp"
#include "understory/mission.hpp"
#include "understory/nodelets/conversions.hpp"
#include "understory/nodelets/depth_to_cloud.hpp"
#include "understory/nodelets/flight_setup.hpp"
#include "understory/nodelets/guarded_nodelet.hpp"
#include "understory/nodelets/lidar_points.hpp"
#include "understory/nodelets/map_update.hpp"
#include "understory/nodelets/peers_update.hpp"
#include "understory/team/teammate_mask.hpp"

namespace understory {
namespace {

Mapper make_mapper(const FlightSetup& setup) {
  const Box3d box_m = setup.config.scene.box.box_m();
  return setup.resume_file.empty()
             ? Mapper(setup.config.explorer.map, box_m)
             : Mapper(load_octomap(setup.resume_file, setup.config.explorer.map, box_m));
}

// The points are shared with others and stay as they are.
DepthImage depth_of(const Cloud& cloud, DepthImage image) {
  image.width_px = static_cast<int>(cloud.width);
  image.height_px = static_cast<int>(cloud.height);
  image.z_m.resize(cloud.size());
  std::transform(cloud.begin(), cloud.end(), image.z_m.begin(), [](const pcl::PointXYZ& point) {
    return point.z;
  });
  return image;
}

}  // namespace

class MapperNodelet : public GuardedNodelet {
 private:
  void start() override {
    ros::NodeHandle& nh = getNodeHandle();
    const FlightSetup setup = load_flight_setup(nh);
    mission_ = setup.config.mission;
    onboard_ = setup.onboard;
    max_range_m_ = setup.config.explorer.camera.max_range_m;
    mapper_ = std::make_unique<Mapper>(make_mapper(setup));
    listener_ = std::make_unique<tf2_ros::TransformListener>(transforms_);
    publisher_ = nh.advertise<MapUpdate>("map_updates", 1);
    const ros::TransportHints hints = ros::TransportHints().tcpNoDelay();
    info_subscriber_ = nh.subscribe("camera/depth/points_info", 1, &MapperNodelet::on_info, this);
    cloud_subscriber_ =
        nh.subscribe("camera/depth/points", 1, &MapperNodelet::on_cloud, this, hints);
    mask_radius_m_ = setup.config.explorer.team.separation.mask_radius_m;
    if (setup.config.explorer.team.size > 1) {
      peers_subscriber_ = nh.subscribe("peers", 1, &MapperNodelet::on_peers, this, hints);
    }
    lidar_subscriber_ = nh.subscribe("lidar/points", 1, &MapperNodelet::on_lidar, this, hints);
  }

  void on_peers(const PeersUpdatePtr& peers) { peers_ = peers; }

  void on_info(const sensor_msgs::CameraInfoConstPtr& info) {
    guarded([&] { camera_ = to_camera_model(*info, max_range_m_); });
  }

  void on_cloud(const boost::shared_ptr<const Cloud>& cloud) {
    guarded([&] { integrate(*cloud); });
  }

  void on_lidar(const sensor_msgs::PointCloud2ConstPtr& message) {
    guarded([&] { integrate_lidar(*message); });
  }

  // The pose of a sensor in the map at a stamp; nothing if tf2 does not know it in time.
  std::optional<Pose> pose_of(const std::string& frame, const ros::Time& stamp) {
    try {
      return Pose(tf2::transformToEigen(transforms_.lookupTransform(
          onboard_.frames.map, frame, stamp, ros::Duration(onboard_.frames.wait_s))));
    } catch (const tf2::TransformException& error) {
      skip("frames_without_pose", error.what());
      return std::nullopt;
    }
  }

  bool mark_launch_site(const ros::Time& stamp) {
    if (!has_launch_site_) {
      const std::optional<Pose> body = pose_of(onboard_.frames.body, stamp);
      if (!body) {
        return false;
      }
      mapper_->mark_free(launch_site_m(mission_, body->translation()), to_time(stamp));
      has_launch_site_ = true;
    }
    return true;
  }

  void integrate(const Cloud& cloud) {
    const std::int64_t begin_ns = steady_ns();
    const ros::Time stamp = pcl_conversions::fromPCL(cloud.header.stamp);
    if (!camera_) {
      skip("clouds_without_camera_info", "cloud without camera_info");
      return;
    }
    const std::optional<Pose> pose = pose_of(cloud.header.frame_id, stamp);
    if (!pose || !mark_launch_site(stamp)) {
      return;
    }
    publish(
        mapper_->integrate(*camera_, view_of(cloud, *pose, to_time(stamp)), *pose, to_time(stamp)),
        stamp,
        begin_ns);
  }

  // The depths as they are, or a copy without team mates where some may be in view.
  DepthView view_of(const Cloud& cloud, const Pose& pose, Time time) {
    const std::vector<Vector3d> mates_m =
        places_near(peers_, time, pose.translation(), camera_->max_range_m + mask_radius_m_);
    const bool fits = static_cast<int>(cloud.width) == camera_->width_px &&
                      static_cast<int>(cloud.height) == camera_->height_px;
    if (!mates_m.empty() && fits) {
      masked_ = team::mask_teammates(
          depth_of(cloud, std::move(masked_)), *camera_, pose, mates_m, mask_radius_m_);
      count("frames_masked");
      return masked_.view();
    }
    constexpr std::size_t kFloatsPerPoint = sizeof(pcl::PointXYZ) / sizeof(float);
    return {cloud.empty() ? nullptr : &cloud.points.front().z,
            kFloatsPerPoint,
            static_cast<int>(cloud.width),
            static_cast<int>(cloud.height)};
  }

  // Of the sensor's own copy.
  void drop_teammates(const Pose& pose, Time time, Cloud& points) const {
    const std::vector<Vector3d> mates_m = places_near(
        peers_, time, pose.translation(), onboard_.cloud.lidar_range_m + mask_radius_m_);
    const auto is_mate = [&](const pcl::PointXYZ& point) {
      const Vector3d at_m = pose * point.getVector3fMap().cast<double>();
      return std::any_of(mates_m.begin(), mates_m.end(), [&](const Vector3d& mate_m) {
        return (at_m - mate_m).norm() <= mask_radius_m_;
      });
    };
    if (!mates_m.empty()) {
      points.erase(std::remove_if(points.begin(), points.end(), is_mate), points.end());
    }
  }

  void integrate_lidar(const sensor_msgs::PointCloud2& message) {
    const std::int64_t begin_ns = steady_ns();
    const ros::Time stamp = to_ros(to_time(message.header.stamp));
    Result<Cloud::Ptr, LidarError> read = lidar_points(message);
    if (!read) {
      skip("bad_clouds", to_string(read.error()));
      return;
    }
    const std::optional<Pose> pose = pose_of(message.header.frame_id, stamp);
    if (!pose || !mark_launch_site(stamp)) {
      return;
    }
    Cloud::Ptr points = std::move(read).value();
    if (onboard_.cloud.lidar_leaf_m > 0.0) {
      const auto leaf = static_cast<float>(onboard_.cloud.lidar_leaf_m);
      auto thinned = std::make_shared<Cloud>();
      pcl::VoxelGrid<pcl::PointXYZ> grid;
      grid.setInputCloud(points);
      grid.setLeafSize(leaf, leaf, leaf);
      grid.filter(*thinned);
      points = std::move(thinned);
    }
    drop_teammates(*pose, to_time(stamp), *points);
    const PointsView view{points->empty() ? nullptr : points->points.front().data,
                          sizeof(pcl::PointXYZ) / sizeof(float),
                          points->size()};
    publish(mapper_->integrate_rays(view, *pose, onboard_.cloud.lidar_range_m, to_time(stamp)),
            stamp,
            begin_ns);
  }

  void publish(const Result<IntegrateCounts, IntegrateError>& done,
               const ros::Time& stamp,
               std::int64_t begin_ns) {
    if (!done) {
      skip("bad_frames", to_string(done.error()));
      return;
    }
    auto update = boost::make_shared<MapUpdate>();
    update->header.stamp = stamp;
    update->header.frame_id = onboard_.frames.map;
    update->map = mapper_->publish();
    const auto every = static_cast<std::uint64_t>(onboard_.publish.whole_map_every);
    update->is_whole = update->map->revision == 1 || update->map->revision % every == 0;
    publisher_.publish(MapUpdatePtr(update));
    trace("map", stamp, begin_ns);
    count("updates");
    count("skipped_points", done->skipped_points);
  }

  MissionConfig mission_;
  OnboardConfig onboard_;
  double max_range_m_ = 0.0;
  std::unique_ptr<Mapper> mapper_;
  bool has_launch_site_ = false;
  std::optional<CameraModel> camera_;
  double mask_radius_m_ = 0.0;
  PeersUpdatePtr peers_;  // newest
  DepthImage masked_;     // its memory is used again
  tf2_ros::Buffer transforms_;
  std::unique_ptr<tf2_ros::TransformListener> listener_;  // with a thread of its own
  ros::Publisher publisher_;
  ros::Subscriber info_subscriber_;
  ros::Subscriber cloud_subscriber_;
  ros::Subscriber lidar_subscriber_;
  ros::Subscriber peers_subscriber_;
};

}  // namespace understory

PLUGINLIB_EXPORT_CLASS(understory::MapperNodelet, nodelet::Nodelet)
