// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// Of a vehicle that has a team: tells the others what it sees and does, over DDS, and hears them.
// In: map_updates (its own map), odometry, status, trajectory. Out: team_map_updates (what all have
// seen, as far as it is known here), peers. A thread of CycloneDDS receives; what has arrived is
// looked at 50 times a second.
#include <algorithm>
#include <array>
#include <cmath>
#include <memory>

#include <pluginlib/class_list_macros.hpp>

#include "understory/dds/dds_link.hpp"
#include "understory/nodelets/conversions.hpp"
#include "understory/nodelets/flight_setup.hpp"
#include "understory/nodelets/guarded_nodelet.hpp"
#include "understory/nodelets/map_update.hpp"
#include "understory/nodelets/peers_update.hpp"
#include "understory/nodelets/trajectory_update.hpp"
#include "understory/team/exchange.hpp"

namespace understory {
namespace {

constexpr double kPeriodS = 0.02;  // as exactly are arrivals known
constexpr double kPeersS = 0.05;
constexpr std::int64_t kNsPerUs = 1000;

std::uint64_t session_of_now() {
  return ros::WallTime::now().toNSec() / kNsPerUs;
}

}  // namespace

class TeamLinkNodelet : public GuardedNodelet {
 private:
  void start() override {
    ros::NodeHandle& nh = getNodeHandle();
    const FlightSetup setup = load_flight_setup(nh);
    const MapConfig& map = setup.config.explorer.map;
    const Box3d box_m = setup.config.scene.box.box_m();
    team_ = setup.config.explorer.team;
    map_frame_ = setup.onboard.frames.map;
    whole_map_every_ = static_cast<std::uint64_t>(setup.onboard.publish.whole_map_every);
    receiver_ = std::make_unique<MapReceiver>(map, box_m);
    exchange_ = std::make_unique<team::Exchange>(
        team_, GridGeometry(map.resolution_m, box_m), SensorModel(map.sensor), session_of_now());
    link_ = std::make_unique<dds::DdsLink>(setup.onboard.dds);
    map_publisher_ = nh.advertise<MapUpdate>("team_map_updates", 1);
    peers_publisher_ = nh.advertise<PeersUpdate>("peers", 1);
    const ros::TransportHints hints = ros::TransportHints().tcpNoDelay();
    map_subscriber_ = nh.subscribe("map_updates", 1, &TeamLinkNodelet::on_map, this, hints);
    odometry_subscriber_ = nh.subscribe("odometry", 1, &TeamLinkNodelet::on_odometry, this, hints);
    status_subscriber_ = nh.subscribe("status", 1, &TeamLinkNodelet::on_status, this);
    trajectory_subscriber_ =
        nh.subscribe("trajectory", 10, &TeamLinkNodelet::on_trajectory, this, hints);
    timer_ = nh.createWallTimer(ros::WallDuration(kPeriodS), [this](const ros::WallTimerEvent&) {
      guarded([this] { exchange(); });
    });
  }

  void on_odometry(const nav_msgs::OdometryConstPtr& odometry) {
    guarded([&] {
      const std::optional<VehicleState> state = to_vehicle_state(*odometry);
      if (!state) {
        skip("bad_odometry", "odometry that is not finite");
        return;
      }
      own_.position_m = state->position_m;
      own_.velocity_mps = state->velocity_mps;
      own_.yaw_rad = yaw_of(state->world_from_body);
      has_odometry_ = true;
    });
  }

  void on_status(const understory_msgs::MissionStatusConstPtr& msg) {
    guarded([&] {
      const std::optional<MissionStatus> status = from_msg(*msg);
      if (!status) {
        skip("bad_status", "status with an unknown enumerator");
        return;
      }
      own_.state = status->state;
      // Others are told how it explores, not that it brakes or crosses known space meanwhile.
      if (status->mode == FlightMode::kExplorer || status->mode == FlightMode::kCollector) {
        own_.mode = status->mode;
      }
      // Who has found nothing left wants nothing for itself.
      own_.target_m =
          status->state == MissionState::kExplore ? status->target_m : std::optional<Vector3d>();
    });
  }

  void on_trajectory(const TrajectoryUpdatePtr& update) {
    guarded([&] {
      own_.trajectory = update->trajectory;
      tell(to_time(ros::Time::now()));  // at once: others must not plan through it
    });
  }

  void on_map(const MapUpdatePtr& own) {
    guarded([&] {
      const std::int64_t begin_ns = steady_ns();
      const MapSnapshotPtr map = receiver_->accept(*own);
      if (!map) {
        skip("maps_refused", "map that does not follow on what was received");
        return;
      }
      const Time now = to_time(ros::Time::now());
      hear(now);
      publish_peers(now);
      auto update = boost::make_shared<MapUpdate>();
      update->header = own->header;
      update->map = exchange_->on_map(*map, now);
      const std::uint64_t revision = update->map->revision;
      update->is_whole = revision == 1 || revision % whole_map_every_ == 0;
      map_publisher_.publish(MapUpdatePtr(update));
      trace("team_map", own->header.stamp, begin_ns);
    });
  }

  void exchange() {
    const Time now = to_time(ros::Time::now());
    hear(now);
    tell(now);
    if (to_seconds(now - told_of_peers_) >= kPeersS) {
      publish_peers(now);
    }
  }

  void hear(Time now) {
    for (const team::Sample& sample : link_->take()) {
      exchange_->receive(sample, now);
    }
  }

  void tell(Time now) {
    if (!has_odometry_) {
      return;
    }
    for (team::Sample& sample : exchange_->due(own_, now)) {
      link_->publish(std::move(sample));
    }
  }

  void publish_peers(Time now) {
    told_of_peers_ = now;
    auto update = boost::make_shared<PeersUpdate>();
    update->header.stamp = to_ros(now);
    update->header.frame_id = map_frame_;
    update->peers = exchange_->peers(now);
    in_contact_ = static_cast<int>(
        std::count_if(update->peers.begin(), update->peers.end(), [](const team::Peer& peer) {
          return peer.in_contact;
        }));
    peers_publisher_.publish(PeersUpdatePtr(update));
  }

  void count_traffic() {
    const team::Counters& counters = exchange_->counters();
    constexpr std::array<const char*, 3> kKinds{"state", "trajectory", "tile"};
    for (std::size_t i = 0; i < kKinds.size(); ++i) {
      const std::string kind = kKinds.at(i);
      set_counter("sent_" + kind + "_samples", counters.sent.at(i).samples);
      set_counter("sent_" + kind + "_bytes", counters.sent.at(i).bytes);
      set_counter("accepted_" + kind + "_samples", counters.accepted.at(i).samples);
      set_counter("accepted_" + kind + "_bytes", counters.accepted.at(i).bytes);
    }
    for (std::size_t i = 0; i < team::kRejectionCount; ++i) {
      const auto reason = static_cast<team::Rejection>(i);
      set_counter(std::string("rejected: ") + to_string(reason), counters.rejected_for(reason));
    }
    set_counter("dds_refused", link_->counters().refused);
    set_counter("dds_malformed", link_->counters().malformed);
    set_counter("dds_mates", link_->mates());
    set_counter("in_contact", static_cast<std::uint64_t>(in_contact_));
  }

  [[nodiscard]] Health health() override {
    count_traffic();
    using diagnostic_msgs::DiagnosticStatus;
    const std::string contact = std::to_string(in_contact_) + " of " +
                                std::to_string(team_.size - 1) + " team mates in contact";
    const double most_s = team_.exchange.max_clock_offset_s;
    for (int id = 0; id < team_.size; ++id) {
      const std::optional<Duration> offset = exchange_->clock_offset(static_cast<std::uint8_t>(id));
      if (offset && std::abs(to_seconds(*offset)) > most_s) {
        return {DiagnosticStatus::ERROR,
                contact + "; the clock of vehicle " + std::to_string(id) + " is off by " +
                    std::to_string(to_seconds(*offset)) + " s"};
      }
    }
    const bool all_are_there = in_contact_ == team_.size - 1;
    if (all_are_there) {
      return {DiagnosticStatus::OK, contact};
    }
    return {DiagnosticStatus::WARN, contact};
  }

  team::TeamConfig team_;
  std::string map_frame_;
  std::uint64_t whole_map_every_ = 1;
  std::unique_ptr<MapReceiver> receiver_;
  std::unique_ptr<team::Exchange> exchange_;
  std::unique_ptr<dds::DdsLink> link_;
  team::OwnState own_;
  bool has_odometry_ = false;
  Time told_of_peers_{};
  int in_contact_ = 0;
  ros::Publisher map_publisher_;
  ros::Publisher peers_publisher_;
  ros::Subscriber map_subscriber_;
  ros::Subscriber odometry_subscriber_;
  ros::Subscriber status_subscriber_;
  ros::Subscriber trajectory_subscriber_;
  ros::WallTimer timer_;
};

}  // namespace understory

PLUGINLIB_EXPORT_CLASS(understory::TeamLinkNodelet, nodelet::Nodelet)
