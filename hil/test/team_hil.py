# Copyright 2026 the Understory authors
# SPDX-License-Identifier: BSD-3-Clause
"""Two vehicles of a team, each with an onboard process, a ROS master and a bus of its own: one is
lost on the way, or the user has seen enough."""

import json
import signal
import sys
import time
from typing import List

from bench import ROOT
from mission_bench import STOP_PATIENCE_S, MissionTest

sys.path.append(str(ROOT / "src" / "understory_nodelets" / "onboard"))
import fly  # noqa: E402  pylint: disable=wrong-import-position
from fly_team import (  # noqa: E402  pylint: disable=wrong-import-position
    Mate,
    last_tick,
    least_separation_m,
)

HIL_OPTIONS = ["--interfaces", "2"]
# As fly.py does it where a kernel is booted.
TEAM = ["--team", "2", "--bus-rate", fly.KERNEL_BUS_HZ, "--camera-rate", fly.KERNEL_CAMERA_HZ]
TEAM += ["--overrides", fly.KERNEL_LEAD]
PATIENCE_S = 110.0
SAFETY_DISTANCE_M = 0.8
LEAST_FRAMES = 1000


class ATeam(MissionTest):
    def setUp(self) -> None:
        super().setUp()
        self.mates = [Mate(number, self.out / f"vehicle_{number}") for number in (0, 1)]

    def result_of(self, mate: Mate) -> dict:
        result = json.loads((mate.folder / "result.json").read_text(encoding="utf-8"))
        print(f"    {({key: result[key] for key in list(result)[:8]})}")
        self.assert_never(result["collisions"], "a collision")
        return result

    def frames_of(self, mate: Mate) -> List[str]:
        return (mate.folder / "bus.log").read_text(encoding="ascii").splitlines()

    def test_completes_the_map_when_one_is_lost_on_the_way(self) -> None:
        team = self.start_mission(*TEAM, "--kill", "0@8")

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
        team = self.start_mission(*TEAM)
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
