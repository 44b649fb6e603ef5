// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include <benchmark/benchmark.h>

#include "understory/autopilot/control_law.hpp"
#include "understory/sim/vehicle.hpp"

namespace understory {
namespace {

constexpr double kStepS = 0.002;

// One step of law and vehicle together, hovering in gusty wind: what lockstep pays 500 times a
// second.
void controlled_step(benchmark::State& state) {
  VehicleConfig config;
  config.wind = {3.0, 0.0, 0.75, 2.0};
  Vehicle vehicle(config, {0.0, 0.0, 1.0}, 0.0, Rng(1));
  ControlLaw law(config.airframe, ControlConfig{});
  law.set_mode(ControlMode::kTrack);
  Setpoint setpoint;
  setpoint.position_m = {0.0, 0.0, 1.0};
  while (state.KeepRunning()) {
    vehicle.step(law.update(vehicle.state(), setpoint, kStepS), kStepS);
  }
  benchmark::DoNotOptimize(vehicle.state().position_m.x());
}
BENCHMARK(controlled_step)->Name("Vehicle_ControlledStep/gusts");

void step(benchmark::State& state) {
  VehicleConfig config;
  Vehicle vehicle(config, {0.0, 0.0, 1000.0}, 0.0, Rng(1));
  const MotorCommands commands = {0.4, 0.4, 0.4, 0.4};
  while (state.KeepRunning()) {
    vehicle.step(commands, kStepS);
  }
  benchmark::DoNotOptimize(vehicle.state().position_m.x());
}
BENCHMARK(step)->Name("Vehicle_Step/calm");

}  // namespace
}  // namespace understory
