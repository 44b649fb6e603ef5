# Copyright 2026 the Understory authors
# SPDX-License-Identifier: BSD-3-Clause
"""The interface goes down, or away, in flight: both ends come back, with nothing of before."""

import time
import unittest
from typing import List

from bench import HOST_BUS, FlightTest, Listener, Program
from can_tools import must_run

AWAY_S = 1.5
REOPENED_S = 1.5  # the longest back-off, and a little


class AnInterface(FlightTest):
    """The host is told to arm again whenever it can (--rearm), so that it shows when it may not."""

    def tearDown(self) -> None:
        must_run("ip", "link", "set", HOST_BUS, "up")  # for the next test

    def sessions(self, bus: Listener, since_s: float = 0.0) -> List[int]:
        return sorted({said["ArmSession"] for said in bus.of("ARM_CMD", since_s)})

    def check_recovery(self, bus: Listener, host: Program, up_s: float, before: List[int]) -> None:
        """`bus` heard the first frames after it was up again."""
        first = bus.wait_for("VEH_STATE", since_s=up_s)
        self.assertIn(first["State"], ("HOLD", "LAND", "DISARMED"))
        self.assertLess(first.stamp_s - up_s, REOPENED_S)
        command = bus.wait_for("ARM_CMD", since_s=up_s)
        self.assert_never(command["ArmRequest"] != "DISARM", "asked for arming at once")
        self.assert_never(command["ArmSession"] in before, "an old session went on")
        host.wait_for_line("FAULT .*the bus is down")

        flown = bus.wait_for_state("ARMED", patience_s=20.0, since_s=up_s)

        states = bus.states(up_s)
        print(f"    after the bus was back: {states}")
        self.assertIn("DISARMED", [state for state, _ in states])
        # What was sent before the handshake was over is not flown, and nothing old ever.
        answers = bus.of("SP_ACK", up_s)
        early = {said["AckResult"] for said in answers if said.stamp_s < flown.stamp_s - 0.05}
        self.assert_never("FLOWN" in early, "flown before it was armed")
        self.assertNotIn("STALE", {said["AckResult"] for said in answers})
        self.assertEqual(len(self.sessions(bus, up_s)), 1)
        self.assertGreaterEqual(host.counters()["reopened"], 1)

    def test_that_is_down_for_a_while_comes_back_with_a_new_session(self) -> None:
        vehicle, host = self.fly("--rearm")
        before = self.sessions(self.bus)

        must_run("ip", "link", "set", HOST_BUS, "down")
        time.sleep(AWAY_S)
        up_s = time.time()
        must_run("ip", "link", "set", HOST_BUS, "up")

        # Meanwhile it has begun to land by itself.
        vehicle.wait_for_line("LAND (SETPOINT|HOST)_SILENCE")
        self.check_recovery(self.bus, host, up_s, before)

    def test_that_is_deleted_and_made_anew_comes_back_with_a_new_session(self) -> None:
        vehicle, host = self.fly("--rearm")
        before = self.sessions(self.bus)

        must_run("ip", "link", "del", HOST_BUS)
        time.sleep(AWAY_S)
        must_run("ip", "link", "add", "dev", HOST_BUS, "type", "vcan")
        bus = self.listen(HOST_BUS)
        up_s = time.time()
        must_run("ip", "link", "set", HOST_BUS, "up")

        vehicle.wait_for_line("LAND (SETPOINT|HOST)_SILENCE")
        self.check_recovery(bus, host, up_s, before)

    def test_that_blinks_ends_the_flight_too(self) -> None:
        _, host = self.fly()
        before = self.sessions(self.bus)

        must_run("ip", "link", "set", HOST_BUS, "down")
        up_s = time.time()
        must_run("ip", "link", "set", HOST_BUS, "up")

        # A new session asks for nothing, and that means: land.
        self.assert_lands(since_s=up_s)
        self.assertEqual(self.sessions(self.bus, up_s), [before[0] + 1])
        self.assertEqual(host.wait(10.0), 1)


if __name__ == "__main__":
    unittest.main()
