// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// For tests that look at nodelets from within: loads them into this process as onboard does, waits
// for what they publish with a deadline. One thread.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <nodelet/loader.h>
#include <ros/callback_queue.h>
#include <ros/ros.h>

namespace understory::test {

constexpr double kPatienceS = 30.0;

// Serves this process's subscribers until it is so; false if it does not become so.
inline bool wait_until(const std::function<bool()>& is_so, double patience_s = kPatienceS) {
  const ros::WallTime end = ros::WallTime::now() + ros::WallDuration(patience_s);
  while (!is_so()) {
    if (ros::WallTime::now() > end) {
      return false;
    }
    ros::getGlobalCallbackQueue()->callAvailable(ros::WallDuration(0.02));
  }
  return true;
}

class InProcess {
 public:
  // By their names in nodelets.xml, in this order.
  explicit InProcess(const std::vector<std::string>& types) : loader_(ros::NodeHandle("~")) {
    for (const std::string& type : types) {
      is_loaded_ = loader_.load(ros::names::resolve(type),
                                "understory_nodelets/" + type,
                                ros::names::getRemappings(),
                                {}) &&
                   is_loaded_;
    }
  }
  [[nodiscard]] bool is_loaded() const { return is_loaded_; }

 private:
  nodelet::Loader loader_;
  bool is_loaded_ = true;
};

// Holds on to what arrives, so that no address comes twice.
template <class Message>
class Witness {
 public:
  explicit Witness(const std::string& topic)
      : subscriber_(ros::NodeHandle().subscribe(topic, 100, &Witness::on_message, this)) {}

  std::vector<boost::shared_ptr<const Message>> seen;

 private:
  void on_message(const boost::shared_ptr<const Message>& message) { seen.push_back(message); }

  ros::Subscriber subscriber_;
};

inline int run_with_ros(int argc, char** argv, const char* node) {
  ros::init(argc, argv, node);
  ::testing::InitGoogleTest(&argc, argv);
  const ros::NodeHandle keeps_ros_up;
  ros::param::set("~num_worker_threads", 2);
  return RUN_ALL_TESTS();
}

}  // namespace understory::test
