# Copyright 2026 the Understory authors
# SPDX-License-Identifier: BSD-3-Clause
"""A flight on which nothing goes wrong, and what logs say of it."""

import tempfile
import unittest
from pathlib import Path
from typing import Any

from bench import HOST_BUS, MEMORY, FlightTest, program, summary_of
from can_tools import wait_until

RADIUS_M = 1.0
TRACKING_M = 0.3
FEW = 0.02  # of a flight without losses, where the machine never stood still


class AFlight(FlightTest):
    def setUp(self) -> None:
        super().setUp()
        folder = tempfile.TemporaryDirectory(prefix="flight_hil_", dir=MEMORY)
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)
        self.log_path = self.folder / "own.log"

    def fly_and_land(self, *words: Any) -> None:
        dump = self.run_program("env", "-C", self.folder, "candump", "-l", "-r", 8388608, HOST_BUS)
        wait_until(lambda: list(self.folder.glob("candump*")), "candump's file")
        self.start_vehicle()
        host = self.start_host("--log", self.log_path, *words)
        self.assertEqual(host.wait(40.0), 0, host.lines)
        self.assertEqual(dump.stop(), 0)
        self.dump_path = next(self.folder.glob("candump*"))

    def few(self) -> float:
        """What is late or lost while the machine stands still is no fault of the flight."""
        return FEW + self.machine.part_late()

    def check_answers(self) -> None:
        """Of sets that wait together because the vehicle was late only the newest is answered."""
        commits = self.bus.of("SP_COMMIT")
        answers = self.bus.of("SP_ACK")
        acks = {(said["AckSeq"], int(said.stamp_s) - late) for said in answers for late in (0, 1)}
        unanswered = [s for s in commits if (s["SpSeq"], int(s.stamp_s)) not in acks]
        results = {said["AckResult"] for said in answers}
        print(f"    {len(commits)} sets, {len(unanswered)} without an answer, {results}")
        self.assertLessEqual(len(unanswered), self.few() * len(commits))
        self.assertLessEqual({"FLOWN", "NOT_ARMED"}, results)
        self.assertLessEqual(results, {"FLOWN", "NOT_ARMED", "OVERRULED", "STALE"})

    def check_logs(self) -> None:
        """Frame by frame, with the same stamps; candump was there before and after."""
        ours, theirs = (
            path.read_text(encoding="ascii").splitlines()
            for path in (self.log_path, self.dump_path)
        )
        begin = theirs.index(ours[0])
        self.assertEqual(theirs[begin : begin + len(ours)], ours)

    def check_summary(self) -> None:
        for path in (self.log_path, self.dump_path):
            summary = summary_of(path)
            spans = [(span["state"], span["reason"]) for span in summary["vehicle"]]
            lost = {name: s["lost"] for name, s in summary["messages"].items() if s["lost"]}
            print(f"    {path.name}: {summary['frames']} frames, lost: {lost}, {spans}")
            self.assertEqual(spans[-3:], [("ARMED", "NONE"), ("LAND", "HOST_REQUEST"),
                                          ("DISARMED", "LANDED")])  # fmt: skip
            self.assertEqual(summary["other"], {})
            self.assertEqual(summary["foreign"], [])
            for name, stream in summary["messages"].items():
                wrong = stream["checksum"] + stream["code"] + stream["length"] + stream["repeated"]
                self.assertEqual(wrong, 0, f"{path.name}: {name}")
                self.assertLessEqual(stream["lost"], 2 + self.few() * stream["count"], name)
            for name, sets in summary["sets"].items():
                self.assertLessEqual(sets["torn"], 2 + self.few() * sets["complete"], name)

    def test_arms_flies_and_lands_and_logs_tell_all_of_it(self) -> None:
        self.fly_and_land("--duration", 4)

        self.check_answers()
        self.check_logs()
        self.check_summary()

    def test_follows_the_circle_it_was_told(self) -> None:
        self.fly_and_land("--duration", 5)

        flown = self.bus.of("SP_POS_XY")
        worst_m = 0.0
        armed_s = self.bus.wait_for_state("ARMED").stamp_s
        landing_s = self.bus.wait_for_state("LAND").stamp_s
        for stamp_s, x_m, y_m, _ in self.bus.positions(armed_s):
            wanted = [said for said in flown if abs(said.stamp_s - stamp_s) < 0.008]
            if wanted and stamp_s < landing_s:
                away_m = min(abs(x_m - w["SpX"]) + abs(y_m - w["SpY"]) for w in wanted)
                worst_m = max(worst_m, away_m)
        print(f"    at most {worst_m:.3f} m off")
        self.assertLess(worst_m, TRACKING_M)

    def test_needs_no_privileges(self) -> None:
        nobody = ["setpriv", "--reuid=65534", "--regid=65534", "--clear-groups"]
        began = [*nobody, program("understory_vehicle"), "--interface", HOST_BUS]
        vehicle = self.run_program(*began)
        vehicle.wait_for_line("DISARMED")
        host = self.run_program(
            *nobody, program("understory_host"), "--height", 0.2, "--duration", 1
        )

        self.assertEqual(host.wait(40.0), 0, host.lines)


if __name__ == "__main__":
    unittest.main()
