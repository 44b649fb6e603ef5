// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "vehicle/commands.hpp"

#include <array>
#include <sstream>
#include <stdexcept>

#include <fmt/core.h>
#include <poll.h>
#include <unistd.h>

namespace understory {
namespace {

struct Word {
  const char* name = "";
  Fault fault = Fault::kQuit;
  std::optional<double> most;  // takes a value from 0 to this
};
constexpr std::array<Word, 7> kWords{{{"freeze", Fault::kFreeze, {}},
                                      {"resume", Fault::kResume, {}},
                                      {"restart", Fault::kRestart, {}},
                                      {"lose_sensors", Fault::kLoseSensors, {}},
                                      {"drain", Fault::kDrain, 100.0},
                                      {"fail_esc", Fault::kFailEsc, 3.0},
                                      {"quit", Fault::kQuit, {}}}};

}  // namespace

FaultCommand parse_fault(const std::string& text) {
  std::istringstream words(text);
  std::string name;
  words >> name;
  for (const Word& word : kWords) {
    if (name != word.name) {
      continue;
    }
    FaultCommand command;
    command.fault = word.fault;
    std::string excess;
    const bool has_value = !word.most || (words >> command.value && command.value >= 0.0 &&
                                          command.value <= *word.most);
    if (!has_value || words >> excess) {
      const std::string takes =
          word.most ? fmt::format("a number from 0 to {:.0f}", *word.most) : "nothing";
      throw std::invalid_argument(fmt::format("'{}': {} takes {}", text, name, takes));
    }
    return command;
  }
  throw std::invalid_argument(
      "'" + text +
      "': not one of freeze, resume, restart, lose_sensors, drain PERCENT, fail_esc N, quit");
}

TimedFault parse_timed_fault(const std::string& text) {
  const std::size_t colon = text.find(':');
  std::size_t used = 0;
  TimedFault timed;
  try {
    timed.at_s = std::stod(text.substr(0, colon), &used);
  } catch (const std::exception&) {
    used = 0;
  }
  if (colon == std::string::npos || used != colon || timed.at_s < 0.0) {
    throw std::invalid_argument("'" + text + "': expected SECONDS:COMMAND, such as 12.5:drain 3");
  }
  timed.command = parse_fault(text.substr(colon + 1));
  return timed;
}

LineReader::LineReader(int fd) : fd_(fd) {}

std::vector<std::string> LineReader::read() {
  std::vector<std::string> lines;
  pollfd ready{fd_, POLLIN, 0};
  while (fd_ >= 0 && poll(&ready, 1, 0) > 0) {
    std::array<char, 256> bytes{};
    const ssize_t count = ::read(fd_, bytes.data(), bytes.size());
    if (count <= 0) {
      fd_ = -1;
      break;
    }
    rest_.append(bytes.data(), static_cast<std::size_t>(count));
  }
  for (std::size_t end = rest_.find('\n'); end != std::string::npos; end = rest_.find('\n')) {
    lines.push_back(rest_.substr(0, end));
    rest_.erase(0, end + 1);
  }
  return lines;
}

}  // namespace understory
