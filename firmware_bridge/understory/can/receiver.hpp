// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// What a receiver makes of one message's counter (0 to 15): new, repeated, lost in between, out of
// sequence; and when so much is wrong that the link is faulty. Source: AUTOSAR E2E profile 2, with
// the limits of docs/can.md. One receiver per message and sender; one thread; nothing can fail.
#pragma once

#include <algorithm>
#include <cstdint>

namespace understory::can {

enum class Verdict : std::uint8_t {
  kGood,
  kRepeated,       // the same counter again: dropped
  kWrongSequence,  // too far ahead or back: dropped until two in a row fit again
};

struct LinkCounters {
  std::uint64_t good = 0;
  std::uint64_t lost = 0;
  std::uint64_t repeated = 0;
  std::uint64_t wrong_sequence = 0;
  std::uint64_t errors = 0;  // checksum, length, forbidden code

  LinkCounters& operator+=(const LinkCounters& other) {
    good += other.good;
    lost += other.lost;
    repeated += other.repeated;
    wrong_sequence += other.wrong_sequence;
    errors += other.errors;
    return *this;
  }
};

class CounterCheck {
 public:
  static constexpr int kMostLost = 2;     // in a row, before the sequence counts as wrong
  static constexpr int kFaultErrors = 5;  // net: each good frame takes one back

  // Of a frame that decoded.
  Verdict accept(std::uint8_t counter) {
    const unsigned step = (counter - last_) & 0xFU;
    const bool is_first = !has_last_;
    has_last_ = true;
    if (!is_first && step == 0) {
      ++counters_.repeated;
      return Verdict::kRepeated;
    }
    last_ = counter;
    if (!is_first && step > 1U + kMostLost) {
      ++counters_.wrong_sequence;
      error();
      in_row_ = 0;
      return Verdict::kWrongSequence;
    }
    in_row_ = std::min(in_row_ + 1, kResyncFrames);
    if (in_row_ < kResyncFrames) {
      ++counters_.wrong_sequence;
      return Verdict::kWrongSequence;
    }
    counters_.lost += is_first ? 0 : step - 1U;
    ++counters_.good;
    net_errors_ = std::max(0, net_errors_ - 1);
    return Verdict::kGood;
  }

  // A frame with this identifier that did not decode.
  void reject() {
    ++counters_.errors;
    error();
  }

  [[nodiscard]] bool is_faulty() const { return net_errors_ >= kFaultErrors; }
  [[nodiscard]] const LinkCounters& counters() const { return counters_; }

 private:
  static constexpr int kResyncFrames = 2;

  void error() { net_errors_ = std::min(net_errors_ + 1, 2 * kFaultErrors); }

  bool has_last_ = false;
  std::uint8_t last_ = 0;
  int in_row_ = kResyncFrames;
  int net_errors_ = 0;
  LinkCounters counters_;
};

}  // namespace understory::can
