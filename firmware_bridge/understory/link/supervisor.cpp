// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/link/supervisor.hpp"

#include <algorithm>

#include "understory/can/crc.hpp"

namespace understory::can {
namespace {

constexpr int kCommandsInRow = 3;
constexpr double kArmGapS = 0.5;
constexpr Duration kMaxSetpointAge = std::chrono::milliseconds(100);
constexpr Duration kMaxSetpointLead = std::chrono::milliseconds(20);
constexpr unsigned kMaxSeqStep = 127;
constexpr std::uint32_t kNonces = 1U << 16U;

std::uint8_t byte_of(std::uint32_t value, unsigned index) {
  return static_cast<std::uint8_t>((value >> (8U * index)) & 0xFFU);
}

}  // namespace

std::uint32_t arm_token(std::uint32_t nonce, std::uint32_t session) {
  const std::array<std::uint8_t, 8> text{byte_of(nonce, 0),
                                         byte_of(nonce, 1),
                                         byte_of(session, 0),
                                         byte_of(session, 1),
                                         'A',
                                         'R',
                                         'M',
                                         '1'};
  return crc32c(text.data(), text.size());
}

Supervisor::Supervisor(const SupervisorConfig& config, bool is_direct, const Rng& rng)
    : config_(config), is_direct_(is_direct), rng_(rng) {}

bool Supervisor::is_silent(const std::optional<Time>& last, double limit_s, Time now) const {
  return !last || now - *last >= duration_from_seconds(limit_s);
}

bool Supervisor::is_steady(Time now) const {
  return steady_since_ && is_silent(steady_since_, config_.steady_s, now);
}

bool Supervisor::is_flyable() const {
  return facts_.has_sensors && facts_.has_escs && !facts_.has_foreign_vehicle;
}

void Supervisor::on_heartbeat(const HostHb& heartbeat, Time now) {
  last_heartbeat_ = now;
  is_version_right_ = heartbeat.host_proto_major == kProtocolMajor;
  is_hash_right_ = heartbeat.host_dbc_hash == kDbcHash;
}

void Supervisor::on_arm(const ArmCmd& command, Time now) {
  if (is_silent(last_arm_, kArmGapS, now)) {
    arms_in_row_ = disarms_in_row_ = 0;
  }
  const bool is_wanted = command.arm_request == ArmRequest::kArm;
  if (is_wanted && !is_silent(flight_ended_, kArmGapS, now) &&
      command.arm_token == arm_token(spent_nonce_, command.arm_session)) {
    return;  // of a host that has not heard yet that the flight is over
  }
  last_arm_ = now;
  is_token_wrong_ = is_wanted && command.arm_token != arm_token(nonce_, command.arm_session);
  const bool is_disarming = command.arm_request == ArmRequest::kDisarm;
  arms_in_row_ = is_wanted && !is_token_wrong_ ? std::min(arms_in_row_ + 1, kCommandsInRow) : 0;
  disarms_in_row_ = is_disarming ? std::min(disarms_in_row_ + 1, kCommandsInRow) : 0;
}

void Supervisor::on_kill(const Kill& kill) {
  if (kill.kill_magic == KillMagic::kMagic) {
    enter(State::kKilled, StateReason::kKill);
  }
}

void Supervisor::update_steady(bool is_near, Time now) {
  if (!is_near) {
    steady_since_.reset();
  } else if (!steady_since_ || is_silent(last_set_, config_.hold_s, now)) {
    steady_since_ = now;
  }
  was_near_ = is_near;
  last_set_ = now;
}

AckResult Supervisor::on_setpoint(const WireSetpoint& wire, Time now) {
  if (wire.mask != SpMask::kAll || wire.frame != SpXyFrame::kMap ||
      (wire.mode != SpMode::kTrack && wire.mode != SpMode::kHold)) {
    return AckResult::kUnsupported;
  }
  const Duration age = wire_difference(wire_time_us(now), wire.time_wire_us);
  if (age > kMaxSetpointAge || age < -kMaxSetpointLead) {
    return AckResult::kStale;
  }
  // After a silence a host that has started anew counts from anywhere.
  const unsigned step = last_seq_ ? (wire.seq - *last_seq_) & 0xFFU : 1U;
  if ((step == 0 || step > kMaxSeqStep) && !is_silent(last_set_, config_.hold_s, now)) {
    return AckResult::kSequence;
  }
  const double error_m = (wire.setpoint.position_m - facts_.position_m).norm();
  // Written so that what is not a number keeps no limit.
  if (!(wire.setpoint.velocity_mps.norm() <= config_.max_speed_mps) ||
      !(wire.setpoint.acceleration_mps2.norm() <= config_.max_acceleration_mps2) ||
      (state_ == State::kArmed && !(error_m <= config_.max_error_m))) {
    return AckResult::kLimits;
  }
  last_seq_ = wire.seq;
  const bool is_near = error_m <= config_.reach_m;
  if (state_ == State::kHold && !is_near) {
    return AckResult::kLimits;
  }
  if (state_ == State::kLand || state_ == State::kKilled ||
      (state_ == State::kHold && facts_.is_link_faulty)) {
    return AckResult::kOverruled;
  }
  update_steady(is_near, now);
  if (state_ == State::kHold) {
    enter(State::kArmed, StateReason::kNone);
  }
  return state_ == State::kArmed ? AckResult::kFlown : AckResult::kNotArmed;
}

bool Supervisor::on_esc_command(bool is_zero, Time now) {
  if (!is_direct_) {
    return false;
  }
  // To be armed, and after a silence, motors start from a standstill.
  const bool is_restart = is_silent(last_set_, config_.esc_zero_s, now);
  if (state_ == State::kArmed && is_restart && !is_zero) {
    return false;
  }
  update_steady(is_zero, now);
  return state_ == State::kArmed;
}

bool Supervisor::is_command_fresh(Time now) const {
  return state_ == State::kArmed && !is_silent(last_set_, config_.esc_zero_s, now);
}

// In the order in which someone would mend it.
StateReason Supervisor::missing_for_arming(Time now) const {
  if (facts_.has_foreign_vehicle) {
    return StateReason::kArmForeignVehicle;
  }
  if (!facts_.has_sensors) {
    return StateReason::kArmSensors;
  }
  if (!facts_.has_escs) {
    return StateReason::kArmEsc;
  }
  if (facts_.battery != BattStatus::kGood) {
    return StateReason::kArmBattery;
  }
  if (is_silent(last_heartbeat_, config_.land_s, now)) {
    return StateReason::kArmNoHeartbeat;
  }
  if (!is_version_right_) {
    return StateReason::kArmVersion;
  }
  if (!is_hash_right_) {
    return StateReason::kArmDbcHash;
  }
  if (facts_.is_link_faulty) {
    return StateReason::kArmLinkFault;
  }
  if (is_token_wrong_) {
    return StateReason::kArmToken;
  }
  if (is_silent(last_set_, config_.hold_s, now)) {
    return StateReason::kArmNoSetpoints;
  }
  if (!was_near_) {
    return is_direct_ ? StateReason::kArmThrottle : StateReason::kArmSetpointFar;
  }
  return is_steady(now) ? StateReason::kNone : StateReason::kArmNoSetpoints;
}

StateReason Supervisor::reason_to_land(Time now) const {
  if (disarms_in_row_ == kCommandsInRow) {
    return StateReason::kHostRequest;
  }
  if (!facts_.has_sensors) {
    return StateReason::kSensors;
  }
  if (!facts_.has_escs) {
    return StateReason::kEsc;
  }
  if (facts_.battery == BattStatus::kEmpty) {
    return StateReason::kBattery;
  }
  if (facts_.has_foreign_vehicle) {
    return StateReason::kForeignVehicle;
  }
  if (is_silent(last_heartbeat_, config_.land_s, now)) {
    return StateReason::kHostSilence;
  }
  if (is_silent(last_set_, config_.land_s, now)) {
    return is_direct_ ? StateReason::kEscCmdSilence : StateReason::kSetpointSilence;
  }
  return StateReason::kNone;
}

void Supervisor::enter(State state, StateReason reason) {
  const bool is_disarming = state == State::kDisarmed && state_ != State::kArming;
  if (is_disarming) {
    // What armed it once must not arm it again, so chance may not choose the same number twice.
    nonce_ = (nonce_ + 1U + static_cast<std::uint32_t>(rng_.below(kNonces - 1U))) % kNonces;
  }
  if (is_disarming || state == State::kKilled) {
    arms_in_row_ = 0;
    steady_since_.reset();
  }
  state_ = state;
  reason_ = reason;
}

void Supervisor::update_grounded(Time now) {
  const bool is_asked = arms_in_row_ > 0 || is_token_wrong_;
  if (!is_asked || is_silent(last_arm_, kArmGapS, now)) {
    if (state_ == State::kArming) {
      enter(State::kDisarmed, StateReason::kNone);
    }
    return;
  }
  const StateReason missing = missing_for_arming(now);
  if (missing == StateReason::kNone && arms_in_row_ == kCommandsInRow) {
    ++arm_seq_;
    enter(State::kArmed, StateReason::kNone);
  } else {
    enter(State::kArming, missing);
  }
}

void Supervisor::update_flying(Time now) {
  const StateReason landing = reason_to_land(now);
  if (landing != StateReason::kNone) {
    // Without an autopilot nobody could land it: the motors stop.
    const bool is_disarmed = facts_.is_on_ground || is_direct_;
    enter(is_disarmed ? State::kDisarmed : State::kLand, landing);
  } else if (is_direct_) {
    return;  // is_command_fresh() stops the motors
  } else if (facts_.is_link_faulty) {
    enter(State::kHold, StateReason::kLinkFault);
  } else if (state_ == State::kArmed && is_silent(last_set_, config_.hold_s, now)) {
    enter(State::kHold, StateReason::kSetpointSilence);
  }
}

void Supervisor::update(const VehicleFacts& facts, Time now) {
  facts_ = facts;
  const bool was_flying = is_flying(state_);
  const std::uint32_t nonce = nonce_;
  switch (state_) {
    case State::kInit:
      enter(State::kDisarmed, StateReason::kPowerOn);
      break;
    case State::kFault:
    case State::kDisarmed:
    case State::kArming:
      if (!is_flyable() && state_ != State::kFault) {
        enter(State::kFault, missing_for_arming(now));
      } else if (is_flyable() && state_ == State::kFault) {
        enter(State::kDisarmed, StateReason::kNone);
      } else if (state_ != State::kFault) {
        update_grounded(now);
      }
      break;
    case State::kArmed:
    case State::kHold:
      update_flying(now);
      break;
    case State::kLand:
      if (facts.is_down) {
        enter(State::kDisarmed, StateReason::kLanded);
      }
      break;
    case State::kKilled:
      break;  // until it is switched off and on
  }
  if (was_flying && !is_flying(state_)) {
    flight_ended_ = now;
    spent_nonce_ = nonce;
  }
}

VehState Supervisor::report(Time now) const {
  VehState report;
  report.state = state_;
  report.state_reason = reason_;
  report.state_arm_seq = arm_seq_ & 0xFFU;
  report.state_nonce = nonce_;
  report.flag_late = is_silent(last_set_, config_.late_s, now);
  report.flag_setpoints = !is_silent(last_set_, config_.hold_s, now) && is_steady(now);
  report.flag_host = !is_silent(last_heartbeat_, config_.land_s, now);
  report.flag_sensors = !facts_.has_sensors;
  report.flag_batt_low = facts_.battery == BattStatus::kLow;
  report.flag_batt_empty = facts_.battery == BattStatus::kEmpty;
  report.flag_esc_failed = !facts_.has_escs;
  report.flag_link_fault = facts_.is_link_faulty;
  report.flag_on_ground = facts_.is_on_ground;
  report.flag_direct = is_direct_;
  report.flag_foreign = facts_.has_foreign_vehicle;
  return report;
}

}  // namespace understory::can
