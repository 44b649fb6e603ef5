# Copyright 2026 the Understory authors
# SPDX-License-Identifier: BSD-3-Clause
"""One end dies, stands still, or starts anew in flight. The host never arms again by itself."""

import time
import unittest
from typing import List

from bench import FlightTest, Program

BRIEF_S, LONG_S = 0.3, 1.5
LINK_LOST_S = 0.5
HOST_PERIOD_S = 0.01
TORN_S = 0.4  # the last odometry that was whole may be older
OLDEST_S = 0.1  # a setpoint older than that is not flown


class AVehicle(FlightTest):
    def assert_never_asked_again(self, since_s: float) -> None:
        asked = {said["ArmRequest"] for said in self.bus.of("ARM_CMD", since_s)}
        self.assert_never(asked - {"DISARM"}, "asked for another flight")
        armed = [said for said in self.bus.of("VEH_STATE", since_s) if said["State"] == "ARMED"]
        self.assert_never(armed, "ARMED again")

    def sessions(self, since_s: float = 0.0) -> List[int]:
        return sorted({said["ArmSession"] for said in self.bus.of("ARM_CMD", since_s)})

    def test_that_dies_and_comes_back_is_not_armed_again(self) -> None:
        vehicle, host = self.fly()
        before = self.sessions()

        died_s = vehicle.kill()
        heard_s = min(self.bus.of(name)[-1].stamp_s for name in ("ODO_RATE", "VEH_STATE"))
        lost = host.wait_for_line("FAULT ARMED .*fallen silent")
        time.sleep(0.2)
        last = self.bus.of("SP_COMMIT")[-1]
        self.start_vehicle()
        back_s = time.time()

        # It is down, and the host has flown: nothing remains to do.
        self.assertEqual(host.wait(10.0), 1, host.lines)
        self.assert_after(LINK_LOST_S - HOST_PERIOD_S, heard_s, last, "the last setpoint", TORN_S)
        self.assertLess(float(lost.split()[0]) - died_s, 1.0)
        self.assert_never_asked_again(back_s)
        self.assertEqual(self.sessions(), [before[0], before[0] + 1])

    def test_that_dies_and_comes_back_flies_again_when_somebody_asks(self) -> None:
        vehicle, _ = self.fly("--rearm")
        before = self.sessions()

        vehicle.kill()
        time.sleep(LINK_LOST_S + 0.3)
        began_s = time.time()
        self.start_vehicle()

        self.bus.wait_for_state("ARMED", since_s=began_s)
        self.assertEqual(self.sessions(began_s), [before[0] + 1])

    def test_that_stands_still_for_a_moment_flies_nothing_old(self) -> None:
        vehicle, _ = self.fly()

        vehicle.tell("freeze")
        time.sleep(BRIEF_S)
        back_s = time.time()
        vehicle.tell("resume")
        time.sleep(1.5)

        answers = self.bus.of("SP_ACK", back_s)
        stale = [said for said in answers if said["AckResult"] == "STALE"]
        oldest_us = max(said["AckDelay"] for said in answers if said["AckResult"] == "FLOWN")
        print(f"    {len(stale)} too old, the oldest flown {1e-3 * oldest_us:.1f} ms")
        self.assert_never(oldest_us > 1e6 * OLDEST_S, f"flown after {oldest_us} us")
        self.assertEqual(self.bus.states(back_s)[-1], ("ARMED", "NONE"))

    def test_that_stands_still_for_long_lands(self) -> None:
        vehicle, host = self.fly()
        before = self.sessions()

        vehicle.tell("freeze")
        host.wait_for_line("FAULT ARMED .*fallen silent")
        time.sleep(LONG_S - LINK_LOST_S)
        back_s = time.time()
        vehicle.tell("resume")

        self.bus.wait_for_state("LAND", patience_s=1.0, since_s=back_s)
        self.assert_lands(since_s=back_s)
        self.assert_never_asked_again(back_s + 0.1)
        self.assertEqual(self.sessions(), [before[0], before[0] + 1])

    def test_whose_autopilot_starts_anew_in_flight_stays_off(self) -> None:
        vehicle, host = self.fly()
        nonce = self.bus.of("VEH_STATE")[-1]["StateNonce"]

        began_s = time.time()
        vehicle.tell("restart")

        off = self.bus.wait_for_state("DISARMED", patience_s=2.0, since_s=began_s)
        self.assertNotEqual(off["StateNonce"], nonce)
        self.assertEqual(host.wait(10.0), 1, host.lines)
        self.assert_never_asked_again(off.stamp_s + 0.05)
        # Its motors are off: it falls.
        self.bus.wait_for("ODO_POS_Z", lambda said: said["OdoZ"] < 0.5, 3.0, began_s)


class AHost(FlightTest):
    def test_that_dies_is_replaced_by_another_that_arms_anew_after_the_landing(self) -> None:
        _, host = self.fly()
        first = self.bus.of("ARM_CMD")[-1]

        died_s = host.kill()
        time.sleep(0.4)
        second: Program = self.start_host("--duration", 1, "--patience", 15)

        # The vehicle holds; setpoints where it is end that, and the newcomer is never ARMED by it.
        self.assertEqual(second.wait(40.0), 0, second.lines)
        self.assertNotEqual(self.bus.of("ARM_CMD")[-1]["ArmSession"], first["ArmSession"])
        kinds = [state for state, _ in self.bus.states(died_s)]
        print(f"    {kinds}")
        self.assertIn("HOLD", kinds)


if __name__ == "__main__":
    unittest.main()
