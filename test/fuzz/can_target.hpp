// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// What is fed with frames that nobody should send: the decoder of every message and a station of
// either side. Ends the program when the vehicle is armed, flies a set, or turns a motor. One
// thread.
#pragma once

#include <cstdint>

#include "understory/link/host_station.hpp"
#include "understory/link/vehicle_station.hpp"

namespace understory::test {

class CanTarget {
 public:
  CanTarget();

  void take(const can::Frame& frame);
  [[nodiscard]] std::uint64_t decoded() const { return decoded_; }

 private:
  // Answers go nowhere.
  class Nowhere : public can::FrameSink {
   public:
    void send(const can::Frame& /*frame*/, Time /*now*/) override {}
  };

  void decode_all(const can::Frame& frame);
  void step();

  can::VehicleStation vehicle_;
  can::HostStation host_;
  can::VehicleReadings readings_;
  Nowhere nowhere_;
  Time now_{std::chrono::hours(3)};
  std::uint64_t taken_ = 0;
  std::uint64_t decoded_ = 0;
};

}  // namespace understory::test
