// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// trace.csv: one line per stage and frame, for `understory latency`. Times in nanoseconds of the
// steady clock. One thread. Opening throws; a row that cannot be written is lost silently, as the
// result folder was found writable before.
#pragma once

#include <cstdint>
#include <fstream>
#include <string>

#include <understory_msgs/FlightTiming.h>
#include <understory_msgs/Trace.h>

namespace understory {

class TraceWriter {
 public:
  explicit TraceWriter(const std::string& path);

  void append(const understory_msgs::Trace& mark);
  void append(const understory_msgs::FlightTiming& timing);
  void flush() { file_.flush(); }

 private:
  std::ofstream file_;
  std::int64_t steady_from_ros_ns_;  // fixed at the start, so that a frame's marks keep one key
};

}  // namespace understory
