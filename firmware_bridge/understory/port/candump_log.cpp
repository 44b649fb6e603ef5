// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/port/candump_log.hpp"

#include <algorithm>
#include <array>
#include <cassert>
#include <charconv>

#include "understory/can/id_set.hpp"

namespace understory::can {
namespace {

constexpr std::int64_t kUsPerSecond = 1'000'000;
constexpr std::size_t kStandardIdDigits = 3;
constexpr std::size_t kExtendedIdDigits = 8;
constexpr std::size_t kFractionDigits = 6;

void append_digits(std::uint64_t value, std::size_t least_digits, std::string& text) {
  std::array<char, 20> digits{};
  std::size_t begin = digits.size();
  do {
    digits[--begin] = static_cast<char>('0' + value % 10);
    value /= 10;
  } while (value != 0 || digits.size() - begin < least_digits);
  text.append(digits.data() + begin, digits.size() - begin);
}

void append_hex(unsigned value, unsigned digits, std::string& text) {
  for (unsigned i = digits; i-- > 0;) {
    text += "0123456789ABCDEF"[(value >> (4 * i)) & 0xFU];
  }
}

// The whole text is one number.
template <class Number>
bool parse(std::string_view text, int base, Number& number) {
  const char* const end = text.data() + text.size();
  // NOLINTNEXTLINE(bugprone-suspicious-stringview-data-usage): from_chars takes both ends
  const auto [stop, error] = std::from_chars(text.data(), end, number, base);
  return !text.empty() && error == std::errc() && stop == end;
}

bool are_hex_digits(std::string_view text) {
  return std::all_of(text.begin(), text.end(), [](char letter) {
    return (letter >= '0' && letter <= '9') || (letter >= 'A' && letter <= 'F') ||
           (letter >= 'a' && letter <= 'f');
  });
}

// Up to the separator, which is dropped as well; nothing if it is not there.
std::optional<std::string_view> take_until(char separator, std::string_view& rest) {
  const std::size_t at = rest.find(separator);
  if (at == std::string_view::npos) {
    return std::nullopt;
  }
  const std::string_view part = rest.substr(0, at);
  rest.remove_prefix(at + 1);
  return part;
}

std::optional<Time> parse_stamp(std::string_view text) {
  if (text.empty() || text.front() != '(') {
    return std::nullopt;
  }
  text.remove_prefix(1);
  const std::optional<std::string_view> whole = take_until('.', text);
  std::uint32_t fraction_us = 0;
  std::uint64_t seconds = 0;
  constexpr std::uint64_t kMostSeconds = 1'000'000'000'000;  // what still fits in microseconds
  if (!whole || text.size() != kFractionDigits || !parse(text, 10, fraction_us) ||
      !parse(*whole, 10, seconds) || seconds > kMostSeconds) {
    return std::nullopt;
  }
  return Time(Duration(static_cast<std::int64_t>(seconds) * kUsPerSecond + fraction_us));
}

// What follows the "#" of a classic frame: at most 8 bytes, then perhaps a raw DLC ("_9").
bool parse_data(std::string_view text, Frame& frame) {
  const std::size_t bytes = frame.data.size();
  if (text.size() == 2 * bytes + 2 && text[2 * bytes] == '_') {
    text = are_hex_digits(text.substr(2 * bytes + 1)) ? text.substr(0, 2 * bytes) : text;
  }
  if (text.size() % 2 != 0 || text.size() > 2 * bytes || !are_hex_digits(text)) {
    return false;
  }
  frame.length = static_cast<std::uint8_t>(text.size() / 2);
  for (std::size_t i = 0; i < frame.length; ++i) {
    if (!parse(text.substr(2 * i, 2), 16, frame.data[i])) {
      return false;
    }
  }
  return true;
}

bool parse_frame(std::string_view text, std::optional<Frame>& frame) {
  const std::optional<std::string_view> id_text = take_until('#', text);
  std::uint32_t id = 0;
  if (!id_text || !are_hex_digits(*id_text) || !parse(*id_text, 16, id)) {
    return false;
  }
  Frame found;
  const bool is_remote = !text.empty() && (text.front() == 'R' || text.front() == 'r');
  const bool is_fd = !text.empty() && text.front() == '#';
  if (id_text->size() == kExtendedIdDigits || is_remote || is_fd) {
    // Not ours: enough to see that it is a frame.
    text.remove_prefix(is_remote || is_fd ? 1 : 0);
    return are_hex_digits(text.substr(0, text.find('_')));
  }
  if (id_text->size() != kStandardIdDigits || id >= kIdCount || !parse_data(text, found)) {
    return false;
  }
  found.id = static_cast<std::uint16_t>(id);
  frame = found;
  return true;
}

std::optional<CandumpProblem> parse_line(std::string_view text, CandumpEntry& entry) {
  const std::optional<std::string_view> stamp_text = take_until(')', text);
  const std::optional<Time> stamp = stamp_text ? parse_stamp(*stamp_text) : std::nullopt;
  if (!stamp || text.empty() || text.front() != ' ') {
    return CandumpProblem::kStamp;
  }
  entry.stamp = *stamp;
  text.remove_prefix(1);
  const std::optional<std::string_view> interface = take_until(' ', text);
  if (!interface || interface->empty()) {
    return CandumpProblem::kInterface;
  }
  entry.interface = *interface;
  // Some versions say after the frame whether it was sent or received.
  const std::string_view frame = text.substr(0, text.find(' '));
  return parse_frame(frame, entry.frame) ? std::nullopt
                                         : std::optional<CandumpProblem>(CandumpProblem::kFrame);
}

}  // namespace

const char* to_string(CandumpProblem problem) {
  switch (problem) {
    case CandumpProblem::kTruncated:
      return "cut off, as by a killed writer";
    case CandumpProblem::kStamp:
      return "no time stamp with six fraction digits";
    case CandumpProblem::kInterface:
      return "no interface";
    case CandumpProblem::kFrame:
      return "no frame";
    case CandumpProblem::kTooLong:
      return "too long for a frame";
  }
  return "unknown";
}

std::string to_string(const CandumpError& error) {
  return "line " + std::to_string(error.line) + ": " + to_string(error.problem);
}

void append_candump_line(const Frame& frame,
                         Time stamp,
                         std::string_view interface,
                         std::string& text) {
  assert(stamp >= Time());
  const auto us = static_cast<std::uint64_t>(stamp.time_since_epoch().count());
  text += '(';
  append_digits(us / kUsPerSecond, 10, text);
  text += '.';
  append_digits(us % kUsPerSecond, kFractionDigits, text);
  text += ") ";
  text += interface;
  text += ' ';
  append_hex(frame.id, kStandardIdDigits, text);
  text += '#';
  for (std::size_t i = 0; i < frame.length && i < frame.data.size(); ++i) {
    append_hex(frame.data[i], 2, text);
  }
  text += '\n';
}

std::optional<Result<CandumpEntry, CandumpError>> CandumpReader::next() {
  text_.clear();
  std::size_t length = 0;
  int letter = input_.get();
  for (; letter != std::istream::traits_type::eof() && letter != '\n'; letter = input_.get()) {
    if (++length <= kLongestLine) {
      text_ += static_cast<char>(letter);
    }
  }
  const bool is_end = letter != '\n';
  if (is_end && length == 0) {
    return std::nullopt;
  }
  ++line_;
  if (is_end) {
    return CandumpError{line_, CandumpProblem::kTruncated};
  }
  if (length > kLongestLine) {
    return CandumpError{line_, CandumpProblem::kTooLong};
  }
  if (!text_.empty() && text_.back() == '\r') {
    text_.pop_back();
  }
  CandumpEntry entry;
  if (const std::optional<CandumpProblem> problem = parse_line(text_, entry)) {
    return CandumpError{line_, *problem};
  }
  return entry;
}

}  // namespace understory::can
