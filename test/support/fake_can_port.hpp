// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// A port that takes what it is sent as a test tells it to, and gives what a test puts in. Its clock
// is the test's; wait() moves it to the end.
#pragma once

#include <algorithm>
#include <deque>
#include <string>
#include <vector>

#include "understory/port/can_port.hpp"

namespace understory::test {

[[nodiscard]] constexpr Time at_us(std::int64_t us) {
  return Time(std::chrono::microseconds(us));
}
[[nodiscard]] constexpr Time at_ms(std::int64_t ms) {
  return Time(std::chrono::milliseconds(ms));
}

// The counter is where the protocol has it.
[[nodiscard]] inline can::Frame frame_of(std::uint16_t id, std::uint8_t counter = 0) {
  can::Frame frame;
  frame.id = id;
  frame.data[1] = counter;
  return frame;
}

class FakeCanPort : public can::CanPort {
 public:
  [[nodiscard]] can::SendResult send(const can::Frame& frame) override {
    ++tries;
    const can::SendResult answer = answers.empty() ? can::SendResult::kSent : answers.front();
    if (!answers.empty()) {
      answers.pop_front();
    }
    if (answer == can::SendResult::kSent) {
      sent.push_back(frame);
    }
    return answer;
  }
  [[nodiscard]] std::size_t receive(can::PortFrame* frames, std::size_t most) override {
    const std::size_t count = std::min(most, arrived.size());
    for (std::size_t i = 0; i < count; ++i) {
      frames[i] = arrived.front();
      arrived.pop_front();
    }
    return count;
  }
  void wait(Duration at_most, can::WaitFor what) override {
    time += at_most - set_back;
    set_back = Duration(0);
    waited_for.push_back(what);
  }
  [[nodiscard]] Time now() const override { return time; }
  [[nodiscard]] can::PortState state() const override { return can::PortState::kUp; }
  [[nodiscard]] std::uint64_t session() const override { return session_number; }
  [[nodiscard]] const can::PortCounters& counters() const override { return port_counters; }

  [[nodiscard]] std::vector<std::uint16_t> sent_ids() const {
    std::vector<std::uint16_t> ids;
    for (const can::Frame& frame : sent) {
      ids.push_back(frame.id);
    }
    return ids;
  }

  std::deque<can::SendResult> answers;  // one for each send, then always kSent
  std::vector<can::Frame> sent;
  int tries = 0;
  std::vector<can::WaitFor> waited_for;
  std::deque<can::PortFrame> arrived;
  Time time{};
  Duration set_back{};  // what the clock is set back by in the next wait
  std::uint64_t session_number = 1;
  can::PortCounters port_counters;
};

}  // namespace understory::test
