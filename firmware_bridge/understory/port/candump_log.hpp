// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// Logs as `candump -l` writes them, one frame a line:
//   (1700000000.123456) vcan0 101#E803000030F8FFFF
// The reader streams, tells the line and what is wrong with it, and goes on with the next one. One
// thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <istream>
#include <optional>
#include <string>
#include <string_view>

#include "understory/base/result.hpp"
#include "understory/base/time.hpp"
#include "understory/can/frame.hpp"

namespace understory::can {

// Appends one line. Six fraction digits, because readers insist on them.
void append_candump_line(const Frame& frame,
                         Time stamp,
                         std::string_view interface,
                         std::string& text);

struct CandumpEntry {
  Time stamp{};
  std::string interface;
  std::optional<Frame> frame;  // nothing: extended, remote, FD or error frames, which we do not use
};

enum class CandumpProblem : std::uint8_t {
  kTruncated,  // the last line does not end: whoever wrote it was killed
  kStamp,
  kInterface,
  kFrame,
  kTooLong,
};
[[nodiscard]] const char* to_string(CandumpProblem problem);

struct CandumpError {
  std::size_t line = 0;  // from 1
  CandumpProblem problem = CandumpProblem::kFrame;
};

// "line 7: no frame"
[[nodiscard]] std::string to_string(const CandumpError& error);

class CandumpReader {
 public:
  explicit CandumpReader(std::istream& input) : input_(input) {}

  // Nothing at the end.
  [[nodiscard]] std::optional<Result<CandumpEntry, CandumpError>> next();

 private:
  static constexpr std::size_t kLongestLine = 512;

  std::istream& input_;
  std::size_t line_ = 0;
  std::string text_;
};

}  // namespace understory::can
