// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// What the vehicle may do: armed or not, and what silence, faults and wishes do to it. The safety
// part of the autopilot stand-in: no I/O, no control law; every limit that the host should keep is
// checked here again. Time-outs and conditions: docs/hil.md. The vehicle's clock; SI units. One
// thread; no allocation; cannot fail.
#pragma once

#include <cstdint>
#include <optional>

#include "understory/base/config.hpp"
#include "understory/base/rng.hpp"
#include "understory/link/wire_clock.hpp"
#include "understory/link/wire_sets.hpp"

namespace understory::can {

// Time-outs may be shortened, never lengthened.
struct SupervisorConfig {
  double late_s = 0.05;
  double hold_s = 0.25;
  double land_s = 1.0;
  double esc_zero_s = 0.1;
  double steady_s = 0.5;
  double reach_m = 1.0;
  double max_error_m = 3.0;
  double max_speed_mps = 12.0;
  double max_acceleration_mps2 = 20.0;

  void visit(FieldVisitor& f) {
    f.field("late_s", late_s, in_range(0.01, 0.05), "no setpoint for so long sets the flag LATE");
    f.field("hold_s", hold_s, in_range(0.05, 0.25), "no setpoint for so long: brake and hover");
    f.field("land_s", land_s, in_range(0.1, 1.0), "no setpoint or no host for so long: land");
    f.field("esc_zero_s",
            esc_zero_s,
            in_range(0.01, 0.1),
            "direct mode: no command for so long stops the motors");
    f.field("steady_s", steady_s, in_range(0.5, 10.0), "of setpoints without a gap before arming");
    f.field("reach_m", reach_m, in_range(0.05, 1.0), "setpoints this near arm, or end a hold");
    f.field("max_error_m", max_error_m, in_range(0.1, 3.0), "a setpoint farther off is refused");
    f.field("max_speed_mps", max_speed_mps, in_range(0.1, 12.0), "of a setpoint");
    f.field("max_acceleration_mps2", max_acceleration_mps2, in_range(0.1, 20.0), "of a setpoint");
  }
};

struct VehicleFacts {
  Vector3d position_m = Vector3d::Zero();
  bool has_sensors = true;
  bool has_escs = true;
  BattStatus battery = BattStatus::kGood;
  bool is_link_faulty = false;
  bool has_foreign_vehicle = false;
  bool is_on_ground = true;  // or still held by the launcher
  bool is_down = false;      // the landing has ended
};

[[nodiscard]] constexpr bool is_flying(State state) {
  return state == State::kArmed || state == State::kHold || state == State::kLand;
}

// What ARM_CMD must carry.
[[nodiscard]] std::uint32_t arm_token(std::uint32_t nonce, std::uint32_t session);

class Supervisor {
 public:
  Supervisor(const SupervisorConfig& config, bool is_direct, const Rng& rng);

  void on_heartbeat(const HostHb& heartbeat, Time now);
  void on_arm(const ArmCmd& command, Time now);
  void on_kill(const Kill& kill);
  // A complete set. Only what is answered with FLOWN or NOT_ARMED counts for the watchdogs.
  [[nodiscard]] AckResult on_setpoint(const WireSetpoint& wire, Time now);
  // Direct mode: whether the commands may be carried out.
  [[nodiscard]] bool on_esc_command(bool is_zero, Time now);

  // At the rate of the control law, with what is known then.
  void update(const VehicleFacts& facts, Time now);

  [[nodiscard]] State state() const { return state_; }
  [[nodiscard]] StateReason reason() const { return reason_; }
  // Without CRC and counter.
  [[nodiscard]] VehState report(Time now) const;
  // Direct mode: the newest command still holds.
  [[nodiscard]] bool is_command_fresh(Time now) const;

 private:
  [[nodiscard]] StateReason missing_for_arming(Time now) const;
  [[nodiscard]] StateReason reason_to_land(Time now) const;
  [[nodiscard]] bool is_silent(const std::optional<Time>& last, double limit_s, Time now) const;
  [[nodiscard]] bool is_steady(Time now) const;
  [[nodiscard]] bool is_flyable() const;
  void enter(State state, StateReason reason);
  void update_grounded(Time now);
  void update_flying(Time now);
  void update_steady(bool is_near, Time now);

  SupervisorConfig config_;
  bool is_direct_;
  Rng rng_;
  State state_ = State::kInit;
  StateReason reason_ = StateReason::kPowerOn;
  VehicleFacts facts_;
  std::uint32_t nonce_ = 0;
  std::optional<Time> flight_ended_;
  std::uint32_t spent_nonce_ = 0;  // of the flight that ended then
  std::uint32_t arm_seq_ = 0;

  std::optional<Time> last_heartbeat_;
  bool is_version_right_ = false;
  bool is_hash_right_ = false;
  std::optional<Time> last_set_;
  std::optional<Time> steady_since_;  // setpoints near the vehicle, without a gap
  bool was_near_ = false;
  std::optional<std::uint8_t> last_seq_;
  std::optional<Time> last_arm_;
  int arms_in_row_ = 0;
  int disarms_in_row_ = 0;
  bool is_token_wrong_ = false;
};

}  // namespace understory::can
