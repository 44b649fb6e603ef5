#!/usr/bin/python3
# Copyright 2026 the Understory authors
# SPDX-License-Identifier: BSD-3-Clause
"""One scenario in lockstep and onboard: both complete, in times that agree within 15 %.

The two cannot agree exactly: onboard, exposures fall on the 100 Hz grid of the odometry, decisions
take time, and threads run in another order each time, so targets differ after a few seconds. One
flight scatters by several percent, in lockstep too, between settings that hardly differ: there the
mean of several is taken, which begin with another heading; onboard, where the mean so far is
outside, another flight joins it. A machine that stands still for long ends a flight safely before its time, or makes it longer;
such a one does not count.
"""

import json
import os
import shutil
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path
from statistics import mean

import rospy
import rostest

ROOT = Path(__file__).resolve().parents[2]
sys.path.append(str(ROOT / "test" / "support"))
from machine import Never, attempted  # noqa: E402  pylint: disable=wrong-import-position

SCENARIO = "small"
TOLERANCE = 0.15
FLIGHT_PATIENCE_S = 150
HEADINGS_RAD = [0.01 * step for step in range(8)]
MOST_ONBOARD = 3


def program(package, name):
    found = subprocess.run(
        ["catkin_find", "--first-only", package, name],
        check=True,
        stdout=subprocess.PIPE,
        encoding="utf-8",
    )
    return found.stdout.strip()


def result_of(command, folder):
    outcome = subprocess.run(
        command,
        check=False,
        env={**os.environ, "UNDERSTORY_ROOT": str(ROOT)},
        timeout=FLIGHT_PATIENCE_S,
    )
    result = json.loads((folder / "result.json").read_text(encoding="utf-8"))
    return outcome.returncode, result


def is_near(time_s, lockstep_s):
    return abs(time_s / lockstep_s - 1.0) <= TOLERANCE


class Sameness(unittest.TestCase):
    def setUp(self):
        self.folder = Path(tempfile.mkdtemp(prefix="understory_sameness_"))
        self.addCleanup(shutil.rmtree, self.folder, True)

    def completed(self, command, folder):
        status, result = result_of(command, folder)
        if result["collisions"]:
            raise Never("a collision")
        self.assertEqual(status, 0, result["stop_reason"])
        self.assertTrue(result["completed"])
        self.assertGreaterEqual(result["coverage"], 0.99)
        return result["completion_time_s"]

    def in_lockstep(self, heading_rad):
        folder = self.folder / "lockstep"
        command = [program("understory_sim", "understory_simulate"), "--scenario", SCENARIO]
        command += ["--set", f"scene: {{start: {{yaw_rad: {heading_rad}}}}}"]
        return self.completed(
            command + ["--quiet", "--no-report", "--out", str(folder)], folder
        )

    def onboard(self, lockstep_s):
        folder = self.folder / "onboard"
        command = [program("understory_nodelets", "onboard"), "--scenario", SCENARIO]
        command += ["--result-folder", str(folder)]

        def fly(machine):
            shutil.rmtree(folder, True)
            folder.mkdir()
            time_s = self.completed(command, folder)
            if not is_near(time_s, lockstep_s) and machine.is_hopeless():
                self.fail(f"it took {time_s:.1f} s")
            return time_s

        return attempted(fly, (AssertionError, OSError, ValueError, subprocess.TimeoutExpired))

    def test_completion_times_agree(self):
        lockstep_s = mean(self.in_lockstep(heading_rad) for heading_rad in HEADINGS_RAD)
        times_s = [self.onboard(lockstep_s)]
        while not is_near(mean(times_s), lockstep_s) and len(times_s) < MOST_ONBOARD:
            times_s.append(self.onboard(lockstep_s))

        mean_s = mean(times_s)

        print(f"lockstep {lockstep_s:.1f} s, onboard {times_s} s, ratio {mean_s / lockstep_s:.3f}")
        self.assertTrue(is_near(mean_s, lockstep_s))


if __name__ == "__main__":
    rospy.init_node("see_sameness", disable_signals=True)
    rostest.rosrun("understory_ros_test", "sameness", Sameness)
