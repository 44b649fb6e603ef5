// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// Records a flight, judges a simulated one by the true world, and writes its result folder
// (parameters of the vehicle's namespace: result_folder, empty: nothing is written; simulated). In:
// odometry, map_updates, status, flight_status, trace, flight_timing. Out: result, once the mission
// is over and the vehicle is down or at rest. What there is is also written when the nodelet is
// unloaded before.
#include <filesystem>
#include <memory>

#include <fmt/core.h>
#include <pluginlib/class_list_macros.hpp>
#include <understory_msgs/FlightStatus.h>
#include <understory_msgs/MissionResult.h>

#include "understory/nodelets/conversions.hpp"
#include "understory/nodelets/flight_setup.hpp"
#include "understory/nodelets/guarded_nodelet.hpp"
#include "understory/nodelets/map_update.hpp"
#include "understory/nodelets/trace_writer.hpp"
#include "understory/sim/live_line.hpp"
#include "understory/sim/mission_record.hpp"

namespace understory {
namespace {

namespace fs = std::filesystem;

constexpr double kSettleS = 8.0;    // to land or come to rest after the mission's last word
constexpr double kSilenceS = 20.0;  // without a word from the mission, it is over
constexpr double kStillMps = 0.05;
constexpr int kTicksPerFlush = 8;  // others look at them while it flies

}  // namespace

class RecorderNodelet : public GuardedNodelet {
 public:
  RecorderNodelet() = default;
  RecorderNodelet(const RecorderNodelet&) = delete;
  RecorderNodelet& operator=(const RecorderNodelet&) = delete;
  ~RecorderNodelet() override {
    guarded([this] { finish(); });
  }

 private:
  void start() override {
    ros::NodeHandle& nh = getNodeHandle();
    const FlightSetup setup = load_flight_setup(nh);
    bool simulated = true;
    nh.param("simulated", simulated, true);
    world_ = std::make_unique<World>(simulated ? World::of_vehicle(setup.config, setup.seed)
                                               : World(setup.config));
    receiver_ =
        std::make_unique<MapReceiver>(setup.config.explorer.map, world_->config.scene.box.box_m());
    bool live = false;
    nh.param("live_line", live, false);
    live_ = std::make_unique<LiveLine>(!live);
    nh.param("result_folder", folder_, std::string());
    if (!folder_.empty()) {
      prepare_result_folder(folder_);
      ticks_ =
          std::make_unique<TickWriter>((fs::path(folder_) / "ticks.csv").string(), kTicksPerFlush);
      traces_ = std::make_unique<TraceWriter>((fs::path(folder_) / "trace.csv").string());
    }
    coverage_ = world_->coverage_truth();
    result_publisher_ = nh.advertise<understory_msgs::MissionResult>("result", 1);
    subscribe(nh);
    timer_ = nh.createWallTimer(ros::WallDuration(0.25), [this](const ros::WallTimerEvent&) {
      guarded([this] { look(); });
    });
  }

  void subscribe(ros::NodeHandle& nh) {
    odometry_subscriber_ = nh.subscribe("odometry", 200, &RecorderNodelet::on_odometry, this);
    map_subscriber_ = nh.subscribe("map_updates", 2, &RecorderNodelet::on_map, this);
    status_subscriber_ = nh.subscribe("status", 20, &RecorderNodelet::on_status, this);
    flight_subscriber_ = nh.subscribe("flight_status", 10, &RecorderNodelet::on_flight, this);
    trace_subscriber_ = nh.subscribe("trace", 500, &RecorderNodelet::on_trace, this);
    timing_subscriber_ = nh.subscribe("flight_timing", 10, &RecorderNodelet::on_timing, this);
  }

  void on_odometry(const nav_msgs::OdometryConstPtr& odometry) {
    guarded([&] {
      const Time time = to_time(odometry->header.stamp);
      const std::optional<VehicleState> state = to_vehicle_state(*odometry);
      if (!state || time <= vehicle_time_) {
        count("odometry_skipped");
        return;
      }
      vehicle_ = *state;
      vehicle_time_ = time;
      if (status_) {
        record_->on_vehicle(time, vehicle_);
      }
    });
  }

  void on_map(const MapUpdatePtr& update) {
    guarded([&] {
      if (const MapSnapshotPtr map = receiver_->accept(*update)) {
        map_ = map;
      }
    });
  }

  void on_status(const understory_msgs::MissionStatusConstPtr& msg) {
    guarded([&] {
      const std::optional<MissionStatus> status = from_msg(*msg);
      if (!status || !map_ || is_finished_) {
        return;
      }
      if (!status_) {
        record_ = std::make_unique<MissionRecord>(*world_, coverage_, status->started_at);
        write_start(status->started_at);
      }
      status_ = status;
      status_seen_ns_ = steady_ns();
      row_ = record_->on_frame(*map_, *status, vehicle_);
      if (ticks_) {
        ticks_->append(row_);
      }
      live_->show(row_, 1.0);
    });
  }

  void on_flight(const understory_msgs::FlightStatusConstPtr& flight) {
    flight_ = *flight;
    set_counter("gate_violations", flight->gate_violations);
    set_counter("skipped_deadlines", flight->skipped_deadlines);
  }

  void on_trace(const understory_msgs::TraceConstPtr& mark) {
    if (traces_) {
      traces_->append(*mark);
    }
  }

  void on_timing(const understory_msgs::FlightTimingConstPtr& timing) {
    if (traces_) {
      traces_->append(*timing);
    }
  }

  // Whether the mission has come to its end.
  void look() {
    if (!status_ || is_finished_) {
      return;
    }
    const double silent_s = static_cast<double>(steady_ns() - status_seen_ns_) * 1e-9;
    if (!status_->is_over()) {
      over_since_ns_ = steady_ns();
    }
    const double over_s = static_cast<double>(steady_ns() - over_since_ns_) * 1e-9;
    // By the last row that was written, so that the record ends with the vehicle at rest.
    const bool is_still = status_->state == MissionState::kStopped && status_->at_rest &&
                          row_.velocity_mps.norm() < kStillMps;
    if ((status_->is_over() && (flight_.down != 0 || is_still || over_s > kSettleS)) ||
        silent_s > kSilenceS) {
      finish();
    }
  }

  // When the ticks' clock begins: those of a team are compared on one clock, of a lost one too.
  void write_start(Time start) const {
    if (!folder_.empty()) {
      write_text_file((fs::path(folder_) / "start.json").string(),
                      fmt::format("{{\"started_at_s\": {:.6f}}}\n", to_seconds(start)));
    }
  }

  // What could not be written; who waits for the result must not wait for ever.
  std::string write(const MissionResult& result) {
    try {
      if (!folder_.empty()) {
        ticks_->close();
        traces_->flush();
        record_->write(folder_, *map_, result);
      }
      return {};
    } catch (const std::exception& error) {
      return std::string("; results are lost: ") + error.what();
    }
  }

  void finish() {
    if (is_finished_ || !status_) {
      return;
    }
    is_finished_ = true;
    MissionResult result = record_->result(*status_, vehicle_time_);
    if (status_->stop_reason == StopReason::kNone) {
      result.stop_reason = to_string(StopReason::kInterrupted);
    }
    result.realtime_factor = 1.0;
    result.counters["gate_violations"] = flight_.gate_violations;
    result.counters["skipped_deadlines"] = flight_.skipped_deadlines;
    live_->finish(row_, 1.0);
    const std::string lost = write(result);
    auto msg = boost::make_shared<understory_msgs::MissionResult>();
    msg->header.stamp = ros::Time::now();
    msg->good = static_cast<std::uint8_t>(result.is_good() && lost.empty());
    msg->stop_reason = result.stop_reason;
    msg->folder = folder_;
    msg->summary = summary_of(result) + lost;
    NODELET_INFO("%s", msg->summary.c_str());
    result_publisher_.publish(understory_msgs::MissionResultConstPtr(msg));
  }

  std::unique_ptr<World> world_;
  std::shared_ptr<const CoverageTruth> coverage_;
  std::unique_ptr<MapReceiver> receiver_;
  std::unique_ptr<MissionRecord> record_;
  std::unique_ptr<LiveLine> live_;
  std::string folder_;
  std::unique_ptr<TickWriter> ticks_;
  std::unique_ptr<TraceWriter> traces_;
  MapSnapshotPtr map_;
  VehicleState vehicle_;
  Time vehicle_time_{};
  std::optional<MissionStatus> status_;
  std::int64_t status_seen_ns_ = 0;
  std::int64_t over_since_ns_ = 0;
  TickRow row_;
  understory_msgs::FlightStatus flight_;
  bool is_finished_ = false;
  ros::Publisher result_publisher_;
  ros::Subscriber odometry_subscriber_;
  ros::Subscriber map_subscriber_;
  ros::Subscriber status_subscriber_;
  ros::Subscriber flight_subscriber_;
  ros::Subscriber trace_subscriber_;
  ros::Subscriber timing_subscriber_;
  ros::WallTimer timer_;
};

}  // namespace understory

PLUGINLIB_EXPORT_CLASS(understory::RecorderNodelet, nodelet::Nodelet)
