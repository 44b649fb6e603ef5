# Copyright 2026 the Understory authors
# SPDX-License-Identifier: BSD-3-Clause
"""Somebody else floods the bus with random frames: nothing wrong is flown, nobody dies."""

import time
import unittest
from typing import Any, List

from bench import BY_NAME, HOST_BUS, SETPOINT, FlightTest, Program

FLOOD_S = 2.0
FARTHEST_M = 1.5  # in that time at 1 m/s, and to a stop
FOREIGN = "7FF"
SAFE = {"ARMED", "HOLD", "LAND", "DISARMED"}


class AFlood(FlightTest):
    def flood(self, *words: Any) -> None:
        """With random data; so many programs that each identifier has its own."""
        self.began_s = time.time()
        programs: List[Program] = []
        for number in words:
            command = ["cangen", HOST_BUS, "-I", number, "-L", 8, "-D", "r", "-i"]
            programs.append(self.run_program(*command, "-g", self.period_ms))
        time.sleep(FLOOD_S)
        for each in programs:
            each.stop()

    def identifiers(self, *names: str) -> List[str]:
        return [f"{BY_NAME[name].id:03X}" for name in names]

    def assert_safe(self, vehicle: Program, host: Program) -> None:
        self.assert_never(vehicle.process.poll() is not None, "the vehicle has died")
        self.assertIn(host.process.poll(), (None, 1), "the host has died")
        # Not what the listener hears: the flood says anything.
        said = {line.split()[1] for line in vehicle.lines if line[:1].isdigit()}
        print(f"    the vehicle: {[line.split()[1:3] for line in vehicle.lines[2:]]}")
        self.assert_never(said - SAFE - {"ARMING"}, "no safe state")
        path = list(self.bus.positions(self.began_s - 0.1))
        _, x_m, y_m, z_m = path[0]
        farthest_m = max(max(abs(x - x_m), abs(y - y_m), z - z_m) for _, x, y, z in path)
        print(f"    went at most {farthest_m:.2f} m on")
        self.assertLess(farthest_m, FARTHEST_M + FLOOD_S)

    def assert_flies_on(self, vehicle: Program) -> None:
        time.sleep(0.5)
        self.assertEqual(vehicle.lines[-1].split()[1], "ARMED")
        since_s = time.time() - 0.3
        flown = [s for s in self.bus.of("SP_ACK", since_s) if s["AckResult"] == "FLOWN"]
        self.assertGreater(len(flown), 5)

    def test_of_foreign_identifiers_at_full_speed_is_flown_through(self) -> None:
        vehicle, host = self.fly()

        self.period_ms = 0
        self.flood(FOREIGN)

        self.assert_safe(vehicle, host)
        self.assert_flies_on(vehicle)

    def test_of_the_setpoints_is_another_host_and_ends_the_flight(self) -> None:
        vehicle, host = self.fly()

        self.period_ms = 2
        self.flood(*self.identifiers(*SETPOINT))

        host.wait_for_line("FAULT .*another host sends on this bus")
        self.assert_safe(vehicle, host)
        vehicle.wait_for_line("LAND")
        vehicle.wait_for_line("DISARMED (LANDED|.*SILENCE|HOST_REQUEST)", 15.0)

    def test_of_arming_and_heartbeats_arms_nothing(self) -> None:
        vehicle = self.start_vehicle()

        self.period_ms = 1
        self.flood(*self.identifiers("ARM_CMD", "HOST_HB", "SP_COMMIT"))

        said = [line.split()[1] for line in vehicle.lines if line[:1].isdigit()]
        self.assert_never(set(said) - {"DISARMED", "ARMING"}, "random frames led to")
        self.assert_never(vehicle.process.poll() is not None, "the vehicle has died")

    def test_of_kill_kills_nothing(self) -> None:
        vehicle, host = self.fly()

        self.period_ms = 1
        self.flood(*self.identifiers("KILL"))

        # Some pass the checksum, none has the magic.
        passed = [s for s in self.bus.of("KILL", self.began_s) if s["KillMagic"] != "MAGIC"]
        print(f"    {len(passed)} with a right checksum")
        self.assert_safe(vehicle, host)
        self.assert_never("KILLED" in " ".join(vehicle.lines), "killed without the magic")

    def test_of_odometry_is_another_vehicle_and_ends_the_flight(self) -> None:
        vehicle, host = self.fly()

        self.period_ms = 2
        self.flood(*self.identifiers("ODO_POS_XY", "ODO_POS_Z"))

        vehicle.wait_for_line("LAND FOREIGN_VEHICLE")
        self.assertIsNone(vehicle.process.poll())
        self.assertIn(host.process.poll(), (None, 1))


if __name__ == "__main__":
    unittest.main()
