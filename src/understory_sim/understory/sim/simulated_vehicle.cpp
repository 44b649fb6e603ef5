// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/sim/simulated_vehicle.hpp"

#include "understory/link/node_configs.hpp"

namespace understory {
namespace {

can::VehicleStationConfig station_config(const SimulatedVehicleConfig& config) {
  can::VehicleStationConfig station;
  station.airframe = config.vehicle.airframe;
  station.control = config.control;
  station.supervisor = config.supervisor;
  station.is_direct = config.is_direct;
  station.rate_hz = config.telemetry_rate_hz;
  return station;
}

}  // namespace

SimulatedVehicle::SimulatedVehicle(const SimulatedVehicleConfig& config,
                                   const Pose& world_from_start,
                                   const Rng& rng,
                                   std::unique_ptr<can::CanPort> port)
    : config_(config),
      node_(std::move(port), can::vehicle_node_config()),
      vehicle_(config.vehicle,
               world_from_start.translation(),
               yaw_of(Eigen::Quaterniond(world_from_start.linear())),
               rng.fork("wind")),
      odometry_(config.odometry_noise, rng.fork("odometry")),
      power_(config.power, config.vehicle.airframe.max_motor_thrust_n),
      station_(station_config(config), rng.fork("autopilot")) {
  vehicle_.hang_in_launcher();
}

void SimulatedVehicle::fail_esc(std::size_t index) {
  has_failed_[index] = true;
  power_.fail_esc(index);
}

void SimulatedVehicle::restart_autopilot(const Rng& rng) {
  station_ = can::VehicleStation(station_config(config_), rng);
}

can::VehicleReadings SimulatedVehicle::readings() const {
  can::VehicleReadings readings;
  readings.state = odometry();
  readings.is_on_ground = vehicle_.on_ground();
  readings.has_sensors = has_sensors_;
  readings.escs = power_.escs();
  readings.battery = power_.battery();
  return readings;
}

void SimulatedVehicle::on_frame(const can::PortFrame& frame) {
  station_.on_frame(frame.frame, frame.stamp, node_);
}

void SimulatedVehicle::step(Time now) {
  const double step_s = to_seconds(kStep);
  if (node_.counters().foreign_own_ids > 0) {
    station_.on_foreign_vehicle();
  }
  MotorCommands commands = station_.step(readings(), step_s, now);
  for (std::size_t i = 0; i < commands.size(); ++i) {
    commands[i] = has_failed_[i] ? 0.0 : commands[i];
  }
  vehicle_.step(commands, step_s);
  odometry_.step(step_s);
  power_.step(vehicle_.motor_thrusts_n(), step_s);
  station_.send_due(readings(), now, node_);
}

}  // namespace understory
