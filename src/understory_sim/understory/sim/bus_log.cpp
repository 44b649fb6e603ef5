// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/sim/bus_log.hpp"

#include "understory/sim/result_writer.hpp"

namespace understory {
namespace {

can::CandumpLogConfig log_config(const std::string& path) {
  can::CandumpLogConfig log;
  log.path = path;
  return log;
}

}  // namespace

BusLog::BusLog(const std::string& path) : file_(log_config(path)) {}

void BusLog::close() {
  file_.flush();
  if (const std::optional<std::string> error = file_.take_error()) {
    throw ResultError(*error);
  }
}

}  // namespace understory
