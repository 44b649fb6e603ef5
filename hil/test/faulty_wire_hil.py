# Copyright 2026 the Understory authors
# SPDX-License-Identifier: BSD-3-Clause
"""A flight over a wire that loses, repeats, reorders, corrupts and forges frames."""

import bisect
import math
import random
import time
import unittest
from typing import Any, List

from bench import FLYING, HOST_BUS, Said
from wire_bench import WireTest

HIL_OPTIONS = ["--interfaces", "2"]
FLIGHT_S = 3.0
HOLD_S = 0.25
HEARD_S = 0.5  # ago at most, or else it holds
FARTHEST_M = 0.6
JUMP_MM = 5000
SAFE = {("ARMED", "NONE"), ("HOLD", "SETPOINT_SILENCE"), ("HOLD", "LINK_FAULT"),
        ("LAND", "SETPOINT_SILENCE"), ("LAND", "HOST_SILENCE"), ("LAND", "HOST_REQUEST"),
        ("DISARMED", "LANDED")}  # fmt: skip


class AFaultyWire(WireTest):
    def setUp(self) -> None:
        self.seed = random.SystemRandom().randrange(1 << 31)
        super().setUp()
        self.heights = self.listen(HOST_BUS, ("SP_POS_Z",))
        print(f"    seed {self.seed}")

    def fly_through(self, **faults: Any) -> float:
        """Returns since when."""
        self.fly()
        began_s = self.wire.become(**faults)
        time.sleep(FLIGHT_S)
        self.wire.become()
        return began_s

    def wanted_until(self, name: str, stamp_s: float) -> List[Said]:
        """Setpoints before the wire; the vehicle may have heard any of the last ones."""
        said, stamps = self.wanted[name]
        return said[bisect.bisect(stamps, stamp_s - HEARD_S) : bisect.bisect(stamps, stamp_s)]

    def assert_followed(self, since_s: float) -> None:
        """The vehicle is where the host's own setpoints wanted it."""
        self.wanted = {}
        for name, bus in (("SP_POS_XY", self.bus), ("SP_POS_Z", self.heights)):
            said = bus.of(name, since_s - 2 * HEARD_S)
            self.wanted[name] = (said, [each.stamp_s for each in said])
        worst_m = highest_m = 0.0
        for stamp_s, x_m, y_m, z_m in self.bus.positions(since_s):
            near = self.wanted_until("SP_POS_XY", stamp_s)
            away = [math.hypot(x_m - each["SpX"], y_m - each["SpY"]) for each in near]
            worst_m = max(worst_m, min(away, default=0.0))
            above = [abs(z_m - each["SpZ"]) for each in self.wanted_until("SP_POS_Z", stamp_s)]
            highest_m = max(highest_m, min(above, default=0.0))
        states = self.bus.states(since_s)
        print(f"    at most {worst_m:.2f} m and {highest_m:.2f} m in height from what was wanted")
        self.assertLess(max(worst_m, highest_m), FARTHEST_M)
        self.assertLessEqual(set(states), SAFE)

    def counted(self, name: str, since_s: float) -> int:
        """By the vehicle's own counter; it wraps at 256."""
        codes = [said[name] for said in self.bus.of("VEH_LINK", since_s - 1.0)]
        return sum((after - before) % 256 for before, after in zip(codes, codes[1:]))

    def test_that_loses_every_tenth_frame_is_flown_through(self) -> None:
        began_s = self.fly_through(loss=0.1)

        self.bus.wait_for("VEH_LINK", since_s=time.time())
        self.assert_followed(began_s)
        lost, torn = self.counted("VlLost", began_s), self.counted("VlTorn", began_s)
        flown = [said for said in self.far_bus.of("SP_ACK", began_s)]
        print(f"    vehicle counted {lost} lost, {torn} torn; {len(flown)} answers")
        self.assertGreater(lost, 50)
        self.assertGreater(torn, 20)
        self.assertGreater(len(flown), 100)

    def test_that_repeats_frames_is_flown_through(self) -> None:
        began_s = self.fly_through(duplicate=0.3)

        self.assert_followed(began_s)
        self.assertEqual(self.bus.states(began_s), [("ARMED", "NONE")])

    def test_that_reorders_frames_is_flown_through(self) -> None:
        began_s = self.fly_through(reorder=0.1)

        self.assert_followed(began_s)

    def test_that_corrupts_frames_is_flown_through(self) -> None:
        began_s = self.fly_through(corrupt=0.05)

        self.bus.wait_for("VEH_LINK", since_s=time.time())
        self.assert_followed(began_s)
        wrong = self.counted("VlCrcErr", began_s)
        print(f"    vehicle counted {wrong} wrong")
        self.assertGreater(wrong, 20)

    def test_that_does_everything_ends_in_a_safe_state(self) -> None:
        began_s = self.fly_through(loss=0.1, duplicate=0.1, reorder=0.1, corrupt=0.1)

        self.assert_followed(began_s)
        self.assertIn(self.bus.of("VEH_STATE")[-1]["State"], FLYING)

    def test_that_forges_positions_is_refused(self) -> None:
        self.fly()

        began_s = self.wire.become(to="vehicle", rewrite={"SP_POS_XY": {"SpX": JUMP_MM}})
        hold = self.bus.wait_for_state("HOLD", since_s=began_s)
        time.sleep(0.5)

        answers = self.far_bus.of("SP_ACK", began_s + 0.1, hold.stamp_s + 0.3)
        results = {said["AckResult"] for said in answers}
        self.assertIn("LIMITS", results)
        self.assert_never("FLOWN" in results, "a setpoint 5 m off was flown")
        self.assert_followed(began_s)


class AWireWithoutOneMessage(WireTest):
    """A setpoint without one of its frames is none."""

    def check(self, name: str) -> None:
        self.fly()
        began_s = self.wire.become(to="vehicle", drop=[name])
        hold = self.bus.wait_for_state("HOLD", since_s=began_s)
        last = self.far_bus.last_flown(hold.stamp_s)
        self.assert_after(HOLD_S, last.stamp_s, hold, f"without {name} HOLD")
        back_s = self.wire.become()
        self.bus.wait_for_state("ARMED", patience_s=0.6, since_s=back_s)

    def test_that_is_sp_pos_xy_holds(self) -> None:
        self.check("SP_POS_XY")

    def test_that_is_sp_pos_z_holds(self) -> None:
        self.check("SP_POS_Z")

    def test_that_is_sp_vel_holds(self) -> None:
        self.check("SP_VEL")

    def test_that_is_sp_acc_holds(self) -> None:
        self.check("SP_ACC")

    def test_that_is_sp_commit_holds(self) -> None:
        self.check("SP_COMMIT")


if __name__ == "__main__":
    unittest.main()
