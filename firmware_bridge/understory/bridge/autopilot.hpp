// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// What the bridge flies: something that takes setpoints and tells where the vehicle is. World ENU,
// body FLU, SI units, wall-clock time. Called by the flight thread alone, at its rate;
// implementations must not allocate or throw, and only run_until() waits.
#pragma once

#include <cstdint>
#include <optional>

#include "understory/autopilot/control_law.hpp"
#include "understory/base/time.hpp"
#include "understory/can/messages.hpp"
#include "understory/link/host_station.hpp"

namespace understory {

// What to tell of the bus; counted since the start.
struct LinkStatus {
  can::HostState host = can::HostState::kWaiting;
  can::LinkProblem problem = can::LinkProblem::kNone;
  can::State vehicle = can::State::kInit;
  can::StateReason reason = can::StateReason::kNone;
  bool is_tx_stalled = false;
  bool is_flooded = false;
  double battery_percent = 0.0;
  Duration round_trip{};        // of the quickest PING
  std::uint64_t acked_set = 0;  // the newest setpoint that was answered, counted as sets_sent
  Time acked_sent{};            // it was on the bus, and its answer
  Time acked_received{};
  std::uint64_t sets_sent = 0;
  std::uint64_t sets_not_flown = 0;
  std::uint64_t sets_torn = 0;  // odometry that came in part
  std::uint64_t frames_lost = 0;
  std::uint64_t frames_wrong = 0;
  std::uint64_t tx_full = 0;
  std::uint64_t tx_expired = 0;
  std::uint64_t bus_reopened = 0;
  std::uint64_t sessions = 0;
};

struct Telemetry {
  Time time{};
  VehicleState state;
  bool is_valid = false;      // state is known, and fresh
  bool is_following = false;  // armed: setpoints are flown
  bool is_down = false;       // has flown and landed, motors off
  bool is_battery_low = false;
  LinkStatus link;
};

class Autopilot {
 public:
  Autopilot() = default;
  Autopilot(const Autopilot&) = delete;
  Autopilot& operator=(const Autopilot&) = delete;
  virtual ~Autopilot() = default;

  // Once per period; without a setpoint the vehicle still hears from us. `is_hold`: it is to stay.
  virtual void send(const std::optional<Setpoint>& setpoint, bool is_hold, Time now) = 0;
  // The newest there is.
  [[nodiscard]] virtual Telemetry receive(Time now) = 0;
  // Deals with what comes in, until this time of the steady clock.
  virtual void run_until(std::int64_t steady_ns) = 0;

  virtual void arm() = 0;
  // On the ground the motors stop; in flight the vehicle sets itself down where it is.
  virtual void disarm() = 0;
  // The motors stop at once, wherever it is.
  virtual void kill() = 0;
};

}  // namespace understory
