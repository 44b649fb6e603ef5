// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/link/host_station.hpp"

#include <algorithm>

#include "understory/link/supervisor.hpp"

namespace understory::can {
namespace {

constexpr double kCommandPeriodS = 0.1;
constexpr double kPingPeriodS = 0.2;
constexpr double kLinkPeriodS = 1.0;
// A restart or a disarming changes the nonce once; two vehicles change it all the time.
constexpr int kMostNonceChanges = 5;
constexpr double kNonceWindowS = 1.0;

bool is_due(std::optional<Time>& last, double period_s, Time now) {
  // Wall clocks are set back while they run.
  if (last && now >= *last && now - *last < duration_from_seconds(period_s)) {
    return false;
  }
  last = now;
  return true;
}

}  // namespace

const char* to_string(LinkProblem problem) {
  switch (problem) {
    case LinkProblem::kNone:
      return "none";
    case LinkProblem::kNoVehicle:
      return "no vehicle heard on the bus";
    case LinkProblem::kLost:
      return "the vehicle has fallen silent";
    case LinkProblem::kOtherProtocol:
      return "the vehicle speaks another version of the protocol";
    case LinkProblem::kOtherVehicle:
      return "two vehicles send on this bus";
    case LinkProblem::kOtherHost:
      return "another host sends on this bus";
    case LinkProblem::kErrors:
      return "too many wrong frames";
    case LinkProblem::kBus:
      return "the bus is down";
  }
  return "?";
}

HostStation::HostStation(const HostStationConfig& config, std::uint16_t session)
    : config_(config), session_(session) {}

bool HostStation::is_silent(const std::optional<Time>& last, double limit_s, Time now) const {
  return !last || now - *last >= duration_from_seconds(limit_s);
}

bool HostStation::is_lost(Time now) const {
  return is_silent(last_state_, config_.link_timeout_s, now) ||
         is_silent(last_odometry_, config_.link_timeout_s, now);
}

bool HostStation::is_odometry_valid(Time now) const {
  return odometry_ && is_odometry_good_ &&
         !is_silent(last_odometry_, config_.odometry_timeout_s, now);
}

void HostStation::forget_vehicle() {
  is_linked_ = false;
  is_arm_wanted_ = false;
  was_armed_ = false;
  vehicle_.reset();
  vehicle_heartbeat_.reset();
  odometry_.reset();
  battery_.reset();
  last_state_.reset();
  last_odometry_.reset();
  clock_.reset();
  ping_.is_open = false;
}

void HostStation::begin_session() {
  forget_vehicle();
  ++session_;
  ++counters_.sessions;
}

void HostStation::on_frame(const Frame& frame, Time now) {
  switch (frame.id) {
    case VehState::kId:
      on_state(frame, now);
      break;
    case VehHb::kId:
      on_heartbeat(frame);
      break;
    case Pong::kId:
      on_pong(frame, now);
      break;
    case SpAck::kId:
      on_ack(frame, now);
      break;
    case Battery::kId:
      if (const auto battery = batteries_.take(frame)) {
        battery_ = battery->message;
      }
      break;
    default:
      if (OdometryReceiver::takes(frame.id) && odometries_.add(frame, now)) {
        on_odometry(now);
      }
  }
}

void HostStation::on_state(const Frame& frame, Time now) {
  const auto received = states_.take(frame);
  if (!received) {
    return;
  }
  const VehState& report = received->message;
  const bool is_renewed = vehicle_ && vehicle_->state_nonce != report.state_nonce;
  if (is_renewed) {
    if (is_silent(first_nonce_change_, kNonceWindowS, now)) {
      first_nonce_change_ = now;
      nonce_changes_ = 0;
    }
    ++nonce_changes_;
  }
  last_state_ = now;
  vehicle_ = report;
  const bool is_up = is_flying(report.state);
  if (was_armed_ && (!is_up || is_renewed)) {
    is_arm_wanted_ = false;  // it has ended by itself; nobody has asked for another flight
  }
  was_armed_ = is_arm_wanted_ && is_up;
}

void HostStation::on_heartbeat(const Frame& frame) {
  if (const auto heartbeat = heartbeats_.take(frame)) {
    vehicle_heartbeat_ = heartbeat->message;
  }
}

void HostStation::on_pong(const Frame& frame, Time now) {
  const auto pong = pongs_.take(frame);
  if (pong && ping_.is_open && pong->message.pong_seq == ping_.seq) {
    ping_.is_open = false;
    clock_.add(ping_.sent, pong->message.pong_t2_us, Duration(pong->message.pong_dt_us), now);
  }
}

void HostStation::on_ack(const Frame& frame, Time now) {
  const auto received = acks_.take(frame);
  if (!received) {
    return;
  }
  const SpAck& answer = received->message;
  SentSet& set = sent_sets_[answer.ack_seq & 0xFFU];
  if (set.set == 0) {
    return;  // not of ours
  }
  Ack ack;
  ack.set = set.set;
  ack.result = answer.ack_result;
  ack.received = now;
  ack.sent = set.is_on_bus ? set.sent : now;
  set.is_on_bus = false;
  counters_.sets_not_flown += ack.result == AckResult::kFlown ? 0U : 1U;
  last_ack_ = ack;
}

void HostStation::on_odometry(Time now) {
  ++counters_.odometry_sets;
  const std::optional<WireOdometry> wire = odometries_.odometry();
  last_odometry_ = now;
  const bool is_usable = wire && clock_.is_set();  // else it would be of an unknown time
  is_odometry_good_ = is_usable && wire->quality == OdoQuality::kGood;
  if (is_usable) {
    odometry_ = Odometry{wire->state, clock_.host_time(wire->time_wire_us, now)};
  }
}

void HostStation::on_sent(const Frame& frame, Time sent) {
  if (frame.id == Ping::kId) {
    const auto ping = decode<Ping>(frame);
    if (ping && ping_.is_open && ping->message.ping_seq == ping_.seq) {
      ping_.sent = sent;
    }
  } else if (frame.id == SpCommit::kId) {
    if (const auto commit = decode<SpCommit>(frame)) {
      SentSet& set = sent_sets_[commit->message.sp_seq & 0xFFU];
      set.is_on_bus = true;
      set.sent = sent;
    }
  }
}

LinkProblem HostStation::problem(Time now) const {
  if (!is_bus_up_) {
    return LinkProblem::kBus;
  }
  if (has_other_host_) {
    return LinkProblem::kOtherHost;
  }
  if (nonce_changes_ >= kMostNonceChanges || (vehicle_ && vehicle_->flag_foreign)) {
    return LinkProblem::kOtherVehicle;
  }
  if (vehicle_heartbeat_ && (vehicle_heartbeat_->veh_proto_major != kProtocolMajor ||
                             vehicle_heartbeat_->veh_dbc_hash != kDbcHash)) {
    return LinkProblem::kOtherProtocol;
  }
  if (is_lost(now)) {
    return counters_.odometry_sets == 0 ? LinkProblem::kNoVehicle : LinkProblem::kLost;
  }
  return states_.check().is_faulty() || odometries_.is_faulty() ? LinkProblem::kErrors
                                                                : LinkProblem::kNone;
}

HostState HostStation::state(Time now) const {
  const LinkProblem trouble = problem(now);
  if (trouble == LinkProblem::kNoVehicle) {
    return HostState::kWaiting;
  }
  if (trouble != LinkProblem::kNone && trouble != LinkProblem::kErrors) {
    return HostState::kFault;
  }
  if (!vehicle_ || !clock_.is_set() || !odometry_ || !vehicle_heartbeat_) {
    return HostState::kWaiting;
  }
  switch (vehicle_->state) {
    case State::kArmed:
      return HostState::kFlying;
    case State::kHold:
      return HostState::kHolding;
    case State::kLand:
      return HostState::kLanding;
    case State::kKilled:
    case State::kFault:
      return HostState::kFault;
    default:
      return is_arm_wanted_ ? HostState::kArming : HostState::kReady;
  }
}

void HostStation::tick(const std::optional<Setpoint>& setpoint,
                       SpMode mode,
                       Time now,
                       FrameSink& bus) {
  if (is_linked_ && is_lost(now)) {
    begin_session();
  }
  is_linked_ = is_linked_ || !is_lost(now);
  if (kill_) {
    const bool is_confirmed = vehicle_ && vehicle_->state == State::kKilled;
    Kill kill;
    kill.kill_reason = *kill_;
    kill.kill_magic = KillMagic::kMagic;
    if (!is_confirmed) {
      send(kill, kill_counter_, now, bus);
    }
    is_arm_wanted_ = false;
  }
  const LinkProblem trouble = problem(now);
  const bool may_fly = trouble == LinkProblem::kNone || trouble == LinkProblem::kErrors;
  is_arm_wanted_ = is_arm_wanted_ && may_fly;
  send_commands(now, bus);
  if (setpoint && may_fly && clock_.is_set()) {
    send_setpoint(*setpoint, mode, now, bus);
  }
  send_slow(now, bus);
}

void HostStation::send_setpoint(const Setpoint& setpoint, SpMode mode, Time now, FrameSink& bus) {
  WireSetpoint wire;
  wire.setpoint = setpoint;
  wire.mode = mode;
  wire.seq = static_cast<std::uint8_t>(seq_ + 1U);
  wire.time_wire_us = clock_.vehicle_wire_us(now);
  const std::optional<FrameSet> frames = encode_setpoint(wire, set_counter_.next());
  if (!frames) {
    ++counters_.sets_refused;
    return;
  }
  seq_ = wire.seq;
  sent_sets_[seq_] = {false, Time{}, ++counters_.sets_sent};
  for (const Frame& frame : *frames) {
    bus.send(frame, now);
  }
}

void HostStation::send_commands(Time now, FrameSink& bus) {
  // Level-triggered: every 100 ms, and at once when the wish changes.
  const bool has_changed = is_arm_wanted_ != last_arm_wanted_;
  if (!is_due(last_arm_, has_changed ? 0.0 : kCommandPeriodS, now)) {
    return;
  }
  last_arm_wanted_ = is_arm_wanted_;
  ArmCmd command;
  command.arm_request = is_arm_wanted_ ? ArmRequest::kArm : ArmRequest::kDisarm;
  command.arm_session = session_;
  command.arm_token = is_arm_wanted_ && vehicle_ ? arm_token(vehicle_->state_nonce, session_) : 0U;
  send(command, arm_counter_, now, bus);
}

void HostStation::send_slow(Time now, FrameSink& bus) {
  if (!first_tick_) {
    first_tick_ = now;
  }
  if (is_due(last_heartbeat_, kCommandPeriodS, now)) {
    HostHb heartbeat;
    heartbeat.host_state = state(now);
    heartbeat.host_proto_major = kProtocolMajor;
    heartbeat.host_proto_minor = kProtocolMinor;
    heartbeat.host_dbc_hash = kDbcHash;
    heartbeat.host_uptime_s =
        static_cast<std::uint32_t>((now - *first_tick_) / std::chrono::seconds(1)) & 0xFFFFU;
    send(heartbeat, heartbeat_counter_, now, bus);
  }
  if (is_due(last_ping_, kPingPeriodS, now)) {
    ping_ = {static_cast<std::uint8_t>(ping_.seq + 1U), true, now};
    Ping ping;
    ping.ping_seq = ping_.seq;
    ping.ping_t1_us = wire_time_us(now);
    send(ping, ping_counter_, now, bus);
  }
  if (is_due(last_link_, kLinkPeriodS, now)) {
    const Counters all = counters();
    HostLink link;
    link.hl_rx_ok = static_cast<std::uint32_t>(all.frames.good & 0xFFFFU);
    link.hl_crc_err = static_cast<std::uint32_t>(std::min<std::uint64_t>(all.frames.errors, 0xFF));
    link.hl_lost = static_cast<std::uint32_t>(std::min<std::uint64_t>(all.frames.lost, 0xFF));
    link.hl_torn = static_cast<std::uint32_t>(std::min<std::uint64_t>(all.odometry_torn, 0xFF));
    send(link, link_counter_, now, bus);
  }
}

template <class Message>
void HostStation::send(const Message& message, Outbox& outbox, Time now, FrameSink& bus) {
  if (const std::optional<Frame> frame = encode(message, outbox.next())) {
    bus.send(*frame, now);
  }
}

HostStation::Counters HostStation::counters() const {
  Counters all = counters_;
  all.frames = odometries_.counters();
  all.frames += states_.check().counters();
  all.frames += heartbeats_.check().counters();
  all.frames += acks_.check().counters();
  all.odometry_torn = odometries_.assembly().torn();
  return all;
}

}  // namespace understory::can
