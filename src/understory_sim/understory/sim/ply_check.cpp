// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/sim/ply_check.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <locale>
#include <sstream>
#include <vector>

namespace understory {
namespace {

struct Property {
  std::size_t count_bytes = 0;  // 0: not a list
  std::size_t value_bytes = 0;
};

struct Element {
  std::uint64_t count = 0;
  std::vector<Property> properties;
};

struct Header {
  std::string format;
  std::vector<Element> elements;
  std::size_t body = 0;  // where it starts
};

std::size_t bytes_of(const std::string& type) {
  for (const char* name : {"char", "uchar", "int8", "uint8"}) {
    if (type == name) {
      return 1;
    }
  }
  for (const char* name : {"short", "ushort", "int16", "uint16"}) {
    if (type == name) {
      return 2;
    }
  }
  for (const char* name : {"int", "uint", "int32", "uint32", "float", "float32"}) {
    if (type == name) {
      return 4;
    }
  }
  return type == "double" || type == "float64" ? 8 : 0;
}

bool read_property(std::istream& words, Header& header) {
  std::string type;
  words >> type;
  Property property;
  if (type == "list") {
    std::string count_type;
    words >> count_type >> type;
    property.count_bytes = bytes_of(count_type);
    if (property.count_bytes == 0 || property.count_bytes > 4) {
      return false;
    }
  }
  property.value_bytes = bytes_of(type);
  if (property.value_bytes == 0 || header.elements.empty()) {
    return false;
  }
  header.elements.back().properties.push_back(property);
  return true;
}

bool read_line(const std::string& line, Header& header) {
  std::istringstream words(line);
  words.imbue(std::locale::classic());
  std::string key;
  words >> key;
  if (key == "format") {
    words >> header.format;
  } else if (key == "element") {
    std::string name;
    Element element;
    words >> name >> element.count;
    header.elements.push_back(element);
    return !words.fail();
  } else if (key == "property") {
    return read_property(words, header);
  }
  return true;
}

// The defect, or empty.
std::string read_header(const std::string& content, Header& header) {
  std::size_t begin = 0;
  for (std::size_t end = content.find('\n'); end != std::string::npos;
       begin = end + 1, end = content.find('\n', begin)) {
    const std::string line = content.substr(begin, end - begin);
    if (begin == 0 && line.compare(0, 3, "ply") != 0) {
      return "does not start with 'ply'";
    }
    if (line.compare(0, 10, "end_header") == 0) {
      header.body = end + 1;
      return "";
    }
    if (!read_line(line, header)) {
      return "its PLY header has a line that cannot be read: " + line;
    }
  }
  return "its PLY header does not end";
}

bool has_all_lines(const std::string& content, const Header& header) {
  std::uint64_t missing = 0;
  for (const Element& element : header.elements) {
    if (element.count > content.size()) {
      return false;
    }
    missing += element.count;
  }
  std::istringstream body(content.substr(header.body));
  for (std::string line; missing > 0 && std::getline(body, line);) {
    missing -= line.find_first_not_of(" \t\r") == std::string::npos ? 0U : 1U;
  }
  return missing == 0;
}

std::uint64_t list_length(const std::string& content,
                          std::size_t at,
                          std::size_t bytes,
                          bool big_endian) {
  std::uint64_t length = 0;
  for (std::size_t i = 0; i < bytes; ++i) {
    const std::size_t byte = big_endian ? at + i : at + bytes - 1 - i;
    length = length << 8U | static_cast<unsigned char>(content[byte]);
  }
  return length;
}

// Where the property's value ends that begins here; past the end when the file is too short.
std::size_t end_of_value(const std::string& content,
                         std::size_t at,
                         const Property& property,
                         bool big_endian) {
  const std::size_t past_end = content.size() + 1;
  if (at > content.size() || property.count_bytes > content.size() - at) {
    return past_end;
  }
  const std::uint64_t values =
      property.count_bytes == 0 ? 1 : list_length(content, at, property.count_bytes, big_endian);
  const std::size_t first = at + property.count_bytes;
  const bool fits = values <= (content.size() - first) / property.value_bytes;
  return fits ? first + values * property.value_bytes : past_end;
}

bool has_all_bytes(const std::string& content, const Header& header) {
  const bool big_endian = header.format == "binary_big_endian";
  std::size_t at = header.body;
  for (const Element& element : header.elements) {
    // Every row takes a byte at least, so this bounds the work too.
    if (element.count > content.size() || (element.count > 0 && element.properties.empty())) {
      return false;
    }
    for (std::uint64_t row = 0; row < element.count && at <= content.size(); ++row) {
      for (const Property& property : element.properties) {
        at = end_of_value(content, at, property, big_endian);
      }
    }
  }
  return at <= content.size();
}

}  // namespace

std::string ply_defect(const std::string& content) {
  Header header;
  std::string defect = read_header(content, header);
  if (!defect.empty()) {
    return defect;
  }
  const bool binary =
      header.format == "binary_little_endian" || header.format == "binary_big_endian";
  if (!binary && header.format != "ascii") {
    return "its PLY format is unknown: '" + header.format + "'";
  }
  const bool whole = binary ? has_all_bytes(content, header) : has_all_lines(content, header);
  return whole ? "" : "is cut short: it holds less than its PLY header announces";
}

}  // namespace understory
