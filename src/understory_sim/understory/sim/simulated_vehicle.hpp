// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// A whole vehicle on the bus: rigid body, ESCs, battery, and the autopilot behind its frames. The
// lockstep simulator steps it by the virtual clock, the stand-in of hil/ by the real one. It hangs
// in a launcher where it starts above ground; that lets go once the motors carry it. World ENU, SI
// units; times are of the vehicle's clock. One thread; no allocation after construction, which
// throws ConfigError on wrong configuration.
#pragma once

#include <functional>
#include <memory>

#include "understory/port/can_node.hpp"
#include "understory/sim/odometry_noise.hpp"
#include "understory/sim/power_train.hpp"
#include "understory/sim/vehicle.hpp"

namespace understory {

struct SimulatedVehicleConfig {
  VehicleConfig vehicle;
  ControlConfig control;
  PowerConfig power;
  can::SupervisorConfig supervisor;
  OdometryNoiseConfig odometry_noise;
  double telemetry_rate_hz = 100.0;
  bool is_direct = false;  // no autopilot between host and ESCs
};

class SimulatedVehicle : private can::FrameHandler {
 public:
  static constexpr Duration kStep = std::chrono::milliseconds(2);

  // `rng`: of the wind, of the odometry's errors and of the autopilot's chance.
  SimulatedVehicle(const SimulatedVehicleConfig& config,
                   const Pose& world_from_start,
                   const Rng& rng,
                   std::unique_ptr<can::CanPort> port);
  SimulatedVehicle(const SimulatedVehicle&) = delete;
  SimulatedVehicle& operator=(const SimulatedVehicle&) = delete;
  ~SimulatedVehicle() override = default;

  // Handles what has come on the bus by now.
  void poll() { node_.poll(*this); }
  // Likewise, and waits for more until then.
  void run_until(Time now, Time until) { node_.run_until(now, until, *this); }
  // One step of the world of kStep, that ends now. What telemetry is due leaves with the next
  // poll() or run_until().
  void step(Time now);

  // Faults for tests.
  void lose_sensors() { has_sensors_ = false; }
  void drain_battery(double charge_percent) { power_.drain(charge_percent); }
  void fail_esc(std::size_t index);
  // As after its power was off for a moment; the world goes on.
  void restart_autopilot(const Rng& rng);

  [[nodiscard]] const VehicleState& state() const { return vehicle_.state(); }
  // What the vehicle takes its state to be.
  [[nodiscard]] VehicleState odometry() const { return odometry_.measured(vehicle_.state()); }
  [[nodiscard]] const can::VehicleStation& station() const { return station_; }
  [[nodiscard]] const PowerTrain& power() const { return power_; }
  [[nodiscard]] can::CanNode& node() { return node_; }

 private:
  void on_frame(const can::PortFrame& frame) override;
  [[nodiscard]] can::VehicleReadings readings() const;

  SimulatedVehicleConfig config_;
  can::CanNode node_;
  Vehicle vehicle_;
  OdometryNoise odometry_;
  PowerTrain power_;
  can::VehicleStation station_;
  std::array<bool, 4> has_failed_{};
  bool has_sensors_ = true;
};

}  // namespace understory
