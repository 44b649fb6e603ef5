// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// The simulated vehicle and the host's end of its bus, joined by a bus in memory: what lockstep and
// the onboard host without CAN fly. Every setpoint goes through codec, arbitration and the
// vehicle's checks. World ENU, SI units. One thread; nothing fails after construction, which throws
// ConfigError when the motors cannot carry the airframe.
#pragma once

#include <functional>

#include "understory/base/rng.hpp"
#include "understory/bridge/can_autopilot.hpp"
#include "understory/port/memory_can_bus.hpp"
#include "understory/sim/simulated_vehicle.hpp"

namespace understory {

class SimulatedBus {
 public:
  using StepHook = std::function<void(Time, const VehicleState&)>;

  // The world begins at `now`.
  SimulatedBus(const SimulatedVehicleConfig& vehicle,
               const can::HostStationConfig& host,
               const Pose& world_from_start,
               const Rng& rng,
               Time now);

  // Its parts call each other.
  SimulatedBus(const SimulatedBus&) = delete;
  SimulatedBus& operator=(const SimulatedBus&) = delete;
  ~SimulatedBus() = default;

  // The world goes on until then in steps of 2 ms, each of which `on_step` sees.
  void advance(Time until, const StepHook& on_step);

  [[nodiscard]] CanAutopilot& host() { return *host_; }
  [[nodiscard]] const CanAutopilot& host() const { return *host_; }
  [[nodiscard]] SimulatedVehicle& vehicle() { return *vehicle_; }
  [[nodiscard]] const SimulatedVehicle& vehicle() const { return *vehicle_; }
  [[nodiscard]] can::MemoryCanBus& bus() { return bus_; }
  [[nodiscard]] can::MemoryCanPort& host_port() { return *host_port_; }
  [[nodiscard]] Time now() const { return now_; }
  // The clock has gone on without the world.
  void skip_to(Time now);

 private:
  can::MemoryCanBus bus_;
  can::MemoryCanPort* host_port_ = nullptr;  // of the host's node
  std::unique_ptr<SimulatedVehicle> vehicle_;
  std::unique_ptr<CanAutopilot> host_;
  Time now_;
};

// The same in real time, as an autopilot for the flight thread: each period brings the world up to
// now. The world stands still while the process was suspended.
class InProcessAutopilot : public Autopilot {
 public:
  explicit InProcessAutopilot(std::unique_ptr<SimulatedBus> bus) : bus_(std::move(bus)) {}

  void send(const std::optional<Setpoint>& setpoint, bool is_hold, Time now) override;
  [[nodiscard]] Telemetry receive(Time now) override;
  void run_until(std::int64_t steady_ns) override;
  void arm() override { bus_->host().arm(); }
  void disarm() override { bus_->host().disarm(); }
  void kill() override { bus_->host().kill(); }

 private:
  void catch_up(Time now);

  std::unique_ptr<SimulatedBus> bus_;
};

}  // namespace understory
