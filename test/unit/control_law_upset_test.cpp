// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
//
// References that no vehicle can follow in attitude: the control law follows them in place as well
// as it can, and does not swing itself up.
#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "support/jerk_profile.hpp"
#include "understory/autopilot/control_law.hpp"
#include "understory/sim/vehicle.hpp"

namespace understory {
namespace {

using test::JerkProfile;

constexpr double kStepS = 0.002;
constexpr double kPeriodS = 0.01;  // of setpoints on the bus
const Vector3d kStart_m(0.0, 0.0, 5.0);

// Swings about rest: jerk of one sign, then of the other, each for `phase_s`.
JerkProfile zigzag(const Vector3d& jerk_mps3, double phase_s) {
  JerkProfile path;
  path.start_m = kStart_m;
  path.pieces.push_back({0.5 * phase_s, jerk_mps3});
  for (int i = 0; i < 20; ++i) {
    path.pieces.push_back({phase_s, (i % 2 == 0 ? -1.0 : 1.0) * jerk_mps3});
  }
  return path;
}

double largest_error_m(const JerkProfile& path) {
  Vehicle vehicle({}, kStart_m, 0.0, Rng(1));
  VehicleState start;
  start.position_m = kStart_m;
  vehicle.set_state(start);
  ControlLaw law(AirframeConfig{}, ControlConfig{});
  law.set_mode(ControlMode::kTrack);
  double largest_m = 0.0;
  for (int i = 0; i * kStepS < path.duration_s(); ++i) {
    const double time_s = i * kStepS;
    const double sent_s = kPeriodS * std::floor(time_s / kPeriodS + 1e-9);
    const Vector3d error_m = path.sample(time_s).position_m - vehicle.state().position_m;
    largest_m = std::max(largest_m, error_m.norm());
    const Setpoint setpoint = extrapolated(path.sample(sent_s), time_s - sent_s);
    vehicle.step(law.update(vehicle.state(), setpoint, kStepS), kStepS);
  }
  return largest_m;
}

TEST(ControlLawUpset, JerkThatChangesFasterThanItCanLeanDoesNotSwingItUp) {
  for (const double phase_s : {0.06, 0.09, 0.12, 0.15, 0.2}) {
    for (const Vector3d& jerk_mps3 :
         {Vector3d(18.0, -14.0, -9.0), Vector3d(24.0, 0.0, 0.0), Vector3d(-12.0, 12.0, 18.0)}) {
      EXPECT_LT(largest_error_m(zigzag(jerk_mps3, phase_s)), 0.1)
          << "phases of " << phase_s << " s, jerk " << jerk_mps3.transpose();
    }
  }
}

}  // namespace
}  // namespace understory
