// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/nodelets/trace_writer.hpp"

#include <algorithm>

#include "understory/bridge/flight_loop.hpp"
#include "understory/sim/result_writer.hpp"

namespace understory {

TraceWriter::TraceWriter(const std::string& path)
    : file_(path, std::ios::trunc),
      steady_from_ros_ns_(steady_ns() - static_cast<std::int64_t>(ros::Time::now().toNSec())) {
  if (!file_) {
    throw ResultError(path + ": cannot write");
  }
  file_ << "stage,exposure_ns,begin_ns,end_ns\n";
}

void TraceWriter::append(const understory_msgs::Trace& mark) {
  const std::int64_t exposure_ns =
      static_cast<std::int64_t>(mark.header.stamp.toNSec()) + steady_from_ros_ns_;
  file_ << mark.stage << ',' << exposure_ns << ',' << mark.begin_ns << ',' << mark.end_ns << '\n';
}

void TraceWriter::append(const understory_msgs::FlightTiming& timing) {
  const std::size_t turns = std::min(timing.due_ns.size(), timing.woken_ns.size());
  for (std::size_t i = 0; i < turns; ++i) {
    file_ << "wakeup,0," << timing.due_ns[i] << ',' << timing.woken_ns[i] << '\n';
  }
}

}  // namespace understory
