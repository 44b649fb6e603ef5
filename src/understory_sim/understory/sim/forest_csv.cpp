// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/sim/forest_csv.hpp"

#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <locale>
#include <sstream>

#define CSV_IO_NO_THREAD  // its reader thread is of no use for text that is in memory
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wpragmas"
#pragma GCC diagnostic ignored "-Wstringop-truncation"  // GCC, where it inlines the header's errors
#include <libfccp/csv.h>
#pragma GCC diagnostic pop

namespace understory {
namespace {

constexpr double kLargestRadiusM = 5.0;
constexpr double kLargestCoordinateM = 1e5;
constexpr std::uintmax_t kLargestFileBytes = 256U << 20U;
constexpr const char* kDiameterHeader = "x_m,y_m,dbh_m";

using CsvReader = io::CSVReader<3,
                                io::trim_chars<' ', '\t'>,
                                io::no_quote_escape<','>,
                                io::throw_on_overflow,
                                io::single_and_empty_line_comment<'#'>>;

[[noreturn]] void fail(const std::string& path, const std::string& reason) {
  throw ForestError(path + ": " + reason);
}

[[noreturn]] void fail(const std::string& path, unsigned line, const std::string& reason) {
  fail(path + ":" + std::to_string(line), reason);
}

std::string text_of_file(const std::string& path) {
  std::error_code error;
  if (std::filesystem::is_directory(path, error)) {
    fail(path, "is a folder, not a CSV file");
  }
  const std::uintmax_t size = std::filesystem::file_size(path, error);
  if (!error && size > kLargestFileBytes) {
    fail(path, "larger than 256 MiB, not a stem map");
  }
  std::ifstream file(path, std::ios::binary);
  if (!file) {
    fail(path, "cannot be opened");
  }
  std::string text((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
  if (file.bad()) {
    fail(path, "cannot be read");
  }
  if (text.find('\0') != std::string::npos) {
    fail(path, "holds zero bytes, not a text file");
  }
  if (!text.empty() && text.back() != '\n') {
    text += '\n';  // csv.h looks one byte past the end of a last line that has none
  }
  return text;
}

// The classic locale whatever the process uses; hexadecimal, "nan" and "inf" are refused.
double number(const std::string& path, unsigned line, const char* name, const char* text) {
  std::istringstream stream{std::string(text)};
  stream.imbue(std::locale::classic());
  double value = 0.0;
  stream >> value;
  if (stream.fail() || stream.peek() != std::istringstream::traits_type::eof() ||
      !std::isfinite(value)) {
    fail(path, line, std::string(name) + " is not a number: '" + text + "'");
  }
  return value;
}

Trunk checked_trunk(const std::string& path, unsigned line, const Trunk& trunk) {
  if (trunk.center_m.cwiseAbs().maxCoeff() > kLargestCoordinateM) {
    fail(path, line, "farther than 100 km from the origin");
  }
  if (!(trunk.radius_m > 0.0)) {
    fail(path, line, "the trunk's size is not positive");
  }
  if (trunk.radius_m > kLargestRadiusM) {
    fail(path, line, "the trunk's radius is above 5 m");
  }
  return trunk;
}

std::string without_blanks(const std::string& text) {
  std::string kept;
  for (const char letter : text) {
    if (letter != ' ' && letter != '\t') {
      kept += letter;
    }
  }
  return kept;
}

// Consumes the first line that is not blank; true: the third column is a diameter.
bool is_diameter_layout(const std::string& path, CsvReader& reader) {
  std::string first;
  while (first.empty()) {
    const char* line = reader.next_line();
    if (line == nullptr) {
      fail(path, "is empty");
    }
    first = without_blanks(line);
  }
  if (first == kDiameterHeader) {
    return true;
  }
  if (first.front() != '#') {
    fail(path,
         reader.get_file_line(),
         std::string("starts neither with '# ...' (rows x,y,radius follow) nor with the header ") +
             kDiameterHeader);
  }
  return false;
}

}  // namespace

Forest read_forest_csv(const std::string& path) {
  const std::string text = text_of_file(path);
  Forest forest;
  try {
    CsvReader reader(path, text.data(), text.data() + text.size());
    const bool has_diameters = is_diameter_layout(path, reader);
    const char* size_name = has_diameters ? "dbh_m" : "radius";
    char* x = nullptr;
    char* y = nullptr;
    char* size = nullptr;
    while (reader.read_row(x, y, size)) {
      const unsigned line = reader.get_file_line();
      const Vector2d center_m(number(path, line, "x", x), number(path, line, "y", y));
      const double size_m = number(path, line, size_name, size);
      forest.trunks.push_back(
          checked_trunk(path, line, {center_m, has_diameters ? 0.5 * size_m : size_m}));
    }
  } catch (const io::error::too_few_columns& error) {
    fail(path, static_cast<unsigned>(error.file_line), "fewer than three columns");
  } catch (const io::error::too_many_columns& error) {
    fail(path, static_cast<unsigned>(error.file_line), "more than three columns");
  } catch (const io::error::base& error) {
    fail(path, error.what());
  }
  if (forest.trunks.empty()) {
    fail(path, "holds no trunk");
  }
  return forest;
}

void write_forest_csv(const Forest& forest, const std::string& path) {
  std::ofstream file(path);
  file.imbue(std::locale::classic());
  file.setf(std::ios::fixed);
  file.precision(4);
  file << "# x,y,radius in metres, " << forest.trunks.size() << " trunks\n";
  for (const Trunk& trunk : forest.trunks) {
    file << trunk.center_m.x() << ',' << trunk.center_m.y() << ',' << trunk.radius_m << '\n';
  }
  file.close();
  if (!file) {
    fail(path, "cannot be written");
  }
}

}  // namespace understory
