// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// Typed configuration. A module's struct names each field once, with unit suffix, default, range
// and meaning, in `void visit(FieldVisitor&)`; loading, the effective configuration and
// docs/parameters.md all come from that one place. SI units. Used at start only: everything wrong
// (unknown key, wrong type, out of range, unreadable file) throws ConfigError in one line that
// names file and key.
#pragma once

#include <cstddef>
#include <limits>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace understory {

class ConfigError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

template <class T>
struct Range {
  T low;
  T high;
};
template <class T>
[[nodiscard]] Range<T> in_range(T low, T high) {
  return {low, high};
}

using Choices = std::vector<std::string>;

class FieldVisitor {
 public:
  FieldVisitor() = default;
  FieldVisitor(const FieldVisitor&) = delete;
  FieldVisitor& operator=(const FieldVisitor&) = delete;
  virtual ~FieldVisitor() = default;

  virtual void field(const char* name, double& value, Range<double> range, const char* doc) = 0;
  virtual void field(const char* name, int& value, Range<int> range, const char* doc) = 0;
  virtual void field(const char* name, bool& value, const char* doc) = 0;
  // An empty list of choices admits any text.
  virtual void field(const char* name,
                     std::string& value,
                     const Choices& choices,
                     const char* doc) = 0;

  template <class Section>
  void section(const char* name, Section& section, const char* doc) {
    if (begin_section(name, doc)) {
      section.visit(*this);
      end_section();
    }
  }
  // A sequence of sections; a file that names it replaces it as a whole.
  template <class Section>
  void list(const char* name, std::vector<Section>& sections, const char* doc) {
    sections.resize(begin_list(name, sections.size(), doc));
    for (std::size_t i = 0; i < sections.size(); ++i) {
      begin_item(i);
      sections[i].visit(*this);
      end_section();
    }
    end_list();
  }

 protected:
  virtual bool begin_section(const char* name, const char* doc) = 0;  // false: not there, keep
  virtual void end_section() = 0;
  virtual std::size_t begin_list(const char* name, std::size_t size, const char* doc) = 0;
  virtual void begin_item(std::size_t index) = 0;
  virtual void end_list() = 0;
};

// Reads one YAML file over what the struct holds already.
[[nodiscard]] std::unique_ptr<FieldVisitor> open_config_reader(const std::string& path);
// Same, for text; `origin` stands in for the file's name in errors.
[[nodiscard]] std::unique_ptr<FieldVisitor> config_text_reader(const std::string& text,
                                                               const std::string& origin);

// A visitor that renders what it visits; text() may be called once the visit has ended.
class ConfigRenderer : public FieldVisitor {
 public:
  [[nodiscard]] virtual std::string text() const = 0;
};
[[nodiscard]] std::unique_ptr<ConfigRenderer> config_yaml_renderer();
// Tables of key, default, range and meaning, one per section (docs/parameters.md).
[[nodiscard]] std::unique_ptr<ConfigRenderer> config_markdown_renderer();

// The reader checks for unknown keys when the visit of the whole document ends.
template <class Config>
void visit_document(Config& config, FieldVisitor& visitor) {
  struct Document {
    Config& config;
    void visit(FieldVisitor& fields) { config.visit(fields); }
  } document{config};
  visitor.section("", document, "");
}

template <class Config>
void load_config_file(const std::string& path, Config& config) {
  visit_document(config, *open_config_reader(path));
}

template <class Config>
[[nodiscard]] std::string to_yaml(Config config) {
  const std::unique_ptr<ConfigRenderer> renderer = config_yaml_renderer();
  visit_document(config, *renderer);
  return renderer->text();
}

}  // namespace understory
