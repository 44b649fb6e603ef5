// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// The bridge's side in ROS. The flight thread itself is FlightLoop; here trajectories go in, and on
// a thread of its own telemetry comes out. In: trajectory, status (landing). Out: odometry, tf2
// map -> body, flight_status, flight_timing, flown_path. Services arm, disarm (in flight: land
// here) and kill (motors off, wherever it is). When unloaded it first lets the vehicle come to
// rest.
#include <atomic>
#include <memory>
#include <thread>

#include <nav_msgs/Path.h>
#include <pluginlib/class_list_macros.hpp>
#include <std_srvs/Trigger.h>
#include <sys/mman.h>
#include <tf2_ros/transform_broadcaster.h>
#include <understory_msgs/FlightStatus.h>
#include <understory_msgs/FlightTiming.h>

#include "understory/bridge/flight_loop.hpp"
#include "understory/nodelets/autopilot_setup.hpp"
#include "understory/nodelets/conversions.hpp"
#include "understory/nodelets/flight_setup.hpp"
#include "understory/nodelets/guarded_nodelet.hpp"
#include "understory/nodelets/trajectory_update.hpp"

namespace understory {
namespace {

constexpr std::chrono::milliseconds kTickPatience(200);
constexpr std::chrono::milliseconds kSettlePatience(10000);
constexpr double kStatusPeriodS = 0.1;
constexpr double kTimingPeriodS = 0.5;
constexpr double kPathPeriodS = 0.2;
constexpr std::size_t kMostPathPoses = 20000;

}  // namespace

class BridgeNodelet : public GuardedNodelet {
 public:
  BridgeNodelet() = default;
  BridgeNodelet(const BridgeNodelet&) = delete;
  BridgeNodelet& operator=(const BridgeNodelet&) = delete;
  ~BridgeNodelet() override {
    if (flight_) {
      flight_->settle(kSettlePatience);
    }
    is_stopping_ = true;
    if (telemetry_thread_.joinable()) {
      telemetry_thread_.join();
    }
  }

 private:
  void start() override {
    ros::NodeHandle& nh = getNodeHandle();
    if (ros::Time::isSimTime()) {
      throw ConfigError("use_sim_time: the bridge flies by the real clock");
    }
    const FlightSetup setup = load_flight_setup(nh);
    frames_ = setup.onboard.frames;
    is_auto_armed_ = setup.onboard.bus.auto_arm;
    path_.header.frame_id = frames_.map;
    odometry_publisher_ = nh.advertise<nav_msgs::Odometry>("odometry", 100);
    status_publisher_ = nh.advertise<understory_msgs::FlightStatus>("flight_status", 10);
    timing_publisher_ = nh.advertise<understory_msgs::FlightTiming>("flight_timing", 10);
    path_publisher_ = nh.advertise<nav_msgs::Path>("flown_path", 1);
    // Pages are locked as they are touched, not ahead: thread stacks would take hundreds of MB.
    is_locked_ = mlockall(MCL_CURRENT | MCL_FUTURE | MCL_ONFAULT) == 0;
    flight_ = std::make_unique<FlightLoop>(
        setup.onboard.flight, setup.config.scene.box.box_m(), make_autopilot(setup));
    advertise_service("arm", &FlightLoop::arm);
    advertise_service("disarm", &FlightLoop::disarm);
    advertise_service("kill", &FlightLoop::kill);
    telemetry_thread_ = std::thread([this] { publish_telemetry(); });
    const ros::TransportHints hints = ros::TransportHints().tcpNoDelay();
    trajectory_subscriber_ =
        nh.subscribe("trajectory", 10, &BridgeNodelet::on_trajectory, this, hints);
    mission_subscriber_ = nh.subscribe("status", 10, &BridgeNodelet::on_mission, this, hints);
  }

  // What becomes of it, flight_status tells.
  void advertise_service(const char* name, void (FlightLoop::*wish)()) {
    const boost::function<bool(std_srvs::Trigger::Request&, std_srvs::Trigger::Response&)> serve =
        [this, wish](std_srvs::Trigger::Request&, std_srvs::Trigger::Response& response) {
          (*flight_.*wish)();
          is_auto_armed_ = false;  // from then on only who asks
          response.success = 1;
          response.message = "asked for; see flight_status";
          return true;
        };
    services_.push_back(getNodeHandle().advertiseService(name, serve));
  }

  void on_trajectory(const TrajectoryUpdatePtr& update) {
    guarded([&] {
      if (!update->trajectory) {
        skip("trajectories_refused", "trajectory that makes no sense");
        return;
      }
      published_ns_ = steady_ns();
      flight_->offer(update->trajectory, wall_time());
      count("trajectories");
    });
  }

  void on_mission(const understory_msgs::MissionStatusConstPtr& status) {
    guarded([&] {
      if (status->state == understory_msgs::MissionStatus::LAND) {
        flight_->disarm();
      }
    });
  }

  void publish_telemetry() {
    while (!is_stopping_) {
      if (const std::optional<FlightTick> tick = flight_->wait_for_tick(kTickPatience)) {
        publish(*tick);
      }
    }
  }

  // For one flight: what has landed or was lost is armed again only by who asks for it.
  void arm_if_ready(const FlightTick& tick) {
    if (tick.telemetry.is_following) {
      is_auto_armed_ = false;
    } else if (is_auto_armed_ && tick.telemetry.link.host == can::HostState::kReady) {
      flight_->arm();
    }
  }

  // The way over the bus of the first setpoint that was sent in knowledge of a trajectory.
  void trace_bus(const FlightTick& tick) {
    const LinkStatus& link = tick.telemetry.link;
    if (is_answer_awaited_ && link.acked_set == awaited_set_) {
      is_answer_awaited_ = false;
      const std::int64_t offset_us =
          tick.sent_ns / 1000 - tick.sent_wall.time_since_epoch().count();
      const auto to_steady_ns = [&](Time time) {
        return (time.time_since_epoch().count() + offset_us) * 1000;
      };
      trace("transmit", awaited_exposure_, awaited_since_ns_, to_steady_ns(link.acked_sent));
      trace("acknowledge",
            awaited_exposure_,
            to_steady_ns(link.acked_sent),
            to_steady_ns(link.acked_received));
    }
    if (tick.is_first_of_trajectory && tick.depth_stamp != Time{}) {
      trace("setpoint", to_ros(tick.depth_stamp), published_ns_, tick.sent_ns);
    }
    if (tick.is_first_with_plan && tick.plan_depth_stamp != Time{}) {
      is_answer_awaited_ = true;
      awaited_set_ = link.sets_sent;
      awaited_exposure_ = to_ros(tick.plan_depth_stamp);
      awaited_since_ns_ = published_ns_;
    }
  }

  void publish(const FlightTick& tick) {
    gate_violations_ = tick.gate_violations;
    problem_ = tick.telemetry.link.problem;
    is_astray_ = tick.is_astray;
    arm_if_ready(tick);
    timing_.due_ns.push_back(static_cast<std::uint64_t>(tick.due_ns));
    timing_.woken_ns.push_back(static_cast<std::uint64_t>(tick.woken_ns));
    trace_bus(tick);
    publish_slowly(tick, to_ros(tick.sent_wall));
    if (!tick.telemetry.is_valid || tick.telemetry.time <= telemetry_time_) {
      return;  // nothing newer: tf2 takes a stamp once
    }
    telemetry_time_ = tick.telemetry.time;
    auto odometry = boost::make_shared<nav_msgs::Odometry>(
        to_odometry(tick.telemetry, frames_.map, frames_.body));
    geometry_msgs::TransformStamped transform;
    transform.header = odometry->header;
    transform.child_frame_id = frames_.body;
    transform.transform.translation.x = odometry->pose.pose.position.x;
    transform.transform.translation.y = odometry->pose.pose.position.y;
    transform.transform.translation.z = odometry->pose.pose.position.z;
    transform.transform.rotation = odometry->pose.pose.orientation;
    broadcaster_.sendTransform(transform);
    odometry_publisher_.publish(nav_msgs::OdometryConstPtr(odometry));
    publish_path(*odometry);
  }

  // Also while nothing is heard of the vehicle.
  void publish_slowly(const FlightTick& tick, const ros::Time& now) {
    if ((now - last_status_).toSec() >= kStatusPeriodS) {
      last_status_ = now;
      status_publisher_.publish(
          boost::make_shared<const understory_msgs::FlightStatus>(flight_status(tick, now)));
    }
    if ((now - last_timing_).toSec() >= kTimingPeriodS) {
      last_timing_ = now;
      timing_.header.stamp = now;
      timing_publisher_.publish(
          boost::make_shared<const understory_msgs::FlightTiming>(std::move(timing_)));
      timing_ = understory_msgs::FlightTiming();
    }
  }

  void publish_path(const nav_msgs::Odometry& odometry) {
    const ros::Time now = odometry.header.stamp;
    if ((now - last_path_).toSec() >= kPathPeriodS && path_.poses.size() < kMostPathPoses) {
      last_path_ = now;
      geometry_msgs::PoseStamped pose;
      pose.header = odometry.header;
      pose.pose = odometry.pose.pose;
      path_.poses.push_back(pose);
      path_.header.stamp = now;
      if (path_publisher_.getNumSubscribers() > 0) {
        path_publisher_.publish(boost::make_shared<const nav_msgs::Path>(path_));
      }
    }
  }

  [[nodiscard]] understory_msgs::FlightStatus flight_status(const FlightTick& tick,
                                                            const ros::Time& now) const {
    understory_msgs::FlightStatus status = to_msg(tick);
    status.header.stamp = now;
    status.real_time = static_cast<std::uint8_t>(flight_->is_real_time());
    status.lost_ticks = flight_->lost_ticks();
    return status;
  }

  [[nodiscard]] Health health() override {
    if (gate_violations_ > 0) {
      return {diagnostic_msgs::DiagnosticStatus::ERROR,
              "the gate refused " + std::to_string(gate_violations_) + " setpoints and held"};
    }
    if (is_astray_) {
      return {diagnostic_msgs::DiagnosticStatus::ERROR, "the vehicle is not where its path is"};
    }
    const can::LinkProblem problem = problem_;
    if (problem != can::LinkProblem::kNone) {
      return {diagnostic_msgs::DiagnosticStatus::ERROR, can::to_string(problem)};
    }
    if (!flight_->is_real_time() || !is_locked_) {
      return {diagnostic_msgs::DiagnosticStatus::WARN,
              "flight thread without real-time priority or locked memory"};
    }
    return {};
  }

  FramesConfig frames_;
  bool is_locked_ = false;
  std::unique_ptr<FlightLoop> flight_;
  std::thread telemetry_thread_;
  std::atomic<bool> is_stopping_{false};
  std::atomic<std::int64_t> published_ns_{0};
  std::atomic<std::uint64_t> gate_violations_{0};
  std::atomic<can::LinkProblem> problem_{can::LinkProblem::kNone};
  std::atomic<bool> is_astray_{false};
  std::atomic<bool> is_auto_armed_{false};  // still to be done
  // Of the telemetry thread.
  tf2_ros::TransformBroadcaster broadcaster_;
  understory_msgs::FlightTiming timing_;
  nav_msgs::Path path_;
  Time telemetry_time_{};
  bool is_answer_awaited_ = false;
  std::uint64_t awaited_set_ = 0;
  ros::Time awaited_exposure_;
  std::int64_t awaited_since_ns_ = 0;
  ros::Time last_status_;
  ros::Time last_timing_;
  ros::Time last_path_;
  ros::Publisher odometry_publisher_;
  ros::Publisher status_publisher_;
  ros::Publisher timing_publisher_;
  ros::Publisher path_publisher_;
  ros::Subscriber trajectory_subscriber_;
  ros::Subscriber mission_subscriber_;
  std::vector<ros::ServiceServer> services_;
};

}  // namespace understory

PLUGINLIB_EXPORT_CLASS(understory::BridgeNodelet, nodelet::Nodelet)
