// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// The autopilot at the other end of a CAN bus. Setpoints leave as frames, odometry and states come
// back; after every loss of the bus the handshake begins anew. As any Autopilot: the flight thread
// alone; nothing allocates, throws or, but for run_until(), waits after construction.
#pragma once

#include <memory>

#include "understory/bridge/autopilot.hpp"
#include "understory/port/can_node.hpp"

namespace understory {

class CanAutopilot : public Autopilot, private can::FrameHandler {
 public:
  // `session`: by chance, so that what another host has sent is not ours.
  CanAutopilot(std::unique_ptr<can::CanPort> port,
               const can::HostStationConfig& config,
               std::uint16_t session);

  void send(const std::optional<Setpoint>& setpoint, bool is_hold, Time now) override;
  [[nodiscard]] Telemetry receive(Time now) override;
  void run_until(std::int64_t steady_ns) override;
  void arm() override { station_.ask_arm(); }
  void disarm() override { station_.ask_disarm(); }
  void kill() override { station_.kill(can::KillReason::kOperator); }

  // Deals with what has come in, without waiting.
  void poll();
  [[nodiscard]] can::CanNode& node() { return node_; }
  [[nodiscard]] const can::HostStation& station() const { return station_; }

 private:
  void on_frame(const can::PortFrame& frame) override;
  void on_echo(const can::PortFrame& frame) override;
  void watch_bus();

  can::CanNode node_;
  can::HostStation station_;
  std::uint64_t bus_session_;
  bool has_flown_ = false;
};

}  // namespace understory
