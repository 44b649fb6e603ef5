// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// Gathers the frames that make one set (a setpoint, an odometry): all carry one counter value and
// arrive in any order. A set counts only when it is complete, and only within its window; else it
// was torn. Frames of a set that was given up are ignored. One thread; no allocation; cannot fail.
#pragma once

#include <cstdint>
#include <optional>

#include "understory/base/time.hpp"

namespace understory::can {

class SetAssembly {
 public:
  // `parts` of 1 to 8 frames.
  explicit SetAssembly(unsigned parts, Duration window = std::chrono::milliseconds(20))
      : all_(static_cast<std::uint8_t>((1U << parts) - 1U)), window_(window) {}

  // A frame that decoded. True: with it the set of this counter is complete.
  [[nodiscard]] bool add(unsigned part, std::uint8_t counter, Time now) {
    if (counter_ && *counter_ != counter) {
      // At most half the counter's range ahead is newer; what lags behind was given up before.
      const unsigned ahead = (counter - *counter_) & 0xFU;
      if (ahead > 8U && now - begun_ <= window_) {
        return false;
      }
      tear();
    } else if (counter_ && now - begun_ > window_) {
      tear();
    }
    if (!counter_) {
      counter_ = counter;
      begun_ = now;
      have_ = 0;
      is_done_ = false;
    }
    have_ = static_cast<std::uint8_t>(have_ | (1U << part));
    if (is_done_ || have_ != all_) {
      return false;
    }
    is_done_ = true;
    ++complete_;
    return true;
  }

  // Whether frames of this counter belong to the set being gathered, or to the one just complete.
  [[nodiscard]] bool is_current(std::uint8_t counter) const { return counter_ == counter; }
  [[nodiscard]] std::uint64_t complete() const { return complete_; }
  [[nodiscard]] std::uint64_t torn() const { return torn_; }

 private:
  void tear() {
    torn_ += is_done_ ? 0U : 1U;
    counter_.reset();
  }

  std::uint8_t all_;
  Duration window_;
  std::optional<std::uint8_t> counter_;
  Time begun_{};
  std::uint8_t have_ = 0;
  bool is_done_ = false;
  std::uint64_t complete_ = 0;
  std::uint64_t torn_ = 0;
};

}  // namespace understory::can
