// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <cstring>
#include <limits>
#include <string>

#include <gtest/gtest.h>

#include "understory/base/rng.hpp"
#include "understory/can/codec.hpp"
#include "understory/can/crc.hpp"
#include "understory/can/golden_frames.hpp"

namespace understory::can {
namespace {

const std::uint8_t* bytes_of(const char* text) {
  return reinterpret_cast<const std::uint8_t*>(text);  // NOLINT: bytes are bytes
}

template <class Function>
void for_each_golden(Function function) {
  std::apply([&](const auto&... golden) { (function(golden), ...); }, all_golden_frames());
}

Frame frame_of(std::uint16_t id, Payload payload) {
  Frame frame;
  frame.id = id;
  std::memcpy(frame.data.data(), &payload, sizeof(payload));
  return frame;
}

TEST(Crc, HasThePublishedCheckValues) {
  EXPECT_EQ(crc8h2f(bytes_of("123456789"), 9), 0xDF);
  EXPECT_EQ(crc8h2f(bytes_of("12345678"), 8, '9'), 0xDF);
  EXPECT_EQ(crc32c(bytes_of("123456789"), 9), 0xE3069283U);
}

TEST(CanCodec, EncodesWhatTheOtherLanguageEncodes) {
  int messages = 0;
  for_each_golden([&](const auto& golden) {
    const std::optional<Frame> frame = encode(golden.message, golden.counter);

    ASSERT_TRUE(frame.has_value()) << golden.message.kName;
    EXPECT_EQ(to_candump(*frame), golden.candump) << golden.message.kName;
    ++messages;
  });
  EXPECT_GE(messages, 25);
}

TEST(CanCodec, DecodesToWhatEncodesToTheSameBytes) {
  for_each_golden([](const auto& golden) {
    using Message = std::decay_t<decltype(golden.message)>;
    const Frame frame = encode(golden.message, golden.counter).value();

    const auto received = decode<Message>(frame);

    ASSERT_TRUE(received.has_value()) << golden.message.kName;
    EXPECT_EQ(received->counter, golden.counter);
    EXPECT_EQ(encode(received->message, received->counter).value(), frame);
  });
}

// Every frame that decodes says exactly what it is made of, whatever its bits.
TEST(CanCodec, RandomPayloadsSurviveARoundTripOrAreForbidden) {
  Rng rng(20261122);
  for_each_golden([&](const auto& golden) {
    using Message = std::decay_t<decltype(golden.message)>;
    for (int i = 0; i < 2000; ++i) {
      Payload payload = 0;
      for (int byte = 0; byte < 8; ++byte) {
        payload = (payload << 8U) | static_cast<Payload>(rng.uniform(0.0, 256.0));
      }
      const auto counter = static_cast<std::uint8_t>(i % 16);
      const Frame frame = protect(Message::kId, Message::kDataId, counter, payload);

      const auto received = decode<Message>(frame);

      if (received) {
        EXPECT_EQ(encode(received->message, counter).value(), frame) << golden.message.kName;
      } else {
        EXPECT_EQ(received.error(), FrameError::kForbiddenCode) << golden.message.kName;
      }
    }
  });
}

TEST(CanCodec, RejectsAllFlipsOfUpToThreeBits) {
  SpPosXy position;
  position.sp_x_m = 1.0;
  position.sp_y_m = -2.0;
  const Frame good = encode(position, 5).value();
  Payload word = 0;
  std::memcpy(&word, good.data.data(), sizeof(word));
  const auto passes = [&](Payload flips) {
    return decode<SpPosXy>(frame_of(SpPosXy::kId, word ^ flips)).has_value();
  };
  ASSERT_TRUE(passes(0));

  for (unsigned a = 0; a < 64; ++a) {
    const Payload first = Payload{1} << a;
    EXPECT_FALSE(passes(first)) << a;
    for (unsigned b = a + 1; b < 64; ++b) {
      const Payload second = first | (Payload{1} << b);
      EXPECT_FALSE(passes(second)) << a << ' ' << b;
      for (unsigned c = b + 1; c < 64; ++c) {
        ASSERT_FALSE(passes(second | (Payload{1} << c))) << a << ' ' << b << ' ' << c;
      }
    }
  }
}

TEST(CanCodec, AFrameUnderTheIdentifierOfAnotherMessageIsRejected) {
  const Frame velocity = encode(golden_sp_vel().message, 0).value();
  Frame disguised = velocity;
  disguised.id = SpAcc::kId;

  EXPECT_EQ(decode<SpAcc>(velocity).error(), FrameError::kOtherId);
  EXPECT_EQ(decode<SpAcc>(disguised).error(), FrameError::kChecksum);
}

TEST(CanCodec, AShortFrameIsRejected) {
  Frame frame = encode(golden_sp_vel().message, 0).value();
  frame.length = 7;

  EXPECT_EQ(decode<SpVel>(frame).error(), FrameError::kLength);
}

TEST(CanCodec, NothingIsClamped) {
  SpPosXy position = golden_sp_pos_xy().message;
  for (const double value : {8388.607, -8388.7, 1e300, std::numeric_limits<double>::infinity()}) {
    position.sp_x_m = value;
    EXPECT_FALSE(encode(position, 0).has_value()) << value;
  }
  position.sp_x_m = 8388.606;  // the next code means "not available"
  EXPECT_TRUE(encode(position, 0).has_value());
  SpVel velocity = golden_sp_vel().message;
  velocity.sp_vx_mps = -32.768;
  EXPECT_FALSE(encode(velocity, 0).has_value());
  Ping ping;
  ping.ping_seq = 256;
  EXPECT_FALSE(encode(ping, 0).has_value());
}

TEST(CanCodec, WhatIsNotAvailableArrivesAsNaN) {
  SpVel velocity = golden_sp_vel().message;
  velocity.sp_vy_mps = kNotAvailable;

  const auto received = decode<SpVel>(encode(velocity, 3).value());

  ASSERT_TRUE(received.has_value());
  EXPECT_TRUE(std::isnan(received->message.sp_vy_mps));
  EXPECT_NEAR(received->message.sp_vx_mps, velocity.sp_vx_mps, 0.0005);
}

TEST(CanCodec, MotorCommandsAboveFullThrustAreForbidden) {
  EscCmd command;
  command.esc_cmd0_percent = 100.0;
  const Payload full = to_payload(command).value();

  for (const Payload code : {Payload{4001}, Payload{4094}}) {
    const Payload payload = (full & ~(Payload{0xFFF} << 16U)) | (code << 16U);
    const Frame frame = protect(EscCmd::kId, EscCmd::kDataId, 0, payload);
    EXPECT_EQ(decode<EscCmd>(frame).error(), FrameError::kForbiddenCode) << code;
  }
  EXPECT_TRUE(decode<EscCmd>(encode(command, 0).value()).has_value());
}

}  // namespace
}  // namespace understory::can
