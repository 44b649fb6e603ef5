// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// The host's side of the bus: what is sent when, and what is known of the vehicle. No I/O: frames
// go in and out, with the time. Setpoints are stamped with the vehicle's clock, so none are sent
// before it is known. After the vehicle has been silent for too long nothing is sent but
// heartbeats, PINGs and disarming, so that its failsafe acts, and arming must be asked for anew.
// The host's clock (CLOCK_REALTIME on board); world ENU, SI units. One thread; no allocation;
// cannot fail.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "understory/base/config.hpp"
#include "understory/link/clock_sync.hpp"
#include "understory/link/wire_sets.hpp"
#include "understory/port/can_port.hpp"

namespace understory::can {

struct HostStationConfig {
  double odometry_timeout_s = 0.1;
  double link_timeout_s = 0.5;

  void visit(FieldVisitor& f) {
    f.field("odometry_timeout_s",
            odometry_timeout_s,
            in_range(0.02, 0.5),
            "without odometry for so long it is invalid");
    f.field("link_timeout_s",
            link_timeout_s,
            in_range(0.1, 0.5),
            "without odometry or state for so long the link is lost: no more setpoints");
  }
};

// Why the host does not fly though it could hear the vehicle, or hears none.
enum class LinkProblem : std::uint8_t {
  kNone,
  kNoVehicle,      // nothing heard yet
  kLost,           // nothing heard any more
  kOtherProtocol,  // the vehicle speaks another version of the DBC
  kOtherVehicle,   // two vehicles send on this bus
  kOtherHost,      // another host sends on this bus
  kErrors,         // too many frames are wrong
  kBus,            // the bus is down, gone, or off
};
[[nodiscard]] const char* to_string(LinkProblem problem);

class HostStation {
 public:
  // `session`: another number for every host that starts, by chance.
  HostStation(const HostStationConfig& config, std::uint16_t session);

  void on_frame(const Frame& frame, Time now);
  // Our frame, when it was on the bus.
  void on_sent(const Frame& frame, Time sent);
  void on_other_host() { has_other_host_ = true; }
  // The bus was lost and is back: nothing of before counts, nor does the number of the session.
  void begin_session();
  void set_bus(bool is_up) { is_bus_up_ = is_up; }

  // Wishes; what becomes of them is told by vehicle().
  void ask_arm() { is_arm_wanted_ = true; }
  void ask_disarm() { is_arm_wanted_ = false; }
  void kill(KillReason reason) { kill_ = reason; }

  // Once per setpoint period; without a setpoint the rest is still sent.
  void tick(const std::optional<Setpoint>& setpoint, SpMode mode, Time now, FrameSink& bus);

  [[nodiscard]] HostState state(Time now) const;
  [[nodiscard]] LinkProblem problem(Time now) const;
  [[nodiscard]] bool is_arm_wanted() const { return is_arm_wanted_; }
  // The newest report of the vehicle; its times by the host's clock.
  [[nodiscard]] const std::optional<VehState>& vehicle() const { return vehicle_; }
  [[nodiscard]] const std::optional<Battery>& battery() const { return battery_; }
  struct Odometry {
    VehicleState state;
    Time time{};
  };
  [[nodiscard]] const std::optional<Odometry>& odometry() const { return odometry_; }
  [[nodiscard]] bool is_odometry_valid(Time now) const;
  [[nodiscard]] const ClockSync& clock() const { return clock_; }

  struct Ack {
    std::uint64_t set = 0;  // counted as sets_sent
    AckResult result = AckResult::kFlown;
    Time sent{};      // the set's last frame was on the bus
    Time received{};  // its answer was
  };
  [[nodiscard]] const std::optional<Ack>& last_ack() const { return last_ack_; }

  struct Counters {
    LinkCounters frames;
    std::uint64_t sets_sent = 0;
    std::uint64_t sets_refused = 0;  // could not be encoded
    std::uint64_t sets_not_flown = 0;
    std::uint64_t odometry_sets = 0;
    std::uint64_t odometry_torn = 0;
    std::uint64_t sessions = 1;
  };
  [[nodiscard]] Counters counters() const;

 private:
  struct SentSet {
    bool is_on_bus = false;
    Time sent{};
    std::uint64_t set = 0;
  };
  struct SentPing {
    std::uint8_t seq = 0;
    bool is_open = false;
    Time sent{};
  };

  void on_state(const Frame& frame, Time now);
  void on_heartbeat(const Frame& frame);
  void on_pong(const Frame& frame, Time now);
  void on_ack(const Frame& frame, Time now);
  void on_odometry(Time now);
  [[nodiscard]] bool is_silent(const std::optional<Time>& last, double limit_s, Time now) const;
  [[nodiscard]] bool is_lost(Time now) const;
  void forget_vehicle();
  void send_setpoint(const Setpoint& setpoint, SpMode mode, Time now, FrameSink& bus);
  void send_commands(Time now, FrameSink& bus);
  void send_slow(Time now, FrameSink& bus);
  template <class Message>
  void send(const Message& message, Outbox& outbox, Time now, FrameSink& bus);

  HostStationConfig config_;

  Inbox<VehState> states_;
  Inbox<VehHb> heartbeats_;
  Inbox<Pong> pongs_;
  Inbox<SpAck> acks_;
  Inbox<Battery> batteries_;
  OdometryReceiver odometries_;
  std::optional<VehState> vehicle_;
  std::optional<VehHb> vehicle_heartbeat_;
  std::optional<Battery> battery_;
  std::optional<Odometry> odometry_;
  std::optional<Time> last_state_;
  std::optional<Time> last_odometry_;
  std::optional<Time> first_tick_;
  std::optional<Time> first_nonce_change_;

  ClockSync clock_;
  SentPing ping_;
  std::array<SentSet, 256> sent_sets_{};
  std::optional<Ack> last_ack_;

  std::optional<Time> last_arm_;
  std::optional<Time> last_heartbeat_;
  std::optional<Time> last_ping_;
  std::optional<Time> last_link_;
  Counters counters_;

  // Small ones, together.
  std::optional<KillReason> kill_;
  int nonce_changes_ = 0;
  std::uint16_t session_;
  bool is_arm_wanted_ = false;
  bool was_armed_ = false;  // since it was asked for
  bool has_other_host_ = false;
  bool is_bus_up_ = true;
  bool is_linked_ = false;
  bool is_odometry_good_ = false;
  bool last_arm_wanted_ = false;
  std::uint8_t seq_ = 0;
  Outbox set_counter_;
  Outbox arm_counter_;
  Outbox kill_counter_;
  Outbox heartbeat_counter_;
  Outbox ping_counter_;
  Outbox link_counter_;
};

}  // namespace understory::can
