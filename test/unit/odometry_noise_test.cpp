// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/sim/odometry_noise.hpp"

#include <cmath>

#include <gtest/gtest.h>

namespace understory {
namespace {

VehicleState somewhere() {
  VehicleState state;
  state.position_m = {3.0, -2.0, 1.0};
  state.velocity_mps = {1.5, 0.1, -0.2};
  state.world_from_body = Eigen::Quaterniond(Eigen::AngleAxisd(0.7, Vector3d::UnitZ()));
  return state;
}

TEST(OdometryNoise, OfNothingLeavesEveryBitAsItIs) {
  OdometryNoise noise({}, Rng(1));
  const VehicleState truth = somewhere();
  noise.step(0.002);

  const VehicleState measured = noise.measured(truth);

  EXPECT_EQ(measured.position_m, truth.position_m);
  EXPECT_EQ(measured.velocity_mps, truth.velocity_mps);
  EXPECT_EQ(measured.world_from_body.coeffs(), truth.world_from_body.coeffs());
}

TEST(OdometryNoise, BeginsWithoutErrorAndHasTheDeviationAskedFor) {
  OdometryNoise noise({0.05, 0.02, 1.0}, Rng(2));
  const VehicleState truth = somewhere();
  EXPECT_EQ(noise.measured(truth).position_m, truth.position_m);
  double position_sum = 0.0;
  double yaw_sum = 0.0;
  constexpr int kSteps = 20000;
  for (int i = 0; i < kSteps; ++i) {
    noise.step(0.5);
    const VehicleState measured = noise.measured(truth);
    position_sum += (measured.position_m - truth.position_m).squaredNorm() / 3.0;
    const double turn_rad = measured.world_from_body.angularDistance(truth.world_from_body);
    yaw_sum += turn_rad * turn_rad;
  }

  EXPECT_NEAR(std::sqrt(position_sum / kSteps), 0.05, 0.003);
  EXPECT_NEAR(std::sqrt(yaw_sum / kSteps), 0.02, 0.002);
}

TEST(OdometryNoise, TurnsTheVelocityWithTheVehicle) {
  OdometryNoise noise({0.0, 0.1, 1.0}, Rng(3));
  const VehicleState truth = somewhere();
  noise.step(5.0);

  const VehicleState measured = noise.measured(truth);

  EXPECT_NE(measured.velocity_mps, truth.velocity_mps);
  const Vector3d in_body = truth.world_from_body.inverse() * truth.velocity_mps;
  EXPECT_LT((measured.world_from_body.inverse() * measured.velocity_mps - in_body).norm(), 1e-12);
}

TEST(OdometryNoise, ComesAndGoesSlowly) {
  OdometryNoise noise({0.05, 0.0, 20.0}, Rng(4));
  const VehicleState truth = somewhere();
  Vector3d before = truth.position_m;
  for (int i = 0; i < 1000; ++i) {
    noise.step(0.002);
    const Vector3d now = noise.measured(truth).position_m;
    EXPECT_LT((now - before).norm(), 0.006) << "six deviations of a step";
    before = now;
  }
}

}  // namespace
}  // namespace understory
