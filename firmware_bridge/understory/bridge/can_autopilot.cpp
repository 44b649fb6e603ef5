// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/bridge/can_autopilot.hpp"

#include "understory/bridge/clocks.hpp"
#include "understory/link/node_configs.hpp"

namespace understory {

CanAutopilot::CanAutopilot(std::unique_ptr<can::CanPort> port,
                           const can::HostStationConfig& config,
                           std::uint16_t session)
    : node_(std::move(port), can::host_node_config()),
      station_(config, session),
      bus_session_(node_.port().session()) {}

void CanAutopilot::on_frame(const can::PortFrame& frame) {
  station_.on_frame(frame.frame, frame.stamp);
}

void CanAutopilot::on_echo(const can::PortFrame& frame) {
  station_.on_sent(frame.frame, frame.stamp);
}

void CanAutopilot::watch_bus() {
  const std::uint64_t bus_session = node_.port().session();
  if (bus_session != bus_session_) {
    bus_session_ = bus_session;
    station_.begin_session();
  }
  station_.set_bus(node_.port().state() == can::PortState::kUp);
  if (node_.counters().foreign_own_ids > 0) {
    station_.on_other_host();
  }
}

void CanAutopilot::send(const std::optional<Setpoint>& setpoint, bool is_hold, Time now) {
  watch_bus();
  station_.tick(setpoint, is_hold ? can::SpMode::kHold : can::SpMode::kTrack, now, node_);
  poll();
}

void CanAutopilot::poll() {
  node_.poll(*this);
}

void CanAutopilot::run_until(std::int64_t until_ns) {
  std::int64_t left_us = (until_ns - steady_ns()) / 1000;
  while (left_us > 0) {
    const Time now = wall_time();
    node_.run_until(now, now + Duration(left_us), *this);
    left_us = (until_ns - steady_ns()) / 1000;
  }
}

Telemetry CanAutopilot::receive(Time now) {
  Telemetry telemetry;
  LinkStatus& link = telemetry.link;
  link.host = station_.state(now);
  link.problem = station_.problem(now);
  if (const auto& odometry = station_.odometry()) {
    telemetry.time = odometry->time;
    telemetry.state = odometry->state;
  }
  telemetry.is_valid = station_.is_odometry_valid(now);
  telemetry.is_following = link.host == can::HostState::kFlying;
  has_flown_ = has_flown_ || telemetry.is_following;
  if (const auto& vehicle = station_.vehicle()) {
    link.vehicle = vehicle->state;
    link.reason = vehicle->state_reason;
    telemetry.is_down = has_flown_ && vehicle->state == can::State::kDisarmed;
    telemetry.is_battery_low = vehicle->flag_batt_low || vehicle->flag_batt_empty;
  }
  if (const auto& battery = station_.battery()) {
    link.battery_percent = battery->batt_soc_percent;
  }
  if (const auto& ack = station_.last_ack()) {
    link.acked_set = ack->set;
    link.acked_sent = ack->sent;
    link.acked_received = ack->received;
  }
  link.round_trip = station_.clock().round_trip().value_or(Duration(0));
  const can::HostStation::Counters counters = station_.counters();
  link.sets_sent = counters.sets_sent;
  link.sets_not_flown = counters.sets_not_flown;
  link.sets_torn = counters.odometry_torn;
  link.frames_lost = counters.frames.lost;
  link.frames_wrong = counters.frames.errors + counters.frames.wrong_sequence;
  link.sessions = counters.sessions;
  link.is_tx_stalled = node_.is_stalled();
  link.is_flooded = node_.is_flooded();
  link.tx_full = node_.queue().counters().full;
  link.tx_expired = node_.queue().counters().expired;
  link.bus_reopened = node_.port().counters().reopened;
  return telemetry;
}

}  // namespace understory
