# Copyright 2026 the Understory authors
# SPDX-License-Identifier: BSD-3-Clause
"""The vehicle of hil/examples, which was written from the documentation alone: the bench host flies
it, and what docs/hil.md demands of any vehicle is demanded of it."""

import time
import unittest

from bench import ROOT, FlightTest

EXAMPLE = ROOT / "hil" / "examples" / "minimal_vehicle.py"


class TheMinimalVehicle(FlightTest):
    def start_example(self) -> None:
        vehicle = self.run_program(EXAMPLE, self.vehicle_bus)
        vehicle.wait_for_line("state 1, reason 1")

    def test_flies_and_lands(self) -> None:
        began_s = time.time()
        self.start_example()
        host = self.start_host("--duration", 4)

        self.assertEqual(host.wait(40.0), 0, host.lines)
        self.assert_lands(since_s=began_s)
        flown = [said for said in self.bus.of("SP_ACK") if said["AckResult"] == "FLOWN"]
        self.assertGreater(len(flown), 200)
        states = [state for state, _ in self.bus.states(began_s)]
        self.assertIn("ARMED", states)

    def test_holds_and_lands_without_setpoints(self) -> None:
        began_s = time.time()
        self.start_example()
        host = self.start_host("--duration", 60)
        self.bus.wait_for(
            "ODO_POS_Z", lambda said: said["OdoZ"] > 0.4, patience_s=10.0, since_s=began_s
        )

        killed_s = time.time()
        host.process.kill()

        hold = self.bus.wait_for_state("HOLD", since_s=killed_s)
        self.assert_after(0.25, killed_s, hold, "HOLD", early_s=0.02)
        self.assert_lands(since_s=killed_s)


if __name__ == "__main__":
    unittest.main()
