// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include "understory/sim/radio.hpp"

namespace understory {
namespace {

TEST(RadioConfig, ReadsItsCutsFromYaml) {
  RadioConfig config;
  const auto reader = config_text_reader("range_m: 20\ncuts:\n- {from_s: 5, to_s: 7.5}\n", "test");

  visit_document(config, *reader);

  EXPECT_EQ(config.range_m, 20.0);
  ASSERT_EQ(config.cuts.size(), 1U);
  EXPECT_EQ(config.cuts[0].to_s, 7.5);
}

}  // namespace
}  // namespace understory
