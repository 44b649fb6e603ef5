// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// A whole flight in memory: bus, vehicle and host, whose plan is told by a function of time. Ticks
// of 10 ms; the host arms as soon as it may. World frame, SI units.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "understory/bridge/flight_control.hpp"
#include "understory/sim/simulated_bus.hpp"

namespace understory::test {

class BusTape : public can::FrameTap {
 public:
  void on_port_frame(const can::PortFrame& frame) override { frames.push_back(frame); }

  std::vector<can::PortFrame> frames;
};

struct BusFlight {
  static constexpr Duration kTick = std::chrono::milliseconds(10);

  explicit BusFlight(std::uint64_t seed = 1,
                     const SimulatedVehicleConfig& config = {},
                     const can::BusFaults& faults = {})
      : bus(std::make_unique<SimulatedBus>(
            config, can::HostStationConfig{}, start(), Rng(seed), Time{})) {
    bus->bus().set_faults(faults);
    bus->host().node().set_tap(tape);
    wanted.position_m = start().translation();
  }
  [[nodiscard]] static Pose start() {
    Pose pose = Pose::Identity();
    pose.translation() = Vector3d(1.0, -2.0, 1.5);
    return pose;
  }

  [[nodiscard]] can::State vehicle_state() const {
    return bus->vehicle().station().supervisor().state();
  }
  [[nodiscard]] can::StateReason reason() const {
    return bus->vehicle().station().supervisor().reason();
  }
  [[nodiscard]] const VehicleState& vehicle() const { return bus->vehicle().state(); }
  [[nodiscard]] Time now() const { return bus->now(); }

  void tick() {
    telemetry = bus->host().receive(now());
    if (is_host_alive) {
      if (wants_to_fly && telemetry.link.host == can::HostState::kReady) {
        bus->host().arm();
      }
      // As FlightControl does it: what does not follow gets a hold where it is.
      if (telemetry.is_following && plan) {
        wanted = plan(now());
      } else if (telemetry.is_valid && !telemetry.is_following) {
        wanted = Setpoint{};
        wanted.position_m = telemetry.state.position_m;
      }
      bus->host().send(
          telemetry.is_valid || telemetry.is_following ? std::optional(wanted) : std::nullopt,
          !plan,
          now());
      sent.push_back(wanted);
    }
    bus->advance(now() + kTick, [this](Time, const VehicleState& state) { on_step(state); });
  }
  void run(Duration duration) {
    for (const Time end = now() + duration; now() < end;) {
      tick();
    }
  }
  template <class Condition>
  [[nodiscard]] std::optional<Duration> run_until(Condition condition, Duration at_most) {
    for (const Time begin = now(); now() < begin + at_most;) {
      tick();
      if (condition()) {
        return now() - begin;
      }
    }
    return std::nullopt;
  }
  // To half a metre above the launcher, at rest.
  [[nodiscard]] bool take_off() {
    const bool is_following =
        run_until([&] { return telemetry.is_following; }, std::chrono::seconds(10)).has_value();
    const Time begin = now();
    plan = [begin](Time time) {
      Setpoint climb;
      climb.velocity_mps.z() = time - begin < std::chrono::seconds(1) ? 0.5 : 0.0;
      climb.position_m = start().translation();
      climb.position_m.z() += 0.5 * std::min(1.0, to_seconds(time - begin));
      return climb;
    };
    run(std::chrono::seconds(3));
    plan = nullptr;
    wants_to_fly = false;
    return is_following && vehicle_state() == can::State::kArmed &&
           vehicle().position_m.z() > start().translation().z() + 0.4;
  }

  std::shared_ptr<BusTape> tape = std::make_shared<BusTape>();
  std::unique_ptr<SimulatedBus> bus;
  Telemetry telemetry;
  Setpoint wanted;
  std::vector<Setpoint> sent;
  std::function<Setpoint(Time)> plan;
  std::function<void(const VehicleState&)> on_step = [](const VehicleState&) {};
  bool is_host_alive = true;
  bool wants_to_fly = true;
};

// East from the start, from rest to 2 m/s with 1 m/s2.
[[nodiscard]] inline std::function<Setpoint(Time)> east_from(const Vector3d& start_m, Time begin) {
  return [start_m, begin](Time now) {
    const double time_s = to_seconds(now - begin);
    const double accelerating_s = std::min(time_s, 2.0);
    Setpoint setpoint;
    setpoint.velocity_mps.x() = accelerating_s;
    setpoint.acceleration_mps2.x() = time_s < 2.0 ? 1.0 : 0.0;
    setpoint.position_m =
        start_m +
        Vector3d(
            0.5 * accelerating_s * accelerating_s + 2.0 * std::max(0.0, time_s - 2.0), 0.0, 0.0);
    return setpoint;
  };
}

}  // namespace understory::test
