// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// The vehicle's side of the bus: an autopilot from frames and measured state to motor commands, and
// back to telemetry. The same code in the lockstep simulator and in the stand-in of hil/. World
// ENU, body FLU, SI units, the vehicle's own clock. One thread; no allocation after construction;
// throws ConfigError there only.
#pragma once

#include <array>

#include "understory/autopilot/control_law.hpp"
#include "understory/link/supervisor.hpp"
#include "understory/port/can_port.hpp"

namespace understory::can {

struct EscReading {
  double speed_rpm = 0.0;
  double voltage_v = 0.0;
  double current_a = 0.0;
  double temperature_celsius = 20.0;
  EscErr error = EscErr::kNone;
};

struct BatteryReading {
  BattStatus status = BattStatus::kGood;
  double voltage_v = 0.0;
  double current_a = 0.0;
  double charge_percent = 100.0;
  double time_left_s = 0.0;
};

struct VehicleReadings {
  VehicleState state;
  bool is_on_ground = true;
  bool has_sensors = true;
  std::array<EscReading, 4> escs;
  BatteryReading battery;
};

struct VehicleStationConfig {
  AirframeConfig airframe;
  ControlConfig control;
  SupervisorConfig supervisor;
  bool is_direct = false;
  double rate_hz = 100.0;  // of odometry and ESC speeds
  double hold_deceleration_mps2 = 3.0;
};

class VehicleStation {
 public:
  VehicleStation(const VehicleStationConfig& config, const Rng& rng);

  // What came from the bus, with the time it came; answers at once.
  void on_frame(const Frame& frame, Time now, FrameSink& bus);
  // A frame of ours that we have not sent.
  void on_foreign_vehicle() { has_foreign_vehicle_ = true; }

  // One step of the control law; at 500 Hz.
  [[nodiscard]] MotorCommands step(const VehicleReadings& readings, double step_s, Time now);
  // What is due of the telemetry.
  void send_due(const VehicleReadings& readings, Time now, FrameSink& bus);

  [[nodiscard]] const Supervisor& supervisor() const { return supervisor_; }
  [[nodiscard]] ControlMode control_mode() const { return law_.mode(); }
  [[nodiscard]] std::uint64_t setpoints_flown() const { return setpoints_flown_; }
  // The newest of this flight.
  [[nodiscard]] const std::optional<WireSetpoint>& flown() const { return flown_; }

 private:
  // Sends a message every so often, at times that do not depend on when it is asked.
  struct Timer {
    Duration period{};
    Time next{};
    [[nodiscard]] bool is_due(Time now);
  };

  void on_set(Time now, FrameSink& bus);
  void on_ping(const Frame& frame, Time now, FrameSink& bus);
  void on_esc_command(const Frame& frame, Time now);
  void follow_state();
  [[nodiscard]] Setpoint wanted(const VehicleState& state, Time now);
  [[nodiscard]] Setpoint braking(const VehicleState& state, Time now);
  [[nodiscard]] bool is_link_faulty() const;
  void send_fast(const VehicleReadings& readings, Time now, FrameSink& bus);
  void send_escs(const VehicleReadings& readings, Time now, FrameSink& bus);
  void send_slow(const VehicleReadings& readings, Time now, FrameSink& bus);
  template <class Message>
  void send(const Message& message, Time now, FrameSink& bus);

  VehicleStationConfig config_;
  Supervisor supervisor_;
  ControlLaw law_;
  bool has_foreign_vehicle_ = false;

  SetpointReceiver setpoints_;
  Inbox<ArmCmd> arms_;
  Inbox<HostHb> heartbeats_;
  Inbox<Ping> pings_;
  Inbox<EscCmd> esc_commands_;
  std::uint64_t bad_kills_ = 0;

  std::optional<WireSetpoint> flown_;
  Time flown_at_{};  // when it was asked for, by our clock
  struct Brake {
    Time begun{};
    VehicleState from;
  };
  std::optional<Brake> brake_;
  std::array<double, 4> direct_commands_{};
  std::uint64_t setpoints_flown_ = 0;

  std::array<Outbox, kMessages.size()> outboxes_;
  Outbox odometry_counter_;
  Timer fast_;
  Timer state_;
  Timer heartbeat_;
  Timer esc_status_;
  Timer battery_;
  Timer link_;
};

}  // namespace understory::can
