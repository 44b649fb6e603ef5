// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// The map for others, off the flight path. In: map_updates. Out, while somebody listens:
// octomap_binary, octomap_full (octomap_msgs/Octomap) and occupied_points (sensor_msgs/PointCloud2,
// to look at). Services octomap_binary, octomap_full (octomap_msgs/GetOctomap) and save_map.
#include <memory>

#include <octomap_msgs/GetOctomap.h>
#include <octomap_msgs/Octomap.h>
#include <pcl_conversions/pcl_conversions.h>
#include <pcl_ros/point_cloud.h>
#include <pluginlib/class_list_macros.hpp>
#include <understory_msgs/SaveMap.h>

#include "understory/map/octomap_io.hpp"
#include "understory/nodelets/conversions.hpp"
#include "understory/nodelets/depth_to_cloud.hpp"
#include "understory/nodelets/flight_setup.hpp"
#include "understory/nodelets/guarded_nodelet.hpp"
#include "understory/nodelets/map_update.hpp"
#include "understory/nodelets/pool.hpp"

namespace understory {
namespace {

void add_occupied(const MapSnapshot& map, TileSlot slot, Cloud& cloud) {
  const VoxelBox voxels = map.geometry.voxels_of_slot(slot);
  for (int z = voxels.min.z(); z < voxels.end.z(); ++z) {
    for (int y = voxels.min.y(); y < voxels.end.y(); ++y) {
      for (int x = voxels.min.x(); x < voxels.end.x(); ++x) {
        if (map.state({x, y, z}) == VoxelState::kOccupied) {
          const Eigen::Vector3f center = map.geometry.center_of({x, y, z}).cast<float>();
          cloud.push_back(pcl::PointXYZ(center.x(), center.y(), center.z()));
        }
      }
    }
  }
}

boost::shared_ptr<const Cloud> occupied_points(const MapSnapshot& map,
                                               const std_msgs::Header& header) {
  auto cloud = std::make_shared<Cloud>();
  pcl_conversions::toPCL(header, cloud->header);
  for (TileSlot slot = 0; slot < map.tiles.size(); ++slot) {
    if (map.tiles[slot]) {
      add_occupied(map, slot, *cloud);
    }
  }
  return to_boost<Cloud>(cloud);
}

octomap_msgs::Octomap to_octomap(const MapSnapshot& map,
                                 const std_msgs::Header& header,
                                 bool is_binary) {
  const std::string tree = octomap_tree(map, is_binary);
  octomap_msgs::Octomap msg;
  msg.header = header;
  msg.binary = static_cast<std::uint8_t>(is_binary);
  msg.id = "OcTree";
  msg.resolution = map.geometry.resolution_m();
  msg.data.assign(tree.begin(), tree.end());
  return msg;
}

}  // namespace

class MapPublisherNodelet : public GuardedNodelet {
 private:
  void start() override {
    ros::NodeHandle& nh = getNodeHandle();
    const FlightSetup setup = load_flight_setup(nh);
    receiver_ =
        std::make_unique<MapReceiver>(setup.config.explorer.map, setup.config.scene.box.box_m());
    binary_publisher_ = nh.advertise<octomap_msgs::Octomap>("octomap_binary", 1);
    full_publisher_ = nh.advertise<octomap_msgs::Octomap>("octomap_full", 1);
    points_publisher_ = nh.advertise<Cloud>("occupied_points", 1);
    save_service_ = nh.advertiseService("save_map", &MapPublisherNodelet::save, this);
    binary_service_ = nh.advertiseService("octomap_binary", &MapPublisherNodelet::get_binary, this);
    full_service_ = nh.advertiseService("octomap_full", &MapPublisherNodelet::get_full, this);
    map_subscriber_ = nh.subscribe("map_updates", 1, &MapPublisherNodelet::on_map, this);
    timer_ =
        nh.createWallTimer(ros::WallDuration(setup.onboard.publish.octomap_s),
                           [this](const ros::WallTimerEvent&) { guarded([this] { publish(); }); });
  }

  void on_map(const MapUpdatePtr& update) {
    guarded([&] {
      if (const MapSnapshotPtr map = receiver_->accept(*update)) {
        map_ = map;
        header_ = update->header;
      }
    });
  }

  void publish() {
    if (!map_ || map_->revision == published_revision_) {
      return;
    }
    published_revision_ = map_->revision;
    if (binary_publisher_.getNumSubscribers() > 0) {
      binary_publisher_.publish(
          boost::make_shared<const octomap_msgs::Octomap>(to_octomap(*map_, header_, true)));
    }
    if (full_publisher_.getNumSubscribers() > 0) {
      full_publisher_.publish(
          boost::make_shared<const octomap_msgs::Octomap>(to_octomap(*map_, header_, false)));
    }
    if (points_publisher_.getNumSubscribers() > 0) {
      points_publisher_.publish(occupied_points(*map_, header_));
    }
  }

  bool save(understory_msgs::SaveMap::Request& request,
            understory_msgs::SaveMap::Response& response) {
    try {
      if (!map_) {
        throw MapFileError(request.path + ": there is no map yet");
      }
      save_octomap(*map_, request.path);
      response.success = 1;
      response.message = request.path;
    } catch (const std::exception& error) {
      response.success = 0;
      response.message = error.what();
    }
    return true;
  }

  bool get_binary(octomap_msgs::GetOctomap::Request& /*request*/,
                  octomap_msgs::GetOctomap::Response& response) {
    return get(true, response);
  }
  bool get_full(octomap_msgs::GetOctomap::Request& /*request*/,
                octomap_msgs::GetOctomap::Response& response) {
    return get(false, response);
  }
  bool get(bool is_binary, octomap_msgs::GetOctomap::Response& response) {
    if (!map_) {
      return false;
    }
    guarded([&] { response.map = to_octomap(*map_, header_, is_binary); });
    return !response.map.data.empty();
  }

  std::unique_ptr<MapReceiver> receiver_;
  MapSnapshotPtr map_;
  std_msgs::Header header_;
  std::uint64_t published_revision_ = 0;
  ros::Publisher binary_publisher_;
  ros::Publisher full_publisher_;
  ros::Publisher points_publisher_;
  ros::ServiceServer save_service_;
  ros::ServiceServer binary_service_;
  ros::ServiceServer full_service_;
  ros::Subscriber map_subscriber_;
  ros::WallTimer timer_;
};

}  // namespace understory

PLUGINLIB_EXPORT_CLASS(understory::MapPublisherNodelet, nodelet::Nodelet)
