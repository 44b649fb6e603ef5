// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "fuzz/can_target.hpp"

#include <cstdio>
#include <cstdlib>

namespace understory::test {
namespace {

constexpr Duration kFrame{130};
constexpr std::uint64_t kFramesPerStep = 16;

void expect(bool is_true, const char* what) {
  if (!is_true) {
    std::fprintf(stderr, "can target: %s\n", what);
    std::abort();
  }
}

template <class... Messages>
std::uint64_t count_decoded(const can::Frame& frame) {
  return (... + (can::decode<Messages>(frame).has_value() ? 1U : 0U));
}

}  // namespace

CanTarget::CanTarget()
    : vehicle_(can::VehicleStationConfig{}, Rng(1)), host_(can::HostStationConfig{}, 7) {
  step();
}

void CanTarget::decode_all(const can::Frame& frame) {
  using namespace can;  // NOLINT(google-build-using-namespace): of all messages
  const std::uint64_t decoded =
      count_decoded<Kill, ArmCmd, VehState, EscCmd, SpPosXy, SpPosZ, SpVel, SpAcc, SpCommit>(
          frame) +
      count_decoded<SpAck, Ping, Pong, OdoPosXy, OdoPosZ, OdoVel, OdoAtt, OdoRate, EscRpm>(frame) +
      count_decoded<EscStat0,
                    EscStat1,
                    EscStat2,
                    EscStat3,
                    Battery,
                    HostHb,
                    VehHb,
                    HostLink,
                    VehLink>(frame);
  expect(decoded <= 1, "one frame is two messages");
  decoded_ += decoded;
}

void CanTarget::step() {
  const MotorCommands commands = vehicle_.step(readings_, 0.002, now_);
  for (const double command : commands) {
    expect(command == 0.0, "a motor turns");
  }
  const can::State state = vehicle_.supervisor().state();
  expect(state == can::State::kDisarmed || state == can::State::kArming ||
             state == can::State::kKilled,
         "the vehicle is not on the ground any more");
  expect(vehicle_.setpoints_flown() == 0, "a set was flown");
  host_.tick(Setpoint{}, can::SpMode::kTrack, now_, nowhere_);
}

void CanTarget::take(const can::Frame& frame) {
  now_ += kFrame;
  decode_all(frame);
  vehicle_.on_frame(frame, now_, nowhere_);
  host_.on_frame(frame, now_);
  host_.on_sent(frame, now_);
  if (++taken_ % kFramesPerStep == 0) {
    step();
  }
}

}  // namespace understory::test
