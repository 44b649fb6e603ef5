// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// What the stand-in is told while it runs: faults and their end, by a line on standard input or at
// a time given beforehand. One thread; parse throws std::invalid_argument in one line that names
// the command.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace understory {

enum class Fault : std::uint8_t {
  kFreeze,       // the whole vehicle stands still, as in a debugger
  kResume,       // goes on after that
  kRestart,      // the autopilot starts anew; motors off
  kLoseSensors,  // no position any more
  kDrain,        // the battery has so many percent left
  kFailEsc,      // one motor gives nothing any more
  kQuit,
};

struct FaultCommand {
  Fault fault = Fault::kQuit;
  double value = 0.0;  // kDrain: percent; kFailEsc: 0 to 3
};
// "freeze", "resume", "restart", "lose_sensors", "drain 3", "fail_esc 2", "quit".
[[nodiscard]] FaultCommand parse_fault(const std::string& text);

struct TimedFault {
  double at_s = 0.0;
  FaultCommand command;
};
// "12.5:drain 3": so many seconds after arming.
[[nodiscard]] TimedFault parse_timed_fault(const std::string& text);

// Lines of a file descriptor, without waiting for them.
class LineReader {
 public:
  explicit LineReader(int fd);
  // Complete lines that have come; empty at the end of the file too.
  [[nodiscard]] std::vector<std::string> read();

 private:
  int fd_;
  std::string rest_;
};

}  // namespace understory
