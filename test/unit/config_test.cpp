// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/base/config.hpp"

#include <gtest/gtest.h>

namespace understory {
namespace {

struct Wing {
  double span_m = 1.0;
  void visit(FieldVisitor& f) { f.field("span_m", span_m, in_range(0.5, 2.0), "tip to tip"); }
};
struct Kite {
  int tails = 2;
  bool red = false;
  std::string shape = "delta";
  Wing wing;
  std::vector<Wing> spares;
  void visit(FieldVisitor& f) {
    f.field("tails", tails, in_range(0, 5), "how many");
    f.field("red", red, "colour");
    f.field("shape", shape, {"delta", "box"}, "plan form");
    f.section("wing", wing, "The wing.");
    f.list("spares", spares, "Spare wings.");
  }
};

void load(const std::string& text, Kite& kite) {
  const std::unique_ptr<FieldVisitor> reader = config_text_reader(text, "kite.yaml");
  visit_document(kite, *reader);
}

std::string error_of(const std::string& text) {
  Kite kite;
  try {
    load(text, kite);
  } catch (const ConfigError& error) {
    return error.what();
  }
  return "";
}

TEST(Config, KeepsDefaultsThatTheFileDoesNotName) {
  Kite kite;

  load("tails: 3\nwing: {span_m: 1.5}\n", kite);

  EXPECT_EQ(kite.tails, 3);
  EXPECT_EQ(kite.shape, "delta");
  EXPECT_DOUBLE_EQ(kite.wing.span_m, 1.5);
}

TEST(Config, MisspeltKeyNamesFileKeyAndNearestKnownKey) {
  EXPECT_EQ(error_of("wing: {spam_m: 1.5}"),
            "kite.yaml: wing.spam_m: unknown key; did you mean 'span_m'?");
}

TEST(Config, ValueOutOfRangeIsNamed) {
  EXPECT_EQ(error_of("wing: {span_m: 9}"), "kite.yaml: wing.span_m: 9 is outside [0.5, 2]");
  EXPECT_EQ(error_of("wing: {span_m: .nan}"), "kite.yaml: wing.span_m: nan is outside [0.5, 2]");
}

TEST(Config, WrongTypeIsNamed) {
  EXPECT_EQ(error_of("tails: many"), "kite.yaml: tails: expected an integer");
  EXPECT_EQ(error_of("red: 7"), "kite.yaml: red: expected true or false");
  EXPECT_EQ(error_of("wing: 7"), "kite.yaml: wing: expected a section with keys of its own");
  EXPECT_EQ(error_of("spares: 7"), "kite.yaml: spares: expected a list");
  EXPECT_EQ(error_of("- 1\n- 2"), "kite.yaml: expected a mapping of keys at the top");
}

TEST(Config, UnknownChoiceListsTheChoices) {
  EXPECT_EQ(error_of("shape: round"), "kite.yaml: shape: 'round' is none of: delta, box");
}

TEST(Config, BrokenYamlIsOneLineThatNamesTheFile) {
  const std::string error = error_of("tails: [1\nred");

  EXPECT_EQ(error.rfind("kite.yaml: not valid YAML:", 0), 0U) << error;
  EXPECT_EQ(error.find('\n'), std::string::npos) << error;
}

TEST(Config, MissingFileIsNamed) {
  Kite kite;
  EXPECT_THROW(load_config_file("no/such.yaml", kite), ConfigError);
}

TEST(Config, ListReplacesTheDefaultAndErrorsNameTheItem) {
  Kite kite;

  load("spares: [{span_m: 0.6}, {span_m: 0.7}]", kite);

  ASSERT_EQ(kite.spares.size(), 2U);
  EXPECT_DOUBLE_EQ(kite.spares[1].span_m, 0.7);
  EXPECT_EQ(error_of("spares: [{span_m: 0.6}, {spun_m: 0.7}]"),
            "kite.yaml: spares[1].spun_m: unknown key; did you mean 'span_m'?");
}

TEST(Config, EffectiveConfigurationLoadsBackToTheSameText) {
  Kite kite;
  load("tails: 4\nspares: [{span_m: 0.6}]", kite);
  const std::string text = to_yaml(kite);
  Kite again;

  load(text, again);

  EXPECT_EQ(to_yaml(again), text);
  EXPECT_EQ(again.tails, 4);
}

}  // namespace
}  // namespace understory
