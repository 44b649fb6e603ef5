# Copyright 2026 the Understory authors
# SPDX-License-Identifier: BSD-3-Clause
"""What fails on the vehicle in flight, and what it does then; and the way to stop it at once."""

import time
import unittest
from typing import Any

from bench import Said, FlightTest

NOTICED_S = 0.1  # the listener of the vehicle's standard input wakes every 20 ms
LANDED_M = 0.3


class AFailure(FlightTest):
    def after(self, fault: str) -> Said:
        """The first state after `fault` that is no longer ARMED."""
        vehicle, _ = self.fly()
        vehicle.tell(fault)
        return self.bus.wait_for_state("HOLD", "LAND", "DISARMED", "KILLED", since_s=time.time())

    def assert_said(self, said: Said, state: str, reason: str, **flags: Any) -> None:
        self.assertEqual((said["State"], said["StateReason"]), (state, reason))
        self.assertEqual({name: said[name] for name in flags}, flags)

    def test_of_a_motor_means_land(self) -> None:
        said = self.after("fail_esc 1")

        self.assert_said(said, "LAND", "ESC", FlagEscFailed=1, FlagSensors=0)
        # With three motors it comes down, one way or another, and is not armed again.
        self.bus.wait_for("ODO_POS_Z", lambda s: s["OdoZ"] < LANDED_M, 10.0, said.stamp_s)

    def test_of_the_sensors_means_land_and_no_odometry(self) -> None:
        said = self.after("lose_sensors")

        self.assert_said(said, "LAND", "SENSORS", FlagSensors=1, FlagEscFailed=0)
        time.sleep(0.3)
        quality = self.bus.of("ODO_RATE")[-1]["OdoQuality"]
        self.assertEqual(quality, "INVALID")

    def test_of_the_battery_means_land(self) -> None:
        said = self.after("drain 2")

        self.assert_said(said, "LAND", "BATTERY", FlagBattEmpty=1)
        self.assert_lands(since_s=said.stamp_s)

    def test_that_leaves_some_of_the_battery_is_told_only(self) -> None:
        vehicle, host = self.fly()

        began_s = time.time()
        vehicle.tell("drain 15")

        said = self.bus.wait_for("VEH_STATE", lambda s: s["FlagBattLow"] == 1, 2.0, began_s)
        self.assert_said(said, "ARMED", "NONE", FlagBattEmpty=0)
        host.wait_for_line(r"FLYING .* battery 1\d %")

    def test_of_the_host_to_be_polite_stops_the_motors_at_once(self) -> None:
        self.start_vehicle()
        host = self.start_host("--duration", 2, "--kill")

        self.assertEqual(host.wait(20.0), 0, host.lines)

        first = self.bus.of("KILL")[0]
        killed = self.bus.wait_for_state("KILLED")
        self.assertEqual(killed["StateReason"], "KILL")
        self.assert_after(0.0, first.stamp_s, killed, "KILLED")
        self.assertEqual({said["KillMagic"] for said in self.bus.of("KILL")}, {"MAGIC"})
        # Confirmed, it is no longer sent, and nothing but its power switch brings it back.
        self.assertEqual(self.bus.of("KILL", killed.stamp_s + 0.1), [])
        again = self.start_host("--duration", 1, "--patience", 2)
        self.assertEqual(again.wait(20.0), 1)
        states = {state for state, _ in self.bus.states(killed.stamp_s)}
        self.assert_never(states - {"KILLED"}, "after KILL")


if __name__ == "__main__":
    unittest.main()
