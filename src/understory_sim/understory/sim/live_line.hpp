// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// The mission's state in one line on stderr: rewritten in place on a terminal, a line every ten
// seconds elsewhere. Wall time decides when it is drawn, never what is flown.
#pragma once

#include <chrono>

#include "understory/sim/result_writer.hpp"

namespace understory {

class LiveLine {
 public:
  explicit LiveLine(bool is_quiet);
  void show(const TickRow& row, double realtime_factor);
  // Leaves the last state standing.
  void finish(const TickRow& row, double realtime_factor);

 private:
  void print(const TickRow& row, double realtime_factor) const;

  bool is_quiet_;
  bool is_terminal_;
  std::chrono::steady_clock::time_point next_;
};

}  // namespace understory
