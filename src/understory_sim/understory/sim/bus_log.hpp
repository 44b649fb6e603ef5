// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// Every frame of a flight in lockstep, as candump -l writes it. It writes in step with the flight,
// so that none is lost and the bytes are the same every time. One thread. Throws ConfigError when
// the file cannot be opened, ResultError from close() when something could not be written.
#pragma once

#include <string>

#include "understory/port/candump_writer.hpp"

namespace understory {

class BusLog : public can::FrameTap {
 public:
  explicit BusLog(const std::string& path);
  void on_port_frame(const can::PortFrame& frame) override { file_.add(frame); }
  void close();

 private:
  can::CandumpFile file_;
};

}  // namespace understory
