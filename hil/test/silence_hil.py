# Copyright 2026 the Understory authors
# SPDX-License-Identifier: BSD-3-Clause
"""What silence does, to the vehicle and to the host: each time-out of docs/can_protocol.md."""

import time
import unittest
from typing import List

from bench import ODOMETRY, SETPOINT, FlightTest, Said
from wire_bench import WireTest

HIL_OPTIONS = ["--interfaces", "2"]
LATE_S, HOLD_S, LAND_S = 0.05, 0.25, 1.0
ODOMETRY_S, LINK_S = 0.1, 0.5
HOST_PERIOD_S = 0.01
TORN_S = 0.4  # the last odometry that was whole may be older
FARTHEST_M = 1.5  # from where the last setpoint was flown, at 1 m/s


class AHostThatDies(FlightTest):
    def test_makes_the_vehicle_hold_and_land_where_it_is(self) -> None:
        _, host = self.fly()
        time.sleep(2.5)  # until it circles

        died_s = host.kill()

        hold = self.bus.wait_for_state("HOLD", since_s=died_s)
        land = self.bus.wait_for_state("LAND", since_s=died_s)
        commit = self.bus.last_flown(hold.stamp_s)
        heartbeat = self.bus.of("HOST_HB", until_s=land.stamp_s)[-1]
        self.assert_after(HOLD_S, commit.stamp_s, hold, "HOLD")
        self.assertEqual(hold["StateReason"], "SETPOINT_SILENCE")
        # The heartbeat is older than the last setpoint, at most by its period.
        self.assert_after(LAND_S, heartbeat.stamp_s, land, "LAND")
        self.assertEqual(land["StateReason"], "HOST_SILENCE")
        self.assert_lands(since_s=died_s)
        self.assert_stayed_near(died_s)

    def assert_stayed_near(self, since_s: float) -> None:
        path = list(self.bus.positions(since_s))
        _, x_m, y_m, z_m = path[0]
        farthest_m = max(abs(x - x_m) + abs(y - y_m) for _, x, y, _ in path)
        highest_m = max(z - z_m for _, _, _, z in path)
        print(f"    went {farthest_m:.2f} m on, {highest_m:.2f} m up")
        self.assertLess(farthest_m, FARTHEST_M)
        self.assertLess(highest_m, 0.5)


class SilenceOfTheHost(WireTest):
    """In one direction, of one kind of message."""

    def last(self, name: str, before_s: float) -> float:
        self.far_bus.catch_up()
        return self.far_bus.of(name, until_s=before_s)[-1].stamp_s

    def test_of_setpoints_means_late_then_hold_then_land(self) -> None:
        self.fly()

        silent_s = self.wire.become(to="vehicle", drop=SETPOINT)

        late = self.bus.wait_for("VEH_STATE", lambda said: said["FlagLate"] == 1, since_s=silent_s)
        hold = self.bus.wait_for_state("HOLD", since_s=silent_s)
        land = self.bus.wait_for_state("LAND", since_s=silent_s)
        self.far_bus.catch_up()
        begin_s = self.far_bus.last_flown(hold.stamp_s).stamp_s
        self.assert_after(LATE_S, begin_s, late, "FlagLate")
        self.assert_after(HOLD_S, begin_s, hold, "HOLD")
        self.assert_after(LAND_S, begin_s, land, "LAND")
        self.assertEqual(land["StateReason"], "SETPOINT_SILENCE")
        # A landing goes on to the end, whatever comes then.
        back_s = self.wire.become()
        self.assert_lands(since_s=back_s)
        self.assertLessEqual({state for state, _ in self.bus.states(back_s)}, {"LAND", "DISARMED"})

    def test_of_setpoints_for_a_moment_ends_with_flying_on(self) -> None:
        self.fly()

        silent_s = self.wire.become(to="vehicle", drop=SETPOINT)
        self.bus.wait_for_state("HOLD", since_s=silent_s)
        back_s = self.wire.become()

        self.bus.wait_for_state("ARMED", patience_s=1.0, since_s=back_s)
        time.sleep(0.5)
        self.assertEqual(self.bus.states(back_s)[-1], ("ARMED", "NONE"))

    def test_of_heartbeats_means_land(self) -> None:
        self.fly()

        silent_s = self.wire.become(to="vehicle", drop=["HOST_HB"])

        land = self.bus.wait_for_state("LAND", since_s=silent_s)
        self.assert_after(LAND_S, self.last("HOST_HB", land.stamp_s), land, "LAND")
        self.assertEqual(land["StateReason"], "HOST_SILENCE")
        self.assertNotIn("HOLD", [state for state, _ in self.bus.states(silent_s)])


class SilenceOfTheVehicle(WireTest):
    def commits(self, since_s: float) -> List[Said]:
        return self.bus.of("SP_COMMIT", since_s)

    def assert_link_lost(self, begin_s: float) -> None:
        last = self.commits(begin_s)[-1]
        self.assert_after(LINK_S - HOST_PERIOD_S, begin_s, last, "the last setpoint", TORN_S)

    def sessions(self) -> List[int]:
        return sorted({said["ArmSession"] for said in self.bus.of("ARM_CMD")})

    def test_of_odometry_means_hold_and_then_no_setpoints(self) -> None:
        _, host = self.fly()
        before = self.sessions()

        silent_s = self.wire.become(to="host", drop=ODOMETRY)
        host.wait_for_line("FAULT ARMED .*fallen silent")
        time.sleep(0.3)
        self.bus.catch_up()

        begin_s = self.bus.of("ODO_RATE")[-1].stamp_s
        # A landing vehicle no longer reports standstills by what this end hears of odometry.
        hold = self.bus.wait_for(
            "SP_COMMIT", lambda said: said["SpMode"] == "HOLD", 0.0, begin_s
        )
        self.assert_after(ODOMETRY_S, begin_s, hold, "setpoints HOLD", TORN_S)
        self.assert_link_lost(begin_s)
        self.assertEqual(self.sessions(), [before[0], before[0] + 1])
        # Nobody asks for arming any more, so it lands; the host neither.
        asked = {said["ArmRequest"] for said in self.bus.of("ARM_CMD", begin_s + LINK_S + 0.05)}
        self.assert_never(asked - {"DISARM"}, "asked for another flight")
        self.assert_lands(since_s=silent_s)

    def test_of_odometry_for_a_moment_ends_with_flying_on(self) -> None:
        _, host = self.fly()
        before = self.sessions()

        self.wire.become(to="host", drop=ODOMETRY)
        time.sleep(0.25)
        back_s = self.wire.become()

        self.bus.wait_for("SP_COMMIT", lambda said: said["SpMode"] == "TRACK", 1.0, back_s)
        time.sleep(0.3)
        self.assertEqual(self.bus.states(back_s), [("ARMED", "NONE")])
        self.assertEqual(self.sessions(), before)
        self.assertNotIn("FAULT", " ".join(host.lines[2:]))

    def test_of_its_state_means_no_setpoints(self) -> None:
        _, host = self.fly()
        before = self.sessions()

        self.wire.become(to="host", drop=["VEH_STATE"])
        host.wait_for_line("FAULT ARMED .*fallen silent")
        time.sleep(0.2)
        self.bus.catch_up()

        begin_s = self.bus.of("VEH_STATE")[-1].stamp_s
        self.assert_link_lost(begin_s)
        self.assertEqual(self.sessions(), [before[0], before[0] + 1])


if __name__ == "__main__":
    unittest.main()
