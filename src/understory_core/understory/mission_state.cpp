// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/mission_state.hpp"

namespace understory {

const char* to_string(MissionState state) {
  switch (state) {
    case MissionState::kWaiting:
      return "waiting";
    case MissionState::kPaused:
      return "paused";
    case MissionState::kTakeOff:
      return "take_off";
    case MissionState::kExplore:
      return "explore";
    case MissionState::kReturnHome:
      return "return_home";
    case MissionState::kDescend:
      return "descend";
    case MissionState::kLand:
      return "land";
    case MissionState::kStopped:
      return "stopped";
    case MissionState::kMeet:
      return "meet";
  }
  return "?";
}

const char* to_string(StopReason reason) {
  switch (reason) {
    case StopReason::kNone:
      return "none";
    case StopReason::kNothingLeft:
      return "nothing_left";
    case StopReason::kTimeLimit:
      return "time_limit";
    case StopReason::kInterrupted:
      return "interrupted";
    case StopReason::kTakeOffFailed:
      return "take_off_failed";
    case StopReason::kReturnRequested:
      return "return_requested";
    case StopReason::kLandRequested:
      return "land_requested";
    case StopReason::kSensorLost:
      return "sensor_lost";
    case StopReason::kStageFailed:
      return "stage_failed";
    case StopReason::kTrackingLost:
      return "tracking_lost";
  }
  return "?";
}

}  // namespace understory
