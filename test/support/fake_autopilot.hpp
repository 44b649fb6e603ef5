// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// An autopilot that writes down what it is sent and says of the vehicle what a test tells it to,
// and what tests of the flight thread fly on it. World frame, SI units; the log may be used by any
// thread.
#pragma once

#include <chrono>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <sched.h>

#include "understory/bridge/flight_loop.hpp"

namespace understory::test {

struct Sent {
  Setpoint setpoint;
  Time time{};
};

class AutopilotLog {
 public:
  void place_vehicle(const VehicleState& state) {
    const std::lock_guard<std::mutex> lock(mutex_);
    state_ = state;
  }
  // The next setpoint takes so long to send, once.
  void stall_once(std::chrono::milliseconds stall) {
    const std::lock_guard<std::mutex> lock(mutex_);
    stall_ = stall;
  }
  // While the lock lives, the flight thread waits.
  [[nodiscard]] std::unique_lock<std::mutex> stop_the_thread() {
    return std::unique_lock<std::mutex>(mutex_);
  }

  [[nodiscard]] std::vector<Sent> sent() const {
    const std::lock_guard<std::mutex> lock(mutex_);
    return sent_;
  }
  [[nodiscard]] int landings() const {
    const std::lock_guard<std::mutex> lock(mutex_);
    return landings_;
  }
  [[nodiscard]] int destroyed() const {
    const std::lock_guard<std::mutex> lock(mutex_);
    return destroyed_;
  }
  [[nodiscard]] std::optional<int> scheduling_policy() const {
    const std::lock_guard<std::mutex> lock(mutex_);
    return policy_;
  }

  // Of the autopilot; returns for how long it is to stall.
  [[nodiscard]] std::chrono::milliseconds add(const Sent& sent) {
    const std::lock_guard<std::mutex> lock(mutex_);
    sent_.push_back(sent);
    policy_ = sched_getscheduler(0);
    return std::exchange(stall_, std::chrono::milliseconds(0));
  }
  [[nodiscard]] VehicleState vehicle() const {
    const std::lock_guard<std::mutex> lock(mutex_);
    return state_;
  }
  void add_landing() {
    const std::lock_guard<std::mutex> lock(mutex_);
    ++landings_;
  }
  void add_destruction() {
    const std::lock_guard<std::mutex> lock(mutex_);
    ++destroyed_;
  }

 private:
  mutable std::mutex mutex_;
  VehicleState state_;
  std::chrono::milliseconds stall_{0};
  std::vector<Sent> sent_;
  int landings_ = 0;
  int destroyed_ = 0;
  std::optional<int> policy_;
};

class FakeAutopilot : public Autopilot {
 public:
  explicit FakeAutopilot(std::shared_ptr<AutopilotLog> log) : log_(std::move(log)) {}
  ~FakeAutopilot() override { log_->add_destruction(); }

  void send(const std::optional<Setpoint>& setpoint, bool /*is_hold*/, Time now) override {
    if (setpoint) {
      std::this_thread::sleep_for(log_->add({*setpoint, now}));
    }
  }
  [[nodiscard]] Telemetry receive(Time now) override {
    Telemetry telemetry;
    telemetry.time = now;
    telemetry.state = log_->vehicle();
    telemetry.is_valid = true;
    telemetry.is_following = true;
    return telemetry;
  }
  void run_until(std::int64_t steady_ns) override { sleep_until(steady_ns); }
  void arm() override {}
  void disarm() override { log_->add_landing(); }
  void kill() override {}

 private:
  std::shared_ptr<AutopilotLog> log_;
};

inline const Box3d kFlightBox_m(Vector3d(-5.0, -5.0, 0.0), Vector3d(5.0, 5.0, 2.0));
inline const Vector3d kFlightStart_m(1.0, 2.0, 1.5);
inline constexpr std::chrono::milliseconds kPatience{10000};  // for what comes within milliseconds

// Ordinary threads, and limits that the short hops below keep.
inline FlightConfig flight_config(double rate_hz) {
  FlightConfig config;
  config.rate_hz = rate_hz;
  config.priority = 0;
  config.gate.max_acceleration_mps2 = 100.0;
  return config;
}

// From rest to rest.
inline Trajectory hop(const Vector3d& from_m, const Vector3d& to_m, double duration_s) {
  Trajectory trajectory;
  trajectory.position.control_points = {from_m, from_m, from_m, to_m, to_m, to_m};
  trajectory.position.knot_s = duration_s / 3.0;
  trajectory.yaw.control_points = {0.0, 0.0, 0.0, 0.2, 0.2, 0.2};
  trajectory.yaw.knot_s = duration_s / 3.0;
  return trajectory;
}

inline TrajectoryPtr starting_at(Trajectory trajectory, Time start, std::uint64_t id) {
  trajectory.start = start;
  trajectory.id = id;
  return std::make_shared<const Trajectory>(std::move(trajectory));
}

struct FlightBench {
  explicit FlightBench(const FlightConfig& config) {
    VehicleState state;
    state.position_m = kFlightStart_m;
    log->place_vehicle(state);
    loop = std::make_unique<FlightLoop>(config, kFlightBox_m, std::make_unique<FakeAutopilot>(log));
  }

  // The next ones that nobody has seen; fewer only after a failure.
  [[nodiscard]] std::vector<FlightTick> ticks(std::size_t count) {
    std::vector<FlightTick> seen;
    while (seen.size() < count) {
      const std::optional<FlightTick> tick = loop->wait_for_tick(kPatience);
      if (!tick) {
        ADD_FAILURE() << "no tick";
        break;
      }
      seen.push_back(*tick);
    }
    return seen;
  }
  [[nodiscard]] std::vector<FlightTick> ticks_until(Time time) {
    std::vector<FlightTick> seen;
    do {
      const std::vector<FlightTick> next = ticks(1);
      if (next.empty()) {
        break;
      }
      seen.push_back(next.front());
    } while (wall_time() < time);
    return seen;
  }

  std::shared_ptr<AutopilotLog> log = std::make_shared<AutopilotLog>();
  std::unique_ptr<FlightLoop> loop;
};

[[nodiscard]] inline bool is_setpoint_of(const Trajectory& trajectory, const Sent& sent) {
  const TrajectoryPoint point = trajectory.sample(sent.time);
  return sent.setpoint.position_m == point.position_m &&
         sent.setpoint.velocity_mps == point.velocity_mps &&
         sent.setpoint.acceleration_mps2 == point.acceleration_mps2 &&
         sent.setpoint.yaw_rad == point.yaw_rad &&
         sent.setpoint.yaw_rate_radps == point.yaw_rate_radps;
}

}  // namespace understory::test
