// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/sim/simulated_bus.hpp"

#include "understory/bridge/clocks.hpp"

namespace understory {
namespace {

constexpr int kBitsPerS = 1'000'000;
// Host and world share a thread: what the world did meanwhile it would do without setpoints, and
// after 250 ms of that the vehicle holds.
constexpr Duration kLongestCatchUp = std::chrono::milliseconds(100);

}  // namespace

SimulatedBus::SimulatedBus(const SimulatedVehicleConfig& vehicle,
                           const can::HostStationConfig& host,
                           const Pose& world_from_start,
                           const Rng& rng,
                           Time now)
    : bus_(kBitsPerS, rng.fork("bus")), now_(now) {
  bus_.advance(now);
  auto vehicle_port = bus_.open();
  auto host_port = bus_.open();
  can::MemoryCanPort& vehicle_end = *vehicle_port;
  host_port_ = host_port.get();
  vehicle_ =
      std::make_unique<SimulatedVehicle>(vehicle, world_from_start, rng, std::move(vehicle_port));
  host_ = std::make_unique<CanAutopilot>(
      std::move(host_port), host, static_cast<std::uint16_t>(rng.fork("session").below(1U << 16U)));
  vehicle_end.set_on_arrival([this] { vehicle_->poll(); });
  host_port_->set_on_arrival([this] { host_->poll(); });
}

void SimulatedBus::advance(Time until, const StepHook& on_step) {
  while (now_ + SimulatedVehicle::kStep <= until) {
    now_ += SimulatedVehicle::kStep;
    bus_.advance(now_);
    vehicle_->step(now_);
    vehicle_->poll();
    on_step(now_, vehicle_->state());
  }
}

void SimulatedBus::skip_to(Time now) {
  now_ = now;
  bus_.advance(now);
}

void InProcessAutopilot::catch_up(Time now) {
  if (now - bus_->now() > kLongestCatchUp) {
    bus_->skip_to(now);
  }
  bus_->advance(now, [](Time, const VehicleState&) {});
}

void InProcessAutopilot::send(const std::optional<Setpoint>& setpoint, bool is_hold, Time now) {
  catch_up(now);
  bus_->host().send(setpoint, is_hold, now);
}

Telemetry InProcessAutopilot::receive(Time now) {
  catch_up(now);
  Telemetry telemetry = bus_->host().receive(bus_->now());
  telemetry.link.acked_set = 0;  // how long a simulated bus takes says nothing of latency
  return telemetry;
}

void InProcessAutopilot::run_until(std::int64_t until_ns) {
  sleep_until(until_ns);
  catch_up(wall_time());
}

}  // namespace understory
