// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// The C++ codec against frames and values that Python derived from the DBC: codes at all borders of
// every signal, and random ones. Python in turn is held against tshark and candied
// (can_oracle_test.py).
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <set>
#include <string>
#include <tuple>
#include <type_traits>
#include <vector>

#include <gtest/gtest.h>

#include "understory/can/codec.hpp"
#include "understory/can/golden_frames.hpp"
#include "understory/can/oracle_frames.hpp"

namespace understory::can {
namespace {

Frame frame_of(const std::string& candump) {
  Frame frame;
  frame.id = static_cast<std::uint16_t>(std::stoul(candump.substr(0, 3), nullptr, 16));
  for (std::size_t i = 0; i < frame.data.size(); ++i) {
    const std::string digits = candump.substr(4 + 2 * i, 2);
    frame.data[i] = static_cast<std::uint8_t>(std::stoul(digits, nullptr, 16));
  }
  return frame;
}

// function(message without content, oracle frame, frame)
template <class Function>
void for_each_oracle(Function function) {
  std::apply(
      [&](const auto&... golden) {
        for (const OracleFrame& oracle : kOracleFrames) {
          const Frame frame = frame_of(oracle.candump);
          const auto try_message = [&](const auto& message) {
            if (frame.id == std::decay_t<decltype(message)>::kId) {
              function(message, oracle, frame);
            }
          };
          (try_message(golden.message), ...);
        }
      },
      all_golden_frames());
}

TEST(CanOracle, EveryLegalFrameDecodesToTheSameValues) {
  std::set<std::uint16_t> identifiers;
  for_each_oracle([&](const auto& type, const OracleFrame& oracle, const Frame& frame) {
    using Message = std::decay_t<decltype(type)>;
    const auto received = decode<Message>(frame);

    identifiers.insert(frame.id);
    ASSERT_EQ(received.has_value(), oracle.is_legal) << oracle.candump;
    if (!received) {
      EXPECT_EQ(received.error(), FrameError::kForbiddenCode) << oracle.candump;
      return;
    }
    EXPECT_EQ(received->counter, oracle.counter) << oracle.candump;
    const std::vector<double> values = values_of(received->message);
    for (std::size_t i = 0; i < values.size(); ++i) {
      if (std::isnan(oracle.values[i])) {
        EXPECT_TRUE(std::isnan(values[i])) << oracle.candump << " signal " << i;
      } else {
        EXPECT_DOUBLE_EQ(values[i], oracle.values[i]) << oracle.candump << " signal " << i;
      }
    }
  });
  EXPECT_EQ(identifiers.size(), kMessages.size());
}

TEST(CanOracle, WhatAFrameDecodesToEncodesToTheSameFrame) {
  int frames = 0;
  for_each_oracle([&](const auto& type, const OracleFrame& oracle, const Frame& frame) {
    using Message = std::decay_t<decltype(type)>;
    const auto received = decode<Message>(frame);
    if (!received) {
      return;
    }

    const std::optional<Frame> again = encode(received->message, oracle.counter);

    ASSERT_TRUE(again.has_value()) << oracle.candump;
    EXPECT_EQ(to_candump(*again), oracle.candump);
    ++frames;
  });
  EXPECT_GT(frames, 1000);
}

}  // namespace
}  // namespace understory::can
