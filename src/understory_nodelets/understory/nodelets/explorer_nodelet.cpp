// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// The mission. In: map_updates, odometry (where the vehicle starts), command, flight_status, and
// with a team peers (its map_updates are then remapped to team_map_updates). Out: trajectory,
// status, and to look at: markers, planned_path. Services start, pause, return_home, land, stop. A
// stage that fails, or no map for too long, ends the mission with the vehicle at rest.
#include <memory>

#include <nav_msgs/Path.h>
#include <pluginlib/class_list_macros.hpp>
#include <std_srvs/Trigger.h>
#include <understory_msgs/FlightStatus.h>
#include <understory_msgs/MissionCommand.h>

#include "understory/nodelets/conversions.hpp"
#include "understory/nodelets/flight_setup.hpp"
#include "understory/nodelets/guarded_nodelet.hpp"
#include "understory/nodelets/map_update.hpp"
#include "understory/nodelets/markers.hpp"
#include "understory/nodelets/peers_update.hpp"
#include "understory/nodelets/trajectory_update.hpp"

namespace understory {

class ExplorerNodelet : public GuardedNodelet {
 private:
  using Command = understory_msgs::MissionCommand;

  void start() override {
    ros::NodeHandle& nh = getNodeHandle();
    setup_ = load_flight_setup(nh);
    receiver_ =
        std::make_unique<MapReceiver>(setup_.config.explorer.map, setup_.config.scene.box.box_m());
    trajectory_publisher_ = nh.advertise<TrajectoryUpdate>("trajectory", 10);
    status_publisher_ = nh.advertise<understory_msgs::MissionStatus>("status", 10);
    markers_publisher_ = nh.advertise<visualization_msgs::MarkerArray>("markers", 1);
    path_publisher_ = nh.advertise<nav_msgs::Path>("planned_path", 1);
    const ros::TransportHints hints = ros::TransportHints().tcpNoDelay();
    odometry_subscriber_ = nh.subscribe("odometry", 1, &ExplorerNodelet::on_odometry, this, hints);
    map_subscriber_ = nh.subscribe("map_updates", 1, &ExplorerNodelet::on_map, this, hints);
    if (setup_.config.explorer.team.size > 1) {
      peers_subscriber_ = nh.subscribe("peers", 1, &ExplorerNodelet::on_peers, this, hints);
    }
    flight_subscriber_ = nh.subscribe("flight_status", 1, &ExplorerNodelet::on_flight, this);
    command_subscriber_ = nh.subscribe("command", 10, &ExplorerNodelet::on_command, this);
    advertise_service("start", Command::START);
    advertise_service("pause", Command::PAUSE);
    advertise_service("return_home", Command::RETURN_HOME);
    advertise_service("land", Command::LAND);
    advertise_service("stop", Command::STOP);
    watch_ = nh.createWallTimer(ros::WallDuration(0.25),
                                [this](const ros::WallTimerEvent&) { watch(); });
  }

  void advertise_service(const char* name, std::uint8_t command) {
    const boost::function<bool(std_srvs::Trigger::Request&, std_srvs::Trigger::Response&)> serve =
        [this, command](std_srvs::Trigger::Request&, std_srvs::Trigger::Response& response) {
          guarded([&] { response.success = static_cast<std::uint8_t>(obey(command)); });
          response.message = mission_ ? to_string(mission_->state()) : "no map yet";
          if (command == Command::START && response.success == 0 && !is_armed()) {
            response.message = "not armed: " + flight_.vehicle_state + " " + flight_.vehicle_reason;
          }
          return true;
        };
    services_.push_back(getNodeHandle().advertiseService(name, serve));
  }

  void on_odometry(const nav_msgs::OdometryConstPtr& odometry) {
    guarded([&] {
      if (const std::optional<VehicleState> state = to_vehicle_state(*odometry)) {
        start_state_ = state;
        odometry_subscriber_.shutdown();  // what is planned begins on what is flown
      } else {
        skip("bad_odometry", "odometry that is not finite");
      }
    });
  }

  void on_map(const MapUpdatePtr& update) {
    guarded([&] { decide(*update); });
  }

  void on_peers(const PeersUpdatePtr& peers) { peers_ = peers; }

  void on_command(const understory_msgs::MissionCommandConstPtr& command) {
    guarded([&] { static_cast<void>(obey(command->command)); });
  }

  void on_flight(const understory_msgs::FlightStatusConstPtr& flight) {
    guarded([&] {
      flight_ = *flight;
      if (!mission_ || mission_->is_over()) {
        return;
      }
      // From then on the vehicle holds and is not where the mission takes it to be.
      if (flight->gate_violations > 0) {
        fail(StopReason::kStageFailed, "the bridge's gate refused a setpoint");
      } else if (flight->astray != 0) {
        fail(StopReason::kTrackingLost, "the vehicle is not where its trajectory is");
      } else if (flight->battery_low != 0 && mission_->stop_reason() == StopReason::kNone) {
        NODELET_WARN("%s: the battery is low: back home", getName().c_str());
        static_cast<void>(obey(Command::RETURN_HOME));
      }
    });
  }

  // Another autopilot than the bridge's may have no such word; then it flies what it gets.
  [[nodiscard]] bool is_armed() const {
    return flight_.armed != 0 || flight_subscriber_.getNumPublishers() == 0;
  }

  void start_when_armed() {
    if (is_armed() && is_start_wanted_) {
      is_start_wanted_ = false;
      static_cast<void>(obey(Command::START));
      return;
    }
    const double waited_s = static_cast<double>(steady_ns() - first_map_ns_) * 1e-9;
    const BusConfig& bus = setup_.onboard.bus;
    if (is_start_wanted_ && bus.auto_arm && waited_s > bus.arming_patience_s) {
      const std::string why = "not armed after " + std::to_string(bus.arming_patience_s) +
                              " s: link: " + flight_.problem +
                              "; vehicle: " + flight_.vehicle_state + " " + flight_.vehicle_reason;
      fail(StopReason::kTakeOffFailed, why.c_str());
    }
  }

  void on_failure() override { fail(StopReason::kStageFailed, "a stage has failed"); }

  void fail(StopReason reason, const char* why) {
    if (!mission_ || has_failed_) {
      return;
    }
    has_failed_ = true;
    NODELET_ERROR("%s: %s: the mission ends here", getName().c_str(), why);
    const Time now = to_time(ros::Time::now());
    publish(mission_->stop(reason, now));
    publish_status(now);
  }

  bool obey(std::uint8_t command) {
    if (!mission_) {
      return false;
    }
    const Time now = to_time(ros::Time::now());
    Mission::Answer answer;
    switch (command) {
      case Command::START:
        // A trajectory does not wait for a vehicle that does not fly.
        answer.accepted = is_armed() && mission_->start(now);
        break;
      case Command::PAUSE:
        answer = mission_->pause(now);
        break;
      case Command::RETURN_HOME:
        answer = mission_->return_home(now);
        break;
      case Command::LAND:
        answer = mission_->land(now);
        break;
      case Command::STOP:
        answer = {!mission_->is_over(), mission_->stop(StopReason::kInterrupted, now)};
        break;
      default:
        skip("unknown_commands", "unknown command");
    }
    publish(answer.published);
    publish_status(now);
    return answer.accepted;
  }

  void decide(const MapUpdate& update) {
    const std::int64_t begin_ns = steady_ns();
    const MapSnapshotPtr map = receiver_->accept(update);
    if (!map) {
      skip("maps_refused", "map that does not follow on what was received");
      return;
    }
    last_map_ns_ = begin_ns;
    const Time now = to_time(ros::Time::now());
    if (!mission_) {
      if (!start_state_) {
        count("maps_before_odometry");
        return;
      }
      first_map_ns_ = begin_ns;
      MissionConfig mission = setup_.config.mission;
      is_start_wanted_ = mission.auto_start;
      mission.auto_start = false;  // it starts once the vehicle is armed
      mission_ = std::make_unique<Mission>(mission,
                                           setup_.config.explorer,
                                           map->geometry,
                                           start_state_->position_m,
                                           yaw_of(start_state_->world_from_body),
                                           now);
    }
    if (mission_->state() == MissionState::kWaiting && !has_failed_) {
      start_when_armed();
    }
    if (peers_) {
      mission_->set_peers(peers_->peers, now);
    }
    if (!has_failed_) {
      const MissionStep step = mission_->on_map(map, now);
      const bool is_handed_out = hand_out(step.published);
      trace("decision", update.header.stamp, begin_ns);
      if (is_handed_out) {
        trace("trajectory", update.header.stamp, begin_ns);
      }
    }
    publish_status(now);
    show(now);
  }

  // Too late, the vehicle has flown on along what was there before; a brake is never too late.
  bool hand_out(const TrajectoryPtr& trajectory) {
    if (!trajectory) {
      return false;
    }
    const Duration late = to_time(ros::Time::now()) - trajectory->start;
    const bool is_too_late = to_seconds(late) > setup_.onboard.watch.late_decision_s;
    if (is_too_late && trajectory->mode != FlightMode::kBrake) {
      mission_->withdraw(trajectory);
      skip("withdrawn_trajectories", "trajectory that was decided too late");
      return false;
    }
    publish(trajectory);
    return true;
  }

  void publish(const TrajectoryPtr& trajectory) {
    if (!trajectory) {
      return;
    }
    auto update = boost::make_shared<TrajectoryUpdate>();
    update->header.stamp = to_ros(trajectory->start);
    update->header.frame_id = setup_.onboard.frames.map;
    update->trajectory = trajectory;
    trajectory_publisher_.publish(TrajectoryUpdatePtr(update));
    count("trajectories");
    if (path_publisher_.getNumSubscribers() > 0) {
      path_publisher_.publish(boost::make_shared<const nav_msgs::Path>(
          to_path(*trajectory, setup_.onboard.frames.map)));
    }
  }

  void publish_status(Time now) {
    auto msg =
        boost::make_shared<understory_msgs::MissionStatus>(to_msg(status_of(*mission_, now)));
    msg->header.frame_id = setup_.onboard.frames.map;
    status_publisher_.publish(understory_msgs::MissionStatusConstPtr(msg));
    for (std::size_t i = 0; i < msg->counter_names.size(); ++i) {
      set_counter(msg->counter_names[i], msg->counter_values[i]);
    }
  }

  void show(Time now) {
    const bool is_due = to_seconds(now - last_shown_) >= setup_.onboard.publish.markers_s;
    if (!is_due || markers_publisher_.getNumSubscribers() == 0) {
      return;
    }
    last_shown_ = now;
    markers_publisher_.publish(
        boost::make_shared<const visualization_msgs::MarkerArray>(mission_markers(
            *mission_,
            {setup_.onboard.frames.map, to_ros(now), setup_.config.explorer.map.resolution_m})));
  }

  // Without maps nothing new is planned and what is flown ends at rest; the mission must end too.
  void watch() {
    const bool is_flying =
        mission_ && !mission_->is_over() && mission_->state() != MissionState::kWaiting;
    const double silent_s = static_cast<double>(steady_ns() - last_map_ns_) * 1e-9;
    if (is_flying && silent_s > setup_.onboard.watch.frames_s) {
      NODELET_ERROR("%s: no map for %.1f s: the mission ends here", getName().c_str(), silent_s);
      const Time now = to_time(ros::Time::now());
      publish(mission_->stop(StopReason::kSensorLost, now));
      publish_status(now);
    } else if (mission_ && silent_s > 1.0) {
      publish_status(to_time(ros::Time::now()));  // others must see that we are there
    }
  }

  [[nodiscard]] Health health() override {
    if (!mission_) {
      return {diagnostic_msgs::DiagnosticStatus::WARN, "waiting for odometry and the first map"};
    }
    const std::string state = to_string(mission_->state());
    if (mission_->stop_reason() == StopReason::kSensorLost) {
      return {diagnostic_msgs::DiagnosticStatus::ERROR, state + ": no maps"};
    }
    return {diagnostic_msgs::DiagnosticStatus::OK, state};
  }

  FlightSetup setup_;
  std::unique_ptr<MapReceiver> receiver_;
  std::optional<VehicleState> start_state_;
  std::unique_ptr<Mission> mission_;
  PeersUpdatePtr peers_;  // newest
  understory_msgs::FlightStatus flight_;
  bool is_start_wanted_ = false;
  bool has_failed_ = false;
  std::int64_t first_map_ns_ = 0;
  std::int64_t last_map_ns_ = 0;
  Time last_shown_{};
  ros::Publisher trajectory_publisher_;
  ros::Publisher status_publisher_;
  ros::Publisher markers_publisher_;
  ros::Publisher path_publisher_;
  ros::Subscriber odometry_subscriber_;
  ros::Subscriber map_subscriber_;
  ros::Subscriber peers_subscriber_;
  ros::Subscriber command_subscriber_;
  ros::Subscriber flight_subscriber_;
  std::vector<ros::ServiceServer> services_;
  ros::WallTimer watch_;
};

}  // namespace understory

PLUGINLIB_EXPORT_CLASS(understory::ExplorerNodelet, nodelet::Nodelet)
