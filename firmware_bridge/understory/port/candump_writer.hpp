// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// Writes what a node's port gives into candump logs: flight.log, then flight.1.log, flight.2.log
// and so on, a new one when size or time of the last is reached; whole lines only, every 100 ms and
// at the end. Opening the first file throws ConfigError and removes an older log of the same name;
// later, what cannot be written is counted and told, and never stops a flight. CandumpFile does it
// in one thread; CandumpWriter takes frames from the flight thread, without waiting or system
// calls, and writes in a thread of its own.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "understory/base/time.hpp"
#include "understory/port/can_node.hpp"
#include "understory/port/unique_fd.hpp"

namespace understory::can {

struct CandumpLogConfig {
  std::string path;                         // of the first file
  std::string interface = "can0";           // in each line, without what other readers stumble over
  std::uint64_t largest_bytes = 1U << 26U;  // of a file
  Duration longest = std::chrono::hours(1);  // from the first to the last frame of a file
  std::size_t queued_frames = 16384;         // 5 s of a full bus, if the disk takes so long
};

struct CandumpCounters {
  std::uint64_t lines = 0;   // written
  std::uint64_t lost = 0;    // the queue was full
  std::uint64_t failed = 0;  // lines that could not be written
  std::uint64_t files = 0;
};

// The log's files in their order: flight.log, flight.1.log, ...
[[nodiscard]] std::string candump_path(const std::string& first, std::size_t number);

class CandumpFile {
 public:
  explicit CandumpFile(const CandumpLogConfig& config);
  CandumpFile(const CandumpFile&) = delete;
  CandumpFile& operator=(const CandumpFile&) = delete;
  ~CandumpFile() { flush(); }

  // Buffers a line.
  void add(const PortFrame& frame);
  void flush();
  [[nodiscard]] const CandumpCounters& counters() const { return counters_; }
  // What went wrong last, once.
  [[nodiscard]] std::optional<std::string> take_error();

 private:
  [[nodiscard]] bool open_next();
  void rotate();
  void fail(const std::string& what, int error);

  CandumpLogConfig config_;
  UniqueFd file_;
  std::size_t number_ = 0;
  std::string buffer_;
  std::uint64_t buffered_lines_ = 0;
  std::uint64_t written_bytes_ = 0;  // of this file
  std::optional<Time> begun_;        // the first stamp of this file
  CandumpCounters counters_;
  std::optional<std::string> error_;
};

class CandumpWriter final : public FrameTap {
 public:
  explicit CandumpWriter(const CandumpLogConfig& config);
  CandumpWriter(const CandumpWriter&) = delete;
  CandumpWriter& operator=(const CandumpWriter&) = delete;
  ~CandumpWriter() override;  // writes what is queued

  // The flight thread.
  void on_port_frame(const PortFrame& frame) override;
  // Any other thread.
  [[nodiscard]] CandumpCounters counters() const;
  [[nodiscard]] std::optional<std::string> take_error();

 private:
  class Thread;
  std::unique_ptr<Thread> thread_;
};

}  // namespace understory::can
