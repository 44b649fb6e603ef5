// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// A supervisor and a host that does all that is needed to arm and to fly, but for what a test takes
// away. Steps of 2 ms of the vehicle's clock; setpoints every 10 ms, heartbeats and ARM_CMD every
// 100 ms. SI units.
#pragma once

#include <optional>

#include "understory/link/supervisor.hpp"

namespace understory::test {

struct SupervisorBench {
  static constexpr Duration kStep = std::chrono::milliseconds(2);

  explicit SupervisorBench(bool is_in_direct_mode = false,
                           const can::SupervisorConfig& config = {},
                           std::uint64_t seed = 1)
      : supervisor(config, is_in_direct_mode, Rng(seed)), is_direct(is_in_direct_mode) {
    facts.position_m = {3.0, -2.0, 1.5};
    wire.setpoint.position_m = facts.position_m;
    heartbeat.host_proto_major = can::kProtocolMajor;
    heartbeat.host_dbc_hash = can::kDbcHash;
    supervisor.update(facts, now);
  }

  [[nodiscard]] std::uint32_t nonce() const { return supervisor.report(now).state_nonce; }
  [[nodiscard]] bool is_armed() const { return supervisor.state() == can::State::kArmed; }

  void send_arm(can::ArmRequest wish) {
    can::ArmCmd command;
    command.arm_request = wish;
    command.arm_session = session;
    command.arm_token = token.value_or(can::arm_token(nonce(), session));
    supervisor.on_arm(command, now);
  }
  [[nodiscard]] can::AckResult send_setpoint() {
    wire.seq = static_cast<std::uint8_t>(wire.seq + 1U);
    wire.time_wire_us = can::wire_time_us(now);
    ++setpoints;
    return supervisor.on_setpoint(wire, now);
  }
  void send_esc_command(bool is_standstill) {
    is_output_on = supervisor.on_esc_command(is_standstill, now);
    ++setpoints;
  }

  void step() {
    now += kStep;
    if (has_heartbeat && now >= next_heartbeat) {
      next_heartbeat = now + std::chrono::milliseconds(100);
      supervisor.on_heartbeat(heartbeat, now);
    }
    if (has_setpoints && now >= next_setpoint) {
      next_setpoint = now + std::chrono::milliseconds(10);
      if (is_direct) {
        send_esc_command(is_zero);
      } else {
        last_ack = send_setpoint();
      }
    }
    if (request && now >= next_arm) {
      next_arm = now + std::chrono::milliseconds(100);
      send_arm(*request);
    }
    supervisor.update(facts, now);
  }
  void run(Duration duration) {
    for (const Time end = now + duration; now < end;) {
      step();
    }
  }
  // How long until it is no longer in this state; nothing if it still is then.
  [[nodiscard]] std::optional<Duration> leaves(can::State state, Duration at_most) {
    for (const Time begin = now; now < begin + at_most;) {
      step();
      if (supervisor.state() != state) {
        return now - begin;
      }
    }
    return std::nullopt;
  }
  // In flight.
  [[nodiscard]] bool take_off() {
    request = can::ArmRequest::kArm;
    run(std::chrono::seconds(1));
    request.reset();
    facts.is_on_ground = false;
    step();
    return is_armed();
  }

  can::Supervisor supervisor;
  bool is_direct;
  can::VehicleFacts facts;
  Time now{std::chrono::hours(7)};
  std::uint16_t session = 77;
  can::HostHb heartbeat;
  can::WireSetpoint wire;                  // position, velocity; the rest is filled in
  std::optional<can::ArmRequest> request;  // what is sent, if anything
  std::optional<std::uint32_t> token;      // in place of the right one
  bool has_heartbeat = true;
  bool has_setpoints = true;
  bool is_zero = true;  // of commands in direct mode
  bool is_output_on = false;
  int setpoints = 0;
  can::AckResult last_ack = can::AckResult::kUnsupported;
  Time next_heartbeat{};
  Time next_setpoint{};
  Time next_arm{};
};

}  // namespace understory::test
