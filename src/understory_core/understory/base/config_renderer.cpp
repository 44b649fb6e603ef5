// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include <sstream>

#include <yaml-cpp/yaml.h>

#include "understory/base/config.hpp"

namespace understory {
namespace {

class YamlRenderer final : public ConfigRenderer {
 public:
  void field(const char* name,
             double& value,
             Range<double> /*range*/,
             const char* /*doc*/) override {
    out_ << YAML::Key << name << YAML::Value << value;
  }
  void field(const char* name, int& value, Range<int> /*range*/, const char* /*doc*/) override {
    out_ << YAML::Key << name << YAML::Value << value;
  }
  void field(const char* name, bool& value, const char* /*doc*/) override {
    out_ << YAML::Key << name << YAML::Value << value;
  }
  void field(const char* name,
             std::string& value,
             const Choices& /*choices*/,
             const char* /*doc*/) override {
    out_ << YAML::Key << name << YAML::Value << value;
  }
  [[nodiscard]] std::string text() const override { return std::string(out_.c_str()) + "\n"; }

 protected:
  bool begin_section(const char* name, const char* /*doc*/) override {
    if (depth_++ > 0) {
      out_ << YAML::Key << name << YAML::Value;
    }
    out_ << YAML::BeginMap;
    return true;
  }
  void end_section() override {
    --depth_;
    out_ << YAML::EndMap;
  }
  std::size_t begin_list(const char* name, std::size_t size, const char* /*doc*/) override {
    out_ << YAML::Key << name << YAML::Value << YAML::BeginSeq;
    return size;
  }
  void begin_item(std::size_t /*index*/) override {
    ++depth_;
    out_ << YAML::BeginMap;
  }
  void end_list() override { out_ << YAML::EndSeq; }

 private:
  YAML::Emitter out_;
  int depth_ = 0;
};

class MarkdownRenderer final : public ConfigRenderer {
 public:
  void field(const char* name, double& value, Range<double> range, const char* doc) override {
    std::ostringstream limits;
    limits << range.low << " .. " << range.high;
    row(name, value, limits.str(), doc);
  }
  void field(const char* name, int& value, Range<int> range, const char* doc) override {
    row(name, value, std::to_string(range.low) + " .. " + std::to_string(range.high), doc);
  }
  void field(const char* name, bool& value, const char* doc) override {
    row(name, value ? "true" : "false", "true, false", doc);
  }
  void field(const char* name,
             std::string& value,
             const Choices& choices,
             const char* doc) override {
    std::string list;
    for (const std::string& choice : choices) {
      list += (list.empty() ? "" : ", ") + choice;
    }
    row(name, value.empty() ? "\"\"" : value, list.empty() ? "any text" : list, doc);
  }
  [[nodiscard]] std::string text() const override { return out_.str(); }

 protected:
  bool begin_section(const char* name, const char* doc) override {
    if (depth_++ == 0) {
      return true;
    }
    path_.emplace_back(name);
    heading(doc);
    return true;
  }
  void end_section() override {
    --depth_;
    if (!path_.empty()) {
      path_.pop_back();
    }
  }
  std::size_t begin_list(const char* name, std::size_t size, const char* doc) override {
    path_.emplace_back(std::string(name) + "[]");
    heading(doc);
    return size == 0 ? 1 : size;
  }
  void begin_item(std::size_t /*index*/) override {
    ++depth_;
    path_.emplace_back("");
  }
  void end_list() override { path_.pop_back(); }

 private:
  void heading(const char* doc) {
    std::string path;
    for (const std::string& part : path_) {
      path += (path.empty() || part.empty() ? "" : ".") + part;
    }
    out_ << "\n## " << path << "\n"
         << doc << "\n\n"
         << "| key | default | range | meaning |\n|---|---|---|---|\n";
  }
  template <class T>
  void row(const char* name, const T& value, const std::string& limits, const char* doc) {
    out_ << "| `" << name << "` | " << value << " | " << limits << " | " << doc << " |\n";
  }

  std::ostringstream out_;
  std::vector<std::string> path_;
  int depth_ = 0;
};

}  // namespace

std::unique_ptr<ConfigRenderer> config_yaml_renderer() {
  return std::make_unique<YamlRenderer>();
}

std::unique_ptr<ConfigRenderer> config_markdown_renderer() {
  return std::make_unique<MarkdownRenderer>();
}

}  // namespace understory
