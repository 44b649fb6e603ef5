// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/nodelets/autopilot_setup.hpp"

#include <random>

#include "understory/bridge/clocks.hpp"
#include "understory/port/candump_writer.hpp"
#include "understory/port/socket_can_port.hpp"
#include "understory/sim/mission_record.hpp"
#include "understory/sim/simulated_bus.hpp"

namespace understory {
namespace {

constexpr const char* kMemory = "memory";

void log_frames(const BusConfig& bus, can::CanNode& node) {
  if (!bus.log_file.empty()) {
    can::CandumpLogConfig log;
    log.path = bus.log_file;
    log.interface = bus.interface;
    node.set_tap(std::make_shared<can::CandumpWriter>(log));
  }
}

std::unique_ptr<Autopilot> can_autopilot(const BusConfig& bus) {
  can::IdSet ids;
  for (const can::MessageInfo& message : can::kMessages) {
    ids[message.id] = true;
  }
  // No seed: two hosts must not have the same number.
  std::random_device chance;
  auto autopilot =
      std::make_unique<CanAutopilot>(std::make_unique<can::SocketCanPort>(bus.interface, ids),
                                     bus.link,
                                     static_cast<std::uint16_t>(chance()));
  log_frames(bus, autopilot->node());
  return autopilot;
}

}  // namespace

std::unique_ptr<Autopilot> make_autopilot(const FlightSetup& setup) {
  const BusConfig& bus = setup.onboard.bus;
  if (bus.interface != kMemory) {
    return can_autopilot(bus);
  }
  const World world = World::of_vehicle(setup.config, setup.seed);
  auto simulated = std::make_unique<SimulatedBus>(vehicle_of(world.config),
                                                  bus.link,
                                                  world_from_start(world.config.scene.start),
                                                  Rng(setup.seed),
                                                  wall_time());
  log_frames(bus, simulated->host().node());
  return std::make_unique<InProcessAutopilot>(std::move(simulated));
}

}  // namespace understory
