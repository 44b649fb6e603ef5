// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// A host and a vehicle that hear each other without delay or loss, but for what a test takes away;
// each by its own clock. The vehicle is where a test puts it. Steps of 2 ms; the host ticks every
// 10 ms. World frame, SI units.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "understory/link/host_station.hpp"
#include "understory/link/vehicle_station.hpp"

namespace understory::test {

class FrameList : public can::FrameSink {
 public:
  void send(const can::Frame& frame, Time now) override { frames.push_back({frame, now, true}); }

  std::vector<can::PortFrame> frames;
};

// Of this message, in order.
template <class Message>
[[nodiscard]] std::vector<Message> messages_in(const std::vector<can::PortFrame>& frames) {
  std::vector<Message> messages;
  for (const can::PortFrame& frame : frames) {
    if (const auto received = can::decode<Message>(frame.frame)) {
      messages.push_back(received->message);
    }
  }
  return messages;
}

struct StationPair {
  static constexpr Duration kStep = std::chrono::milliseconds(2);
  using Filter = std::function<bool(const can::Frame&)>;

  explicit StationPair(const can::VehicleStationConfig& config = {}, Duration ahead = {})
      : vehicle_config(config), vehicle_ahead(ahead) {
    readings.state.position_m = {1.0, 2.0, 1.5};
    setpoint.emplace();
    setpoint->position_m = readings.state.position_m;
    restart_vehicle(1);
  }

  // As after its power was off for a moment.
  void restart_vehicle(std::uint64_t seed) {
    vehicle = std::make_unique<can::VehicleStation>(vehicle_config, Rng(seed));
  }
  [[nodiscard]] Time vehicle_now() const { return now + vehicle_ahead; }
  [[nodiscard]] can::State vehicle_state() const { return vehicle->supervisor().state(); }
  [[nodiscard]] can::HostState host_state() const { return host.state(now); }
  [[nodiscard]] can::LinkProblem problem() const { return host.problem(now); }

  void pass_up(const can::Frame& frame) {
    FrameList answers;
    vehicle->on_frame(frame, vehicle_now(), answers);
    pass_down(answers);
  }
  void pass_down(const FrameList& list) {
    for (const can::PortFrame& frame : list.frames) {
      from_vehicle.push_back({frame.frame, now, false});
      if (is_down_on && (!down_filter || down_filter(frame.frame))) {
        host.on_frame(frame.frame, now);
      }
    }
  }
  void tick() {
    FrameList sent;
    host.tick(setpoint, mode, now, sent);
    for (const can::PortFrame& frame : sent.frames) {
      from_host.push_back({frame.frame, now, false});
      host.on_sent(frame.frame, now);
      if (is_up_on && (!up_filter || up_filter(frame.frame))) {
        pass_up(frame.frame);
      }
    }
  }
  void step() {
    now += kStep;
    commands = vehicle->step(readings, to_seconds(kStep), vehicle_now());
    FrameList telemetry;
    vehicle->send_due(readings, vehicle_now(), telemetry);
    pass_down(telemetry);
    if (has_host && now >= next_tick) {
      next_tick = now + std::chrono::milliseconds(10);
      tick();
    }
  }
  void run(Duration duration) {
    for (const Time end = now + duration; now < end;) {
      step();
    }
  }
  template <class Condition>
  [[nodiscard]] std::optional<Duration> run_until(Condition condition, Duration at_most) {
    for (const Time begin = now; now < begin + at_most;) {
      step();
      if (condition()) {
        return now - begin;
      }
    }
    return std::nullopt;
  }
  // In flight, with nothing sent so far on record.
  [[nodiscard]] bool take_off() {
    run(std::chrono::seconds(1));
    host.ask_arm();
    run(std::chrono::seconds(1));
    readings.is_on_ground = false;
    readings.state.velocity_mps.z() = -0.2;  // what does not move at all has landed
    forget_records();
    return vehicle_state() == can::State::kArmed && host_state() == can::HostState::kFlying;
  }
  void touch_down() {
    readings.is_on_ground = true;
    readings.state.velocity_mps.setZero();
  }
  void forget_records() {
    from_host.clear();
    from_vehicle.clear();
  }

  can::VehicleStationConfig vehicle_config;
  Duration vehicle_ahead;
  can::HostStation host{can::HostStationConfig{}, 40};
  std::unique_ptr<can::VehicleStation> vehicle;
  can::VehicleReadings readings;
  std::optional<Setpoint> setpoint;
  can::SpMode mode = can::SpMode::kTrack;
  bool has_host = true;
  bool is_up_on = true;
  bool is_down_on = true;
  Filter up_filter;  // what passes
  Filter down_filter;
  MotorCommands commands{};
  std::vector<can::PortFrame> from_host;  // by the host's clock, before any filter
  std::vector<can::PortFrame> from_vehicle;
  Time now{std::chrono::hours(470'000)};  // wall-clock times are large
  Time next_tick{};
};

}  // namespace understory::test
