// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// Clouds keep whole microseconds, drivers stamp nanoseconds. What belongs to one frame must be
// found together all the same.
#include <pcl_conversions/pcl_conversions.h>
#include <pcl_ros/point_cloud.h>
#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/Image.h>
#include <sensor_msgs/image_encodings.h>
#include <understory_msgs/Trace.h>

#include "in_process.hpp"
#include "understory/nodelets/conversions.hpp"
#include "understory/nodelets/depth_to_cloud.hpp"

namespace understory {
namespace {

using test::InProcess;
using test::wait_until;
using test::Witness;

class DepthCloudOfNanoseconds : public ::testing::Test {
 protected:
  void SetUp() override {
    ASSERT_TRUE(nodelets_.is_loaded());
    CameraConfig config;
    auto info = boost::make_shared<sensor_msgs::CameraInfo>(to_camera_info(CameraModel(config)));
    auto image = boost::make_shared<sensor_msgs::Image>();
    image->header.stamp = info->header.stamp = ros::Time(1700000000, 123456789);
    image->width = info->width;
    image->height = info->height;
    image->encoding = sensor_msgs::image_encodings::TYPE_32FC1;
    image->step = image->width * 4U;
    image->data.resize(std::size_t{image->step} * image->height);
    ros::NodeHandle nh;
    info_publisher_ = nh.advertise<sensor_msgs::CameraInfo>("camera/depth/camera_info", 1);
    image_publisher_ = nh.advertise<sensor_msgs::Image>("camera/depth/image_rect", 1);
    ASSERT_TRUE(wait_until([&] {
      return info_publisher_.getNumSubscribers() > 0 && image_publisher_.getNumSubscribers() > 0;
    }));

    info_publisher_.publish(sensor_msgs::CameraInfoConstPtr(info));
    // The nodelet may take the image before the camera_info: then another one follows.
    ASSERT_TRUE(wait_until([&] {
      image_publisher_.publish(sensor_msgs::ImageConstPtr(image));
      return !clouds_.seen.empty() && !infos_.seen.empty() && !traces_.seen.empty();
    }));
  }

  [[nodiscard]] ros::Time cloud_stamp() const {
    return pcl_conversions::fromPCL(clouds_.seen[0]->header.stamp);
  }
  [[nodiscard]] const sensor_msgs::CameraInfo& info() const { return *infos_.seen[0]; }
  [[nodiscard]] const understory_msgs::Trace& trace() const { return *traces_.seen[0]; }

 private:
  InProcess nodelets_{{"DepthCloud"}};
  Witness<Cloud> clouds_{"camera/depth/points"};
  Witness<sensor_msgs::CameraInfo> infos_{"camera/depth/points_info"};
  Witness<understory_msgs::Trace> traces_{"trace"};
  ros::Publisher info_publisher_;
  ros::Publisher image_publisher_;
};

TEST_F(DepthCloudOfNanoseconds, InfoHasTheStampOfItsCloud) {
  EXPECT_EQ(info().header.stamp, cloud_stamp());
}

TEST_F(DepthCloudOfNanoseconds, TracesOfAFrameHaveTheStampOfItsCloud) {
  EXPECT_EQ(trace().stage, "cloud");
  EXPECT_EQ(trace().header.stamp, cloud_stamp());
}

}  // namespace
}  // namespace understory

int main(int argc, char** argv) {
  return understory::test::run_with_ros(argc, argv, "stamps");
}
