# Copyright 2026 the Understory authors
# SPDX-License-Identifier: BSD-3-Clause
"""Two vehicles of a team, each with an onboard process, a ROS master and a bus of its own: one is
lost on the way, or the user has seen enough."""

import json
import os
import shlex
import signal
import sys
import tempfile
import time
from pathlib import Path
from typing import Any, List

from bench import MEMORY, ROOT, FlightTest, Program

sys.path.append(str(ROOT / "src" / "understory_nodelets" / "onboard"))
from fly_team import (  # noqa: E402  pylint: disable=wrong-import-position
    Mate,
    last_tick,
    least_separation_m,
)

HIL_OPTIONS = ["--interfaces", "2"]
TREE = Path(os.environ.get("UNDERSTORY_ROOT", ROOT))
WORKSPACE = TREE / "catkin_ws" / "devel"
ONBOARD = WORKSPACE / "lib" / "understory_nodelets" / "onboard"
VEHICLE = WORKSPACE / "lib" / "understory_hil" / "understory_vehicle"
FLY = TREE / "src" / "understory_nodelets" / "onboard" / "fly.py"
# As fly.py does it where a kernel is booted: its processor is shared by all.
LITTLE = ["--bus-rate", "40", "--camera-rate", "5", "--camera-size", "160x120"]
LITTLE += ["--overrides", "replan: {lead_s: 0.5}"]
PATIENCE_S = 110.0
STOP_PATIENCE_S = 60.0
SAFETY_DISTANCE_M = 0.8
LEAST_FRAMES = 1000


class ATeam(FlightTest):
    def setUp(self) -> None:
        super().setUp()
        for path in (ONBOARD, VEHICLE):
            if not path.exists():
                self.skipTest(f"{path} is not built")
        folder = tempfile.TemporaryDirectory(prefix="team_hil_", dir=MEMORY)
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)
        self.mates = [Mate(number, self.folder / f"vehicle_{number}") for number in (0, 1)]

    def start_team(self, *words: Any) -> Program:
        command = ["/usr/bin/python3", "-B", FLY, "--bus", "vcan0", "--team", "2", *LITTLE]
        command += ["--scenario", "clearing", "--onboard", ONBOARD, "--vehicle", VEHICLE]
        command += ["--out", self.folder, "--quiet", "--no-report", *words]
        line = shlex.join(map(str, command))
        team = self.run_program("bash", "-c", f". {WORKSPACE}/setup.bash; exec {line}")
        self.addCleanup(team.stop, STOP_PATIENCE_S)
        return team

    def result_of(self, mate: Mate) -> dict:
        result = json.loads((mate.folder / "result.json").read_text(encoding="utf-8"))
        print(f"    {({key: result[key] for key in list(result)[:8]})}")
        self.assert_never(result["collisions"], "a collision")
        return result

    def frames_of(self, mate: Mate) -> List[str]:
        return (mate.folder / "bus.log").read_text(encoding="ascii").splitlines()

    def test_completes_the_map_when_one_is_lost_on_the_way(self) -> None:
        team = self.start_team("--kill", "0@8")

        status = team.wait(PATIENCE_S)

        result = self.result_of(self.mates[1])
        self.assertEqual(status, 0)
        self.assertFalse((self.mates[0].folder / "result.json").exists())
        self.assertTrue(result["completed"])
        self.assertGreater(result["coverage"], 0.95)
        tracks = [mate.track() for mate in self.mates]
        separation_m = least_separation_m(tracks, (True, False))
        self.assert_never(separation_m < SAFETY_DISTANCE_M, f"{separation_m} m apart")
        for mate in self.mates:
            frames = self.frames_of(mate)
            self.assertGreater(len(frames), LEAST_FRAMES)
            self.assertIn(f" vcan{mate.number} ", frames[0])

    def test_comes_to_rest_when_interrupted_and_nothing_is_lost(self) -> None:
        team = self.start_team()
        until = time.monotonic() + PATIENCE_S
        while not all(mate.time_s() > 3.0 for mate in self.mates):
            self.assertLess(time.monotonic(), until)
            time.sleep(0.2)

        team.process.send_signal(signal.SIGINT)
        status = team.wait(STOP_PATIENCE_S)

        self.assertEqual(status, 1)
        for mate in self.mates:
            self.assertFalse(self.result_of(mate)["completed"])
            self.assertTrue((mate.folder / "map.ot").exists())
            tick = last_tick(mate.folder)
            assert tick is not None
            self.assertLess(float(tick["speed_mps"]), 0.1)
