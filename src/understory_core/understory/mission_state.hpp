// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// What a mission is at, and why it ended. The numbers of the states go over the radio and ROS: new
// ones come last. Values; nothing can fail.
#pragma once

#include <cstdint>

namespace understory {

enum class MissionState : std::uint8_t {
  kWaiting,
  kPaused,
  kTakeOff,
  kExplore,
  kReturnHome,
  kDescend,
  kLand,
  kStopped,
  kMeet,  // at home or on the way there, to meet team mates; then it explores on
};
[[nodiscard]] const char* to_string(MissionState state);

enum class StopReason : std::uint8_t {
  kNone,
  kNothingLeft,
  kTimeLimit,
  kInterrupted,
  kTakeOffFailed,
  kReturnRequested,
  kLandRequested,
  kSensorLost,
  kStageFailed,
  kTrackingLost,
};
[[nodiscard]] const char* to_string(StopReason reason);

}  // namespace understory
