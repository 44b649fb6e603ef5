// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/bridge/flight_control.hpp"

#include <limits>

#include <gtest/gtest.h>

#include "support/fake_autopilot.hpp"

namespace understory {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using test::hop;
using test::kFlightBox_m;
using test::starting_at;

constexpr Duration kTick = milliseconds(10);
const Time kBegin = Time(seconds(1000));
const Vector3d kHome_m(1.0, 2.0, 1.5);
const Vector3d kGoal_m(-1.0, 1.0, 1.0);

// Telemetry is that of a vehicle that is where its setpoint was, but for what a test changes.
struct Flight {
  explicit Flight(const GateConfig& gate = wide_gate())
      : control(gate, TrackingConfig{}, kFlightBox_m) {
    telemetry.is_valid = true;
    telemetry.state.position_m = kHome_m;
    plan.set(starting_at(hop(kHome_m, kGoal_m, 4.0), kBegin + seconds(1), 7), kBegin);
  }
  static GateConfig wide_gate() {
    GateConfig gate;
    gate.max_acceleration_mps2 = 100.0;
    return gate;
  }

  void tick() {
    now += kTick;
    decision = control.decide(has_plan ? &plan : nullptr, telemetry, now);
    if (is_tracking && decision.setpoint) {
      telemetry.state.position_m = decision.setpoint->position_m + offset_m;
    }
  }
  void fly_for(Duration duration) {
    for (const Time end = now + duration; now < end;) {
      tick();
    }
  }
  [[nodiscard]] bool holds_at(const Vector3d& position_m) const {
    return decision.is_hold && decision.flown == nullptr && decision.setpoint &&
           decision.setpoint->position_m == position_m &&
           decision.setpoint->velocity_mps.isZero() &&
           decision.setpoint->acceleration_mps2.isZero();
  }
  [[nodiscard]] bool flies_plan() const {
    return decision.flown != nullptr && decision.setpoint &&
           decision.setpoint->position_m == plan.sample(now).position_m;
  }

  FlightControl control;
  TrajectoryFollower plan;
  Telemetry telemetry;
  FlightDecision decision;
  Vector3d offset_m = Vector3d::Zero();
  bool has_plan = true;
  bool is_tracking = true;
  Time now = kBegin;
};

TEST(FlightControl, BeforeTheVehicleFollowsItHoldsWhereThatIs) {
  Flight flight;
  flight.telemetry.state.world_from_body = Eigen::AngleAxisd(0.6, Vector3d::UnitZ());

  flight.fly_for(seconds(2));

  EXPECT_TRUE(flight.holds_at(kHome_m));
  EXPECT_NEAR(flight.decision.setpoint->yaw_rad, 0.6, 1e-12);
  EXPECT_FALSE(flight.control.is_astray());
}

TEST(FlightControl, BeforeTheVehicleFollowsTheHoldMovesWithIt) {
  Flight flight;
  flight.fly_for(milliseconds(50));
  const Vector3d pushed_m = kHome_m + Vector3d(0.1, 0.0, 0.0);

  flight.telemetry.state.position_m = pushed_m;
  flight.tick();

  EXPECT_TRUE(flight.holds_at(pushed_m));
}

TEST(FlightControl, ThePlanIsFlownWhileTheVehicleFollows) {
  Flight flight;
  flight.telemetry.is_following = true;

  for (int i = 0; i < 490; ++i) {
    flight.tick();
    ASSERT_TRUE(flight.flies_plan()) << i;
    ASSERT_FALSE(flight.decision.is_hold);
    ASSERT_FALSE(flight.decision.is_at_rest);
  }

  EXPECT_EQ(flight.decision.flown->id, 7U);
  EXPECT_EQ(flight.control.gate_violations(), 0U);
}

TEST(FlightControl, WhereThePlanHasEndedIsAHoldAtItsEnd) {
  Flight flight;
  flight.telemetry.is_following = true;

  flight.fly_for(seconds(5) - kTick);
  EXPECT_FALSE(flight.decision.is_at_rest);
  flight.tick();
  EXPECT_TRUE(flight.decision.is_at_rest);
  flight.fly_for(seconds(1));

  EXPECT_TRUE(flight.decision.is_at_rest);
  EXPECT_TRUE(flight.decision.is_hold);
  EXPECT_TRUE(flight.decision.setpoint->position_m.isApprox(kGoal_m));
}

TEST(FlightControl, WithoutAPlanItHoldsWhereTheVehicleBeganToFollow) {
  Flight flight;
  flight.has_plan = false;
  flight.telemetry.is_following = true;
  flight.tick();
  flight.is_tracking = false;

  flight.telemetry.state.position_m.x() += 0.5;
  flight.fly_for(seconds(1));

  EXPECT_TRUE(flight.holds_at(kHome_m));
  EXPECT_TRUE(flight.decision.is_at_rest);
  EXPECT_FALSE(flight.control.is_astray());
}

TEST(FlightControl, WithoutAPositionThereIsNoSetpoint) {
  for (const bool is_following : {false, true}) {
    Flight flight;
    flight.has_plan = false;
    flight.telemetry.is_valid = false;
    flight.telemetry.is_following = is_following;

    flight.fly_for(seconds(1));

    EXPECT_FALSE(flight.decision.setpoint.has_value()) << is_following;
    EXPECT_EQ(flight.control.gate_violations(), 0U);
  }
}

TEST(FlightControl, AHoldIsKeptWhenThePositionIsLost) {
  Flight flight;
  flight.has_plan = false;
  flight.telemetry.is_following = true;
  flight.tick();

  flight.telemetry.is_valid = false;
  flight.fly_for(seconds(1));

  EXPECT_TRUE(flight.holds_at(kHome_m));
}

TEST(FlightControl, AVehicleFartherThanAMetreForTheWholePatienceIsAstray) {
  Flight flight;
  flight.telemetry.is_following = true;
  flight.fly_for(seconds(2));
  flight.offset_m = {0.0, 1.05, 0.0};
  flight.tick();  // is there from now on
  flight.tick();  // and that is seen

  flight.fly_for(milliseconds(290));
  EXPECT_FALSE(flight.control.is_astray());
  flight.tick();

  EXPECT_TRUE(flight.control.is_astray());
}

TEST(FlightControl, AVehicleJustWithinAMetreIsNotAstray) {
  Flight flight;
  flight.telemetry.is_following = true;
  flight.offset_m = {0.0, 0.97, 0.0};

  flight.fly_for(seconds(4));

  EXPECT_FALSE(flight.control.is_astray());
}

TEST(FlightControl, AVehicleExactlyAMetreOffIsNotAstray) {
  Flight flight;
  flight.telemetry.is_following = true;
  flight.fly_for(seconds(6));
  flight.offset_m = {1.0, 0.0, 0.0};  // from x = -1 m, so that nothing is rounded

  flight.fly_for(seconds(1));

  EXPECT_EQ((flight.decision.setpoint->position_m - flight.telemetry.state.position_m).norm(), 1.0);
  EXPECT_FALSE(flight.control.is_astray());
}

TEST(FlightControl, AMomentWithinAMetreBeginsThePatienceAnew) {
  Flight flight;
  flight.telemetry.is_following = true;
  flight.fly_for(seconds(1));
  for (int i = 0; i < 5; ++i) {
    flight.offset_m = {0.0, 1.1, 0.0};
    flight.fly_for(milliseconds(250));
    flight.offset_m.setZero();
    flight.fly_for(2 * kTick);
  }

  EXPECT_FALSE(flight.control.is_astray());
}

TEST(FlightControl, WhileThePositionIsUnknownNothingIsAstray) {
  Flight flight;
  flight.telemetry.is_following = true;
  flight.fly_for(seconds(1));
  flight.offset_m = {0.0, 1.5, 0.0};
  flight.tick();

  flight.telemetry.is_valid = false;
  flight.fly_for(seconds(1));

  EXPECT_FALSE(flight.control.is_astray());
}

TEST(FlightControl, AnAstrayVehicleIsHeldAndFliesNoPlanAgain) {
  Flight flight;
  flight.telemetry.is_following = true;
  flight.fly_for(seconds(2));
  flight.offset_m = {0.0, 1.2, 0.0};
  flight.fly_for(milliseconds(400));
  ASSERT_TRUE(flight.control.is_astray());
  flight.is_tracking = false;
  const Vector3d here_m = flight.telemetry.state.position_m;
  flight.plan.set(starting_at(hop(here_m, kGoal_m, 4.0), flight.now, 8), flight.now);

  for (int i = 0; i < 500; ++i) {
    flight.tick();
    ASSERT_EQ(flight.decision.flown, nullptr);
    ASSERT_TRUE(flight.decision.is_hold);
  }

  EXPECT_TRUE(flight.decision.setpoint->velocity_mps.isZero());
}

// It would be told to go back to where it lost the way, through what nobody has checked.
TEST(FlightControl, AVehicleThatIsFarAstrayIsHeldWhereItIs) {
  Flight flight;
  flight.telemetry.is_following = true;
  flight.fly_for(seconds(2));
  flight.is_tracking = false;
  flight.telemetry.is_following = false;
  flight.tick();

  flight.telemetry.state.position_m = Vector3d(3.0, -3.0, 1.0);
  flight.tick();
  EXPECT_TRUE(flight.holds_at(Vector3d(3.0, -3.0, 1.0)));
  flight.telemetry.is_following = true;
  flight.tick();

  EXPECT_TRUE(flight.holds_at(Vector3d(3.0, -3.0, 1.0)));
  EXPECT_EQ(flight.control.gate_violations(), 0U);
}

TEST(FlightControl, AHoldOfBeforeThePlanIsNotTakenUpAfterIt) {
  Flight flight;
  flight.has_plan = false;
  flight.telemetry.is_following = true;
  flight.tick();  // holds at home
  flight.has_plan = true;
  flight.fly_for(seconds(4));
  flight.offset_m = {0.0, 1.2, 0.0};
  while (!flight.control.is_astray()) {
    flight.tick();
  }
  // Back near its last setpoint, where the gate has nothing against a hold.
  flight.telemetry.state.position_m = flight.decision.setpoint->position_m;
  const Vector3d here_m = flight.telemetry.state.position_m;

  flight.tick();

  EXPECT_TRUE(flight.holds_at(here_m));
  EXPECT_EQ(flight.control.gate_violations(), 0U);
}

TEST(FlightControl, OnceTheVehicleHeldByItselfNoPlanIsFlownAgain) {
  Flight flight;
  flight.telemetry.is_following = true;
  flight.fly_for(seconds(2));
  flight.telemetry.is_following = false;
  flight.tick();
  EXPECT_TRUE(flight.control.is_astray());
  const Vector3d here_m = flight.telemetry.state.position_m;

  flight.telemetry.is_following = true;
  flight.fly_for(seconds(3));

  EXPECT_TRUE(flight.holds_at(here_m));
}

TEST(FlightControl, AVehicleThatOnlyHeldSoFarFliesThePlanLater) {
  Flight flight;
  flight.has_plan = false;
  flight.telemetry.is_following = true;
  flight.fly_for(milliseconds(100));
  flight.telemetry.is_following = false;
  flight.fly_for(milliseconds(100));
  flight.telemetry.is_following = true;
  flight.has_plan = true;

  flight.fly_for(seconds(1));

  EXPECT_TRUE(flight.flies_plan());
}

TEST(FlightControl, AHoldOfBeforeIsNotTakenUpAgain) {
  Flight flight;
  flight.has_plan = false;
  flight.telemetry.is_following = true;
  flight.tick();
  flight.is_tracking = false;
  flight.telemetry.is_following = false;
  flight.telemetry.state.position_m.x() += 0.1;
  flight.tick();

  flight.telemetry.is_following = true;
  flight.tick();

  EXPECT_TRUE(flight.holds_at(kHome_m + Vector3d(0.1, 0.0, 0.0)));
}

TEST(FlightControl, APlanPassesTheGate) {
  GateConfig gate = Flight::wide_gate();
  gate.max_speed_mps = 0.3;
  Flight flight(gate);
  flight.telemetry.is_following = true;

  for (int i = 0; i < 500; ++i) {
    flight.tick();
    ASSERT_LE(flight.decision.setpoint->velocity_mps.norm(), 0.3);
  }

  EXPECT_GT(flight.control.gate_violations(), 100U);
}

TEST(FlightControl, AHoldPassesTheGate) {
  Flight flight;
  flight.fly_for(milliseconds(100));
  flight.is_tracking = false;

  flight.telemetry.state.position_m = {7.0, 2.0, 1.5};
  flight.tick();

  EXPECT_FALSE(flight.decision.setpoint.has_value()) << "outside of the fence";
  EXPECT_EQ(flight.control.gate_violations(), 1U);
}

TEST(FlightControl, AHoldWhileFollowingPassesTheGate) {
  Flight flight;
  flight.has_plan = false;
  flight.telemetry.state.position_m.z() = std::numeric_limits<double>::quiet_NaN();
  flight.telemetry.is_following = true;
  flight.is_tracking = false;

  flight.tick();

  EXPECT_FALSE(flight.decision.setpoint.has_value());
  EXPECT_EQ(flight.control.gate_violations(), 1U);
}

TEST(FlightControl, APositionThatIsNotANumberIsAstray) {
  Flight flight;
  flight.telemetry.is_following = true;
  flight.fly_for(seconds(2));
  flight.is_tracking = false;
  flight.telemetry.state.position_m.y() = std::numeric_limits<double>::quiet_NaN();

  flight.fly_for(seconds(1));

  EXPECT_TRUE(flight.control.is_astray());
}

}  // namespace
}  // namespace understory
