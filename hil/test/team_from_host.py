# Copyright 2026 the Understory authors
# SPDX-License-Identifier: BSD-3-Clause
"""`understory fly --team 2` seen from outside: each vehicle over a real bus of its own, in a kernel
of its own where one must be booted; one is lost on the way, the other completes the map.

Not part of the test command: it takes four processors."""

import json
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "src/understory_nodelets/onboard"), str(ROOT / "test/support")]
from fly_team import Mate, least_separation_m  # noqa: E402
from machine import PatientTest  # noqa: E402

SETUP = ROOT / "catkin_ws/devel/setup.bash"
PROGRAMS = ROOT / "catkin_ws/devel/lib"
FLY = ROOT / "src/understory_nodelets/onboard/fly.py"
PATIENCE_S = 110
LOST_AT_S = 8.0
SAFETY_DISTANCE_M = 0.8
LEAST_FRAMES = 1000


@unittest.skipIf((os.cpu_count() or 1) < 4, "it takes four processors")
class ATeam(PatientTest):
    def fly(self, *options):
        """Its exit status, and both vehicles."""
        folder = Path(tempfile.mkdtemp(prefix="hil_team_"))
        self.addCleanup(shutil.rmtree, folder, ignore_errors=True)
        words = f'. {SETUP}; exec /usr/bin/python3 -B "$@"'
        command = ["bash", "-c", words, "fly", FLY, "--scenario", "clearing", "--team", "2"]
        command += ["--onboard", PROGRAMS / "understory_nodelets/onboard"]
        command += ["--vehicle", PROGRAMS / "understory_hil/understory_vehicle"]
        command += ["--camera-size", "160x120", "--quiet", "--no-report", "--out", folder, *options]
        with open(folder / "said", "w", encoding="utf-8") as said:
            process = subprocess.Popen(
                list(map(str, command)),
                stdin=subprocess.DEVNULL,
                stdout=said,
                stderr=said,
                start_new_session=True,
            )
        try:
            return process.wait(PATIENCE_S), [Mate(n, folder / f"vehicle_{n}") for n in (0, 1)]
        finally:
            if process.poll() is None:
                os.killpg(process.pid, signal.SIGTERM)
                process.wait()
            print((folder / "said").read_text(encoding="utf-8"), flush=True)

    def test_completes_the_map_when_one_is_lost_on_the_way(self):
        status, mates = self.fly("--kill", f"0@{LOST_AT_S}")

        self.assertEqual(status, 0)
        self.assertFalse((mates[0].folder / "result.json").exists())
        result = json.loads((mates[1].folder / "result.json").read_text(encoding="utf-8"))
        self.assert_never(result["collisions"], "a collision")
        self.assertTrue(result["completed"], result)
        self.assertGreater(result["coverage"], 0.95)
        tracks = [mate.track() for mate in mates]
        self.assertGreater(least_separation_m(tracks, (True, False)), SAFETY_DISTANCE_M)
        for mate in mates:
            frames = (mate.folder / "bus.log").read_text(encoding="ascii").count("\n")
            self.assertGreater(frames, LEAST_FRAMES)
