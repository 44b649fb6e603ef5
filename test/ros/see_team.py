#!/usr/bin/python3
# Copyright 2026 the Understory authors
# SPDX-License-Identifier: BSD-3-Clause
"""Two onboard processes, each with a ROS master of its own, fly as a team over DDS: they share the
work, know the same in the end, keep clear of each other; and one goes on alone when the other is
lost in mid-flight."""

import json
import os
import shutil
import signal
import subprocess
import sys
import tempfile
from pathlib import Path

import roslib.packages
import rospy
import rostest

from watching import FlightTest

FLY = Path(__file__).resolve().parents[2] / "src/understory_nodelets/onboard/fly.py"
sys.path.append(str(FLY.parent))
from fly_team import Mate, least_separation_m  # noqa: E402  pylint: disable=wrong-import-position

PATIENCE_S = 110
SAFETY_DISTANCE_M = 0.8
LOST_AT_S = 6.0
SMALL_CAMERA = "160x120"  # two vehicles on one machine


class SeeTeam(FlightTest):
    def fly(self, *options):
        """Its exit status, and both vehicles."""
        folder = Path(tempfile.mkdtemp(prefix="understory_team_"))
        self.addCleanup(shutil.rmtree, folder, ignore_errors=True)
        onboard = roslib.packages.find_node("understory_nodelets", "onboard")[0]
        with open(folder / "said", "w", encoding="utf-8") as said:
            process = subprocess.Popen(
                [sys.executable, "-B", str(FLY), "--onboard", onboard, "--scenario", "clearing"]
                + ["--team", "2", "--bus", "memory", "--camera-size", SMALL_CAMERA, "--no-report"]
                + ["--quiet", "--out", str(folder), *options],
                stdout=said,
                stderr=said,
                start_new_session=True,
            )
        try:
            status = process.wait(PATIENCE_S)
        finally:
            if process.poll() is None:
                os.killpg(process.pid, signal.SIGTERM)  # it tidies up behind itself
                process.wait()
            print((folder / "said").read_text(encoding="utf-8"), flush=True)
        return status, [Mate(number, folder / f"vehicle_{number}") for number in (0, 1)]

    @staticmethod
    def result_of(mate):
        return json.loads((mate.folder / "result.json").read_text(encoding="utf-8"))

    def assert_apart(self, mates, lost=()):
        tracks = [mate.track() for mate in mates]
        self.assertTrue(all(tracks))
        self.assertGreater(least_separation_m(tracks, lost), SAFETY_DISTANCE_M)

    def test_two_explore_together_and_know_the_same(self):
        status, mates = self.fly()

        self.assertEqual(status, 0)
        results = [self.result_of(mate) for mate in mates]
        for result in results:
            self.assert_never(result["collisions"], "a collision")
            self.assertTrue(result["completed"], result)
        volumes_m3 = [result["explored_volume_m3"] for result in results]
        self.assertLess(abs(volumes_m3[0] - volumes_m3[1]), 0.01 * max(volumes_m3))
        self.assert_apart(mates)

    def test_one_goes_on_when_the_other_is_lost(self):
        status, mates = self.fly("--kill", f"0@{LOST_AT_S}")

        self.assertEqual(status, 0)
        self.assertFalse((mates[0].folder / "result.json").exists())
        self.assertGreater(mates[0].time_s(), LOST_AT_S - 0.1)
        result = self.result_of(mates[1])
        self.assert_never(result["collisions"], "a collision")
        self.assertTrue(result["completed"], result)
        self.assertGreater(result["coverage"], 0.95)
        self.assert_apart(mates, lost=(True, False))


if __name__ == "__main__":
    rospy.init_node("see_team")
    rostest.rosrun("understory_ros_test", "team", SeeTeam)
