# Copyright 2026 the Understory authors
# SPDX-License-Identifier: BSD-3-Clause
"""A log that is played back arms nothing and moves nothing."""

import tempfile
import time
import unittest
from pathlib import Path

from bench import BY_ID, HOST_BUS, MEMORY, FlightTest
from can_tools import must_run

FLIGHT_S = 2
STILL_M = 0.01


class AReplay(FlightTest):
    def setUp(self) -> None:
        super().setUp()
        folder = tempfile.TemporaryDirectory(prefix="replay_hil_", dir=MEMORY)
        self.addCleanup(folder.cleanup)
        self.log_path = Path(folder.name) / "flight.log"
        self.host_path = Path(folder.name) / "host.log"

    def record(self) -> None:
        """A flight from arming to landing; and what the host said until it landed."""
        began_s = time.time()
        self.vehicle = self.start_vehicle()
        host = self.start_host("--log", self.log_path, "--duration", FLIGHT_S)
        self.assertEqual(host.wait(40.0), 0, host.lines)
        landing_s = self.bus.wait_for_state("LAND", since_s=began_s).stamp_s
        lines = self.log_path.read_text(encoding="ascii").splitlines(keepends=True)
        flight = [line for line in lines if float(line[1:].split(")")[0]) < landing_s]
        self.log_path.write_text("".join(flight), encoding="ascii")
        ours = [l for l in flight if BY_ID[int(l.split(" ")[2][:3], 16)].sender == "HOST"]
        self.host_path.write_text("".join(ours), encoding="ascii")

    def replay(self, path: Path) -> int:
        """How many setpoints the vehicle says that it has flown in its life."""
        began_s = time.time()
        before = list(self.bus.positions())[-1][1:]
        must_run("canplayer", "-I", path, f"{HOST_BUS}={HOST_BUS}", patience_s=40.0)

        states = {said["State"] for said in self.bus.of("VEH_STATE", began_s + 0.1)}
        answers = self.bus.of("SP_ACK", began_s + 0.1)
        # Of the whole log the listener hears the old vehicle too; the program's lines are its own.
        said = [line.split()[1] for line in self.vehicle.lines[self.heard :] if line[:1].isdigit()]
        self.assertGreater(len(self.bus.of("ARM_CMD", began_s)), 10 * FLIGHT_S)
        print(f"    {len(answers)} answers, states {states}, said {said}")
        self.assert_never("ARMED" in said, "armed by a replay")
        if path == self.host_path:
            self.assertGreater(len(self.bus.of("SP_COMMIT", began_s)), 50 * FLIGHT_S)
            self.assertGreater(len(answers), 0)
            self.assert_never("ARMED" in states, "armed by a replay")
            flown = [said for said in answers if said["AckResult"] == "FLOWN"]
            self.assert_never(flown, "flown by a replay")
            after = list(self.bus.positions())[-1][1:]
            self.assertLess(sum(abs(a - b) for a, b in zip(after, before)), STILL_M)
        self.vehicle.stop()
        return int(self.vehicle.lines[-1].split()[-3])

    def test_to_the_vehicle_that_flew_it_moves_nothing(self) -> None:
        self.record()

        self.heard = len(self.vehicle.lines)
        self.replay(self.host_path)

    def test_to_a_vehicle_that_was_switched_on_anew_moves_nothing(self) -> None:
        for path in (self.host_path, self.log_path):
            self.record()
            self.vehicle.stop()
            self.vehicle = self.start_vehicle()
            self.bus.wait_for("ODO_POS_Z", lambda said: said["OdoZ"] == 1.0, since_s=time.time())
            self.heard = 0
            self.assert_never(self.replay(path), "setpoints flown")


if __name__ == "__main__":
    unittest.main()
