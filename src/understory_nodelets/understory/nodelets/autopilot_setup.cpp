// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/nodelets/autopilot_setup.hpp"

#include "understory/bridge/clocks.hpp"
#include "understory/sim/mission_record.hpp"
#include "understory/sim/simulated_bus.hpp"

namespace understory {

std::unique_ptr<Autopilot> make_autopilot(const FlightSetup& setup) {
  const BusConfig& bus = setup.onboard.bus;
  const World world(setup.config, setup.seed);
  return std::make_unique<InProcessAutopilot>(
      std::make_unique<SimulatedBus>(vehicle_of(world.config),
                                     bus.link,
                                     world_from_start(world.config.scene.start),
                                     Rng(setup.seed),
                                     wall_time()));
}

}  // namespace understory
