// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// Setpoints and odometry as sets of five frames. World frame (ENU) and body frame (FLU), SI units.
// encode_*: nothing when a value is not finite or out of range, and never a part of a set. The
// receivers hand out a set once, when its last frame has come. One thread; no allocation.
#pragma once

#include <array>
#include <optional>
#include <tuple>

#include "understory/autopilot/control_law.hpp"
#include "understory/base/time.hpp"
#include "understory/can/set_assembly.hpp"
#include "understory/link/inbox.hpp"

namespace understory::can {

using FrameSet = std::array<Frame, 5>;

struct WireSetpoint {
  Setpoint setpoint;
  SpMode mode = SpMode::kTrack;
  SpMask mask = SpMask::kAll;
  SpXyFrame frame = SpXyFrame::kMap;
  std::uint8_t seq = 0;
  std::uint32_t time_wire_us = 0;  // vehicle's clock
};
[[nodiscard]] std::optional<FrameSet> encode_setpoint(const WireSetpoint& setpoint,
                                                      std::uint8_t counter);

struct WireOdometry {
  VehicleState state;
  OdoQuality quality = OdoQuality::kInvalid;
  std::uint32_t time_wire_us = 0;  // vehicle's clock
};
[[nodiscard]] std::optional<FrameSet> encode_odometry(const WireOdometry& odometry,
                                                      std::uint8_t counter);

// Messages that together make one value.
template <class... Parts>
class SetReceiver {
 public:
  // Whether the frame is of this set.
  [[nodiscard]] static bool takes(std::uint16_t id) { return ((id == Parts::kId) || ...); }

  // True when with this frame, which is of this set, the set is complete.
  [[nodiscard]] bool add(const Frame& frame, Time now) {
    return add(frame, now, std::index_sequence_for<Parts...>{});
  }

  [[nodiscard]] const std::tuple<Parts...>& parts() const { return parts_; }
  [[nodiscard]] const SetAssembly& assembly() const { return assembly_; }
  [[nodiscard]] bool is_faulty() const {
    return std::apply([](const auto&... inbox) { return (inbox.check().is_faulty() || ...); },
                      inboxes_);
  }
  [[nodiscard]] LinkCounters counters() const {
    LinkCounters sum;
    std::apply([&sum](const auto&... inbox) { ((sum += inbox.check().counters()), ...); },
               inboxes_);
    return sum;
  }

 private:
  template <std::size_t... I>
  bool add(const Frame& frame, Time now, std::index_sequence<I...> /*parts*/) {
    bool is_complete = false;
    ((frame.id == std::tuple_element_t<I, std::tuple<Parts...>>::kId
          ? static_cast<void>(is_complete = add_part<I>(frame, now))
          : void()),
     ...);
    return is_complete;
  }

  template <std::size_t I>
  bool add_part(const Frame& frame, Time now) {
    const auto received = std::get<I>(inboxes_).take(frame);
    if (!received) {
      return false;
    }
    const bool is_complete = assembly_.add(I, received->counter, now);
    if (assembly_.is_current(received->counter)) {
      std::get<I>(parts_) = received->message;
    }
    return is_complete;
  }

  std::tuple<Inbox<Parts>...> inboxes_;
  std::tuple<Parts...> parts_;
  SetAssembly assembly_{sizeof...(Parts)};
};

class SetpointReceiver : public SetReceiver<SpPosXy, SpPosZ, SpVel, SpAcc, SpCommit> {
 public:
  // Of the set that has just become complete. Nothing if a value is missing that SpMask promises.
  [[nodiscard]] std::optional<WireSetpoint> setpoint() const;
};

class OdometryReceiver : public SetReceiver<OdoPosXy, OdoPosZ, OdoVel, OdoAtt, OdoRate> {
 public:
  [[nodiscard]] std::optional<WireOdometry> odometry() const;
};

}  // namespace understory::can
