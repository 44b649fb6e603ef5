// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <fstream>
#include <sstream>
#include <string_view>

#include <yaml-cpp/yaml.h>

#include "understory/base/config.hpp"

namespace understory {
namespace {

std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  for (std::size_t j = 0; j <= b.size(); ++j) {
    row[j] = j;
  }
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t substituted = diagonal + (a[i - 1] == b[j - 1] ? 0U : 1U);
      diagonal = row[j];
      row[j] = std::min({substituted, row[j] + 1, row[j - 1] + 1});
    }
  }
  return row[b.size()];
}

class YamlReader final : public FieldVisitor {
 public:
  YamlReader(const YAML::Node& root, std::string origin) : origin_(std::move(origin)) {
    if (!root.IsNull() && !root.IsMap()) {
      throw ConfigError(origin_ + ": expected a mapping of keys at the top");
    }
    pending_ = root;
  }

  void field(const char* name, double& value, Range<double> range, const char* /*doc*/) override {
    read(name, value, "a number", [&](double read_value) {
      if (!(read_value >= range.low && read_value <= range.high)) {
        out_of_range(name, range.low, range.high, read_value);
      }
    });
  }
  void field(const char* name, int& value, Range<int> range, const char* /*doc*/) override {
    read(name, value, "an integer", [&](int read_value) {
      if (read_value < range.low || read_value > range.high) {
        out_of_range(name, range.low, range.high, read_value);
      }
    });
  }
  void field(const char* name, bool& value, const char* /*doc*/) override {
    read(name, value, "true or false", [](bool) {});
  }
  void field(const char* name,
             std::string& value,
             const Choices& choices,
             const char* /*doc*/) override {
    read(name, value, "a text", [&](const std::string& read_value) {
      if (!choices.empty() &&
          std::find(choices.begin(), choices.end(), read_value) == choices.end()) {
        std::string list;
        for (const std::string& choice : choices) {
          list += (list.empty() ? "" : ", ") + choice;
        }
        fail(name, "'" + read_value + "' is none of: " + list);
      }
    });
  }

 protected:
  bool begin_section(const char* name, const char* /*doc*/) override {
    YAML::Node node = levels_.empty() ? pending_ : child(name);
    if (!node.IsDefined() || node.IsNull()) {
      return false;
    }
    if (!node.IsMap()) {
      fail(name, "expected a section with keys of its own");
    }
    levels_.push_back({name, node, {}});
    return true;
  }

  void end_section() override {
    const Level level = levels_.back();
    for (const auto& entry : level.node) {
      const auto key = entry.first.as<std::string>();
      if (std::find(level.known.begin(), level.known.end(), key) == level.known.end()) {
        fail(key, "unknown key" + suggestion(key, level.known));
      }
    }
    levels_.pop_back();
  }

  std::size_t begin_list(const char* name, std::size_t size, const char* /*doc*/) override {
    const YAML::Node node = child(name);
    if (!node.IsDefined() || node.IsNull()) {
      levels_.push_back({name, YAML::Node(), {}});
      keep_list_ = true;
      return size;
    }
    if (!node.IsSequence()) {
      fail(name, "expected a list");
    }
    keep_list_ = false;
    levels_.push_back({name, node, {}});
    return node.size();
  }
  void begin_item(std::size_t index) override {
    const std::string name = "[" + std::to_string(index) + "]";
    if (keep_list_) {
      levels_.push_back({name, YAML::Node(YAML::NodeType::Map), {}});
      return;
    }
    const YAML::Node node = levels_.back().node[index];
    if (!node.IsMap()) {
      fail(name, "expected a section with keys of its own");
    }
    levels_.push_back({name, node, {}});
  }
  void end_list() override {
    levels_.pop_back();
    keep_list_ = false;
  }

 private:
  struct Level {
    std::string name;
    YAML::Node node;
    std::vector<std::string> known;
  };

  YAML::Node child(const std::string& name) {
    Level& level = levels_.back();
    level.known.push_back(name);
    const YAML::Node& node = level.node;  // the const operator[] does not insert
    return node.IsMap() ? node[name] : YAML::Node(YAML::NodeType::Undefined);
  }

  template <class T, class Check>
  void read(const char* name, T& value, const char* expected, const Check& check) {
    const YAML::Node node = child(name);
    if (!node.IsDefined()) {
      return;
    }
    T read_value{};
    if (!node.IsScalar() || !YAML::convert<T>::decode(node, read_value)) {
      fail(name, std::string("expected ") + expected);
    }
    check(read_value);
    value = read_value;
  }

  template <class T>
  [[noreturn]] void out_of_range(const char* name, T low, T high, T value) const {
    std::ostringstream text;
    text << value << " is outside [" << low << ", " << high << "]";
    fail(name, text.str());
  }

  [[noreturn]] void fail(const std::string& name, const std::string& what) const {
    std::string path;
    for (const Level& level : levels_) {
      if (!level.name.empty()) {
        path += (path.empty() || level.name[0] == '[' ? "" : ".") + level.name;
      }
    }
    path += (path.empty() || name[0] == '[' ? "" : ".") + name;
    throw ConfigError(origin_ + ": " + path + ": " + what);
  }

  static std::string suggestion(const std::string& key, const std::vector<std::string>& known) {
    const auto nearest =
        std::min_element(known.begin(), known.end(), [&](const auto& a, const auto& b) {
          return edit_distance(key, a) < edit_distance(key, b);
        });
    return nearest == known.end() ? "" : "; did you mean '" + *nearest + "'?";
  }

  std::string origin_;
  YAML::Node pending_;
  std::vector<Level> levels_;
  bool keep_list_ = false;
};

}  // namespace

std::unique_ptr<FieldVisitor> config_text_reader(const std::string& text,
                                                 const std::string& origin) {
  try {
    return std::make_unique<YamlReader>(YAML::Load(text), origin);
  } catch (const YAML::Exception& error) {
    std::string what = error.what();
    std::replace(what.begin(), what.end(), '\n', ' ');
    throw ConfigError(origin + ": not valid YAML: " + what);
  }
}

std::unique_ptr<FieldVisitor> open_config_reader(const std::string& path) {
  std::ifstream file(path);
  std::ostringstream text;
  if (!file || !(text << file.rdbuf())) {
    throw ConfigError(path + ": cannot be read");
  }
  return config_text_reader(text.str(), path);
}

}  // namespace understory
