// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/link/vehicle_station.hpp"

#include <algorithm>
#include <cmath>

namespace understory::can {
namespace {

constexpr Duration kFullyExtrapolated = std::chrono::milliseconds(50);

// Sensible only for counters that are shown, not added up.
std::uint32_t capped(std::uint64_t count, std::uint32_t most) {
  return static_cast<std::uint32_t>(std::min<std::uint64_t>(count, most));
}

std::size_t index_of(std::uint16_t id) {
  std::size_t i = 0;
  while (i + 1 < kMessages.size() && kMessages[i].id != id) {
    ++i;
  }
  return i;
}

// Further than this the acceleration no longer tells anything.
Setpoint aged(const Setpoint& setpoint, Duration age) {
  const Duration first = std::clamp(age, Duration(0), kFullyExtrapolated);
  Setpoint now = extrapolated(setpoint, to_seconds(first));
  if (age > first) {
    now.acceleration_mps2.setZero();
    now = extrapolated(now, to_seconds(age - first));
  }
  return now;
}

template <class Status>
Status esc_status(const EscReading& esc);

template <>
EscStat0 esc_status(const EscReading& esc) {
  EscStat0 status;
  status.esc_idx0 = 0;
  status.esc_volt0_v = esc.voltage_v;
  status.esc_curr0_a = esc.current_a;
  status.esc_temp0_celsius = esc.temperature_celsius;
  status.esc_err0 = esc.error;
  return status;
}

template <>
EscStat1 esc_status(const EscReading& esc) {
  EscStat1 status;
  status.esc_idx1 = 1;
  status.esc_volt1_v = esc.voltage_v;
  status.esc_curr1_a = esc.current_a;
  status.esc_temp1_celsius = esc.temperature_celsius;
  status.esc_err1 = esc.error;
  return status;
}

template <>
EscStat2 esc_status(const EscReading& esc) {
  EscStat2 status;
  status.esc_idx2 = 2;
  status.esc_volt2_v = esc.voltage_v;
  status.esc_curr2_a = esc.current_a;
  status.esc_temp2_celsius = esc.temperature_celsius;
  status.esc_err2 = esc.error;
  return status;
}

template <>
EscStat3 esc_status(const EscReading& esc) {
  EscStat3 status;
  status.esc_idx3 = 3;
  status.esc_volt3_v = esc.voltage_v;
  status.esc_curr3_a = esc.current_a;
  status.esc_temp3_celsius = esc.temperature_celsius;
  status.esc_err3 = esc.error;
  return status;
}

}  // namespace

bool VehicleStation::Timer::is_due(Time now) {
  if (next == Time{}) {
    next = now;
  }
  const bool is_set_back = next - now > period;
  if (now < next && !is_set_back) {
    return false;
  }
  next += period;
  if (next <= now || is_set_back) {
    next = now + period;  // stood still in between: what was missed is not made up for
  }
  return true;
}

VehicleStation::VehicleStation(const VehicleStationConfig& config, const Rng& rng)
    : config_(config),
      supervisor_(config.supervisor, config.is_direct, rng),
      law_(config.airframe, config.control) {
  fast_.period = duration_from_seconds(1.0 / config.rate_hz);
  state_.period = std::chrono::milliseconds(20);
  heartbeat_.period = std::chrono::milliseconds(100);
  esc_status_.period = std::chrono::milliseconds(100);
  battery_.period = std::chrono::milliseconds(200);
  link_.period = std::chrono::seconds(1);
}

template <class Message>
void VehicleStation::send(const Message& message, Time now, FrameSink& bus) {
  if (const std::optional<Frame> frame =
          encode(message, outboxes_[index_of(Message::kId)].next())) {
    bus.send(*frame, now);
  }
}

void VehicleStation::on_frame(const Frame& frame, Time now, FrameSink& bus) {
  switch (frame.id) {
    case Kill::kId:
      // Each one counts, whatever its counter: it is sent once in a lifetime.
      if (const auto kill = decode<Kill>(frame)) {
        supervisor_.on_kill(kill->message);
      } else {
        ++bad_kills_;
      }
      break;
    case ArmCmd::kId:
      if (const auto command = arms_.take(frame)) {
        supervisor_.on_arm(command->message, now);
      }
      break;
    case HostHb::kId:
      if (const auto heartbeat = heartbeats_.take(frame)) {
        supervisor_.on_heartbeat(heartbeat->message, now);
      }
      break;
    case Ping::kId:
      on_ping(frame, now, bus);
      break;
    case EscCmd::kId:
      on_esc_command(frame, now);
      break;
    default:
      if (SetpointReceiver::takes(frame.id) && setpoints_.add(frame, now)) {
        on_set(now, bus);
      }
  }
}

void VehicleStation::on_ping(const Frame& frame, Time now, FrameSink& bus) {
  if (const auto ping = pings_.take(frame)) {
    Pong pong;
    pong.pong_seq = ping->message.ping_seq;
    pong.pong_t2_us = wire_time_us(now);
    pong.pong_dt_us = 0;  // it goes out in the same breath
    send(pong, now, bus);
  }
}

void VehicleStation::on_set(Time now, FrameSink& bus) {
  const std::optional<WireSetpoint> wire = setpoints_.setpoint();
  if (!wire || config_.is_direct) {
    return;
  }
  SpAck ack;
  ack.ack_result = supervisor_.on_setpoint(*wire, now);
  ack.ack_seq = wire->seq;
  ack.ack_time_us = wire_time_us(now);
  const Duration age = wire_difference(wire_time_us(now), wire->time_wire_us);
  ack.ack_delay_us = static_cast<std::uint32_t>(std::clamp<Duration::rep>(age.count(), 0, 0xFFFF));
  if (ack.ack_result == AckResult::kFlown) {
    flown_ = wire;
    flown_at_ = now - age;
    ++setpoints_flown_;
  }
  send(ack, now, bus);
}

void VehicleStation::on_esc_command(const Frame& frame, Time now) {
  const auto received = esc_commands_.take(frame);
  if (!received) {
    return;
  }
  const EscCmd& command = received->message;
  const bool is_on = command.esc_cmd_mode == EscCmdMode::kDirect;
  std::array<double, 4> wanted{command.esc_cmd0_percent,
                               command.esc_cmd1_percent,
                               command.esc_cmd2_percent,
                               command.esc_cmd3_percent};
  for (double& share : wanted) {
    share = is_on && std::isfinite(share) ? 0.01 * share : 0.0;
  }
  const bool is_zero = wanted == std::array<double, 4>{};
  direct_commands_ = supervisor_.on_esc_command(is_zero, now) ? wanted : std::array<double, 4>{};
}

bool VehicleStation::is_link_faulty() const {
  // What the host does not send in this mode has no good frames that make good for errors.
  const bool is_flight_faulty =
      config_.is_direct ? esc_commands_.check().is_faulty() : setpoints_.is_faulty();
  return is_flight_faulty || arms_.check().is_faulty() || heartbeats_.check().is_faulty();
}

void VehicleStation::follow_state() {
  switch (supervisor_.state()) {
    case State::kArmed:
    case State::kHold:
      law_.set_mode(ControlMode::kTrack);
      break;
    case State::kLand:
      // On the ground the law ends by itself; it must not begin anew.
      if (law_.mode() == ControlMode::kTrack) {
        law_.set_mode(ControlMode::kLand);
      }
      break;
    default:
      law_.set_mode(ControlMode::kIdle);
      flown_.reset();
  }
  if (supervisor_.state() != State::kHold) {
    brake_.reset();
  }
}

Setpoint VehicleStation::braking(const VehicleState& state, Time now) {
  if (!brake_) {
    brake_ = Brake{now, state};
  }
  const Vector3d& velocity_mps = brake_->from.velocity_mps;
  const double speed_mps = velocity_mps.norm();
  const double stop_s = speed_mps / config_.hold_deceleration_mps2;
  const double time_s = std::min(to_seconds(now - brake_->begun), stop_s);
  const bool is_stopping = time_s < stop_s;
  const Vector3d along = speed_mps > 0.0 ? Vector3d(velocity_mps / speed_mps) : Vector3d::Zero();
  Setpoint setpoint;
  const double path_m = speed_mps * time_s - 0.5 * config_.hold_deceleration_mps2 * time_s * time_s;
  setpoint.position_m = brake_->from.position_m + path_m * along;
  if (is_stopping) {
    setpoint.velocity_mps = (speed_mps - config_.hold_deceleration_mps2 * time_s) * along;
    setpoint.acceleration_mps2 = -config_.hold_deceleration_mps2 * along;
  }
  setpoint.yaw_rad = yaw_of(brake_->from.world_from_body);
  return setpoint;
}

Setpoint VehicleStation::wanted(const VehicleState& state, Time now) {
  if (supervisor_.state() == State::kHold) {
    return braking(state, now);
  }
  if (flown_) {
    return aged(flown_->setpoint, now - flown_at_);
  }
  Setpoint stay;
  stay.position_m = state.position_m;
  stay.yaw_rad = yaw_of(state.world_from_body);
  return stay;
}

MotorCommands VehicleStation::step(const VehicleReadings& readings, double step_s, Time now) {
  VehicleFacts facts;
  facts.position_m = readings.state.position_m;
  facts.has_sensors = readings.has_sensors;
  facts.has_escs = std::all_of(readings.escs.begin(), readings.escs.end(), [](const auto& esc) {
    return esc.error != EscErr::kFailed;
  });
  facts.battery = readings.battery.status;
  facts.is_link_faulty = is_link_faulty();
  facts.has_foreign_vehicle = has_foreign_vehicle_;
  facts.is_on_ground = readings.is_on_ground;
  facts.is_down = law_.mode() == ControlMode::kIdle;
  supervisor_.update(facts, now);
  follow_state();
  if (config_.is_direct) {
    return supervisor_.is_command_fresh(now) ? direct_commands_ : MotorCommands{};
  }
  return law_.update(readings.state, wanted(readings.state, now), step_s);
}

void VehicleStation::send_due(const VehicleReadings& readings, Time now, FrameSink& bus) {
  if (fast_.is_due(now)) {
    send_fast(readings, now, bus);
  }
  if (esc_status_.is_due(now)) {
    send_escs(readings, now, bus);
  }
  send_slow(readings, now, bus);
}

void VehicleStation::send_fast(const VehicleReadings& readings, Time now, FrameSink& bus) {
  WireOdometry odometry;
  odometry.state = readings.state;
  odometry.quality = readings.has_sensors ? OdoQuality::kGood : OdoQuality::kInvalid;
  odometry.time_wire_us = wire_time_us(now);
  if (const auto frames = encode_odometry(odometry, odometry_counter_.next())) {
    for (const Frame& frame : *frames) {
      bus.send(frame, now);
    }
  }
  const auto& escs = readings.escs;
  EscRpm speeds;
  speeds.esc_rpm0_rpm = escs[0].speed_rpm;
  speeds.esc_rpm1_rpm = escs[1].speed_rpm;
  speeds.esc_rpm2_rpm = escs[2].speed_rpm;
  speeds.esc_rpm3_rpm = escs[3].speed_rpm;
  for (std::uint32_t i = 0; i < escs.size(); ++i) {
    speeds.esc_ok_mask |= escs[i].error != EscErr::kFailed ? 1U << i : 0U;
  }
  send(speeds, now, bus);
}

void VehicleStation::send_escs(const VehicleReadings& readings, Time now, FrameSink& bus) {
  send(esc_status<EscStat0>(readings.escs[0]), now, bus);
  send(esc_status<EscStat1>(readings.escs[1]), now, bus);
  send(esc_status<EscStat2>(readings.escs[2]), now, bus);
  send(esc_status<EscStat3>(readings.escs[3]), now, bus);
}

void VehicleStation::send_slow(const VehicleReadings& readings, Time now, FrameSink& bus) {
  if (state_.is_due(now)) {
    send(supervisor_.report(now), now, bus);
  }
  if (heartbeat_.is_due(now)) {
    VehHb heartbeat;
    const State state = supervisor_.state();
    const bool is_bad = state == State::kFault || state == State::kKilled;
    const bool is_odd = is_link_faulty() || readings.battery.status != BattStatus::kGood;
    heartbeat.veh_health = is_bad   ? VehHealth::kFault
                           : is_odd ? VehHealth::kWarning
                                    : VehHealth::kGood;
    heartbeat.veh_proto_major = kProtocolMajor;
    heartbeat.veh_proto_minor = kProtocolMinor;
    heartbeat.veh_dbc_hash = kDbcHash;
    heartbeat.veh_uptime_s =
        static_cast<std::uint32_t>(now.time_since_epoch() / std::chrono::seconds(1)) & 0xFFFFU;
    send(heartbeat, now, bus);
  }
  if (battery_.is_due(now)) {
    Battery battery;
    battery.batt_status = readings.battery.status;
    battery.batt_volt_v = readings.battery.voltage_v;
    battery.batt_curr_a = readings.battery.current_a;
    battery.batt_soc_percent = readings.battery.charge_percent;
    battery.batt_time_left_s = std::min(readings.battery.time_left_s, 2540.0);
    send(battery, now, bus);
  }
  if (link_.is_due(now)) {
    const LinkCounters counters = setpoints_.counters();
    VehLink link;
    link.vl_rx_ok = static_cast<std::uint32_t>(counters.good & 0xFFFFU);
    link.vl_crc_err = capped(counters.errors + bad_kills_, 0xFF);
    link.vl_lost = capped(counters.lost, 0xFF);
    link.vl_torn = capped(setpoints_.assembly().torn(), 0xFF);
    send(link, now, bus);
  }
}

}  // namespace understory::can
