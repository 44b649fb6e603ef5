#!/usr/bin/python3
# Copyright 2026 the Understory authors
# SPDX-License-Identifier: BSD-3-Clause
"""What `understory fly --team` makes of its options and of the flights' ticks."""

import argparse
import contextlib
import io
import pathlib
import subprocess
import sys
import tempfile
import unittest
import unittest.mock

import yaml

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "src" / "understory_nodelets" / "onboard"))
import fly  # noqa: E402
from fly_team import least_separation_m, overrides_of, parse_kill  # noqa: E402


class FlyTeam(unittest.TestCase):
    def test_separation_is_taken_between_the_ticks_of_both(self):
        crossing = [(10.0, -1.0, 0.0, 1.0), (12.0, 1.0, 0.0, 1.0)]
        waiting = [(9.0, 0.0, 0.5, 1.0), (11.0, 0.0, 0.5, 1.0), (20.0, 0.0, 0.5, 1.0)]

        self.assertAlmostEqual(least_separation_m([crossing, waiting]), 0.5)

    def test_who_is_silent_stays_where_it_was(self):
        lost = [(0.0, 5.0, 0.0, 1.0), (1.0, 3.0, 0.0, 1.0)]
        passing = [(0.0, 0.0, 9.0, 1.0), (50.0, 3.0, 0.7, 1.0)]

        self.assertAlmostEqual(least_separation_m([lost, passing]), 0.7)

    def test_who_is_lost_counts_until_its_last_word(self):
        lost = [(0.0, 5.0, 0.0, 1.0), (1.0, 3.0, 0.0, 1.0)]
        passing = [(0.0, 3.0, 9.0, 1.0), (1.0, 3.0, 4.0, 1.0), (9.0, 3.0, 0.1, 1.0)]

        self.assertAlmostEqual(least_separation_m([lost, passing], (True, False)), 4.0)

    def test_one_alone_has_no_separation(self):
        self.assertIsNone(least_separation_m([[(0.0, 0.0, 0.0, 1.0)]]))

    def test_overrides_of_the_team_are_kept(self):
        arguments = argparse.Namespace(
            team=3, overrides="team: {separation: {silent_max_m: 0.3}}\nlimits: {speed_cap: strict}"
        )

        told = yaml.safe_load(overrides_of(arguments, 2))

        separation = {"silent_max_m": 0.3}
        self.assertEqual(told["team"], {"size": 3, "id": 2, "separation": separation})
        self.assertEqual(told["limits"], {"speed_cap": "strict"})

    def test_kills_name_a_vehicle_of_the_team(self):
        self.assertEqual(parse_kill("1@8.5", 2), (1, 8.5))
        for wrong in ("2@8", "1", "@8", "1@-3", "one@8"):
            with self.assertRaisesRegex(ValueError, "--kill"):
                parse_kill(wrong, 2)

    def test_a_rate_of_the_bus_is_told_to_both_ends(self):
        arguments = fly.parse_arguments(["--bus", "vcan0", "--bus-rate", "50", "--no-bus-log"])

        told = yaml.safe_load(fly.bus_override(arguments, pathlib.Path("/there")))

        self.assertEqual(told, {"bus": {"interface": "vcan0"}, "flight": {"rate_hz": 50.0}})
        with unittest.mock.patch.object(fly.subprocess, "Popen") as vehicle:
            with tempfile.TemporaryDirectory() as folder:
                vehicle.return_value.wait.side_effect = subprocess.TimeoutExpired("vehicle", 1.0)
                fly.start_vehicle(arguments, pathlib.Path(folder))
        [command] = vehicle.call_args[0]
        self.assertEqual(command[command.index("--rate") + 1], "50.0")

    def test_the_camera_has_its_size_and_rate_together(self):
        arguments = fly.parse_arguments(["--camera-size", "80x60", "--camera-rate", "8"])

        told = yaml.safe_load(fly.camera_override(arguments))

        self.assertEqual(told, {"camera": {"width_px": 80, "height_px": 60, "rate_hz": 8.0}})


class ATeamInABootedKernel(unittest.TestCase):
    def words(self, provider, *words):
        """What is added, and which bus is taken."""
        arguments = fly.parse_arguments(list(words))
        with unittest.mock.patch.object(fly, "quickest_provider", lambda: provider):
            with contextlib.redirect_stderr(io.StringIO()) as self.said:
                return fly.words_for_kernel(arguments), arguments.bus

    def test_two_share_it_at_lower_rates_which_is_said(self):
        added = ["--bus-rate", "40", "--camera-rate", "5", "--overrides", fly.KERNEL_LEAD]

        self.assertEqual(self.words("uml", "--team", "2"), (added, None))
        self.assertIn(" ".join(added), self.said.getvalue())

    def test_what_the_user_wants_is_kept(self):
        replan = ["--overrides", "replan: {lead_s: 0.2}"]
        added, _ = self.words("uml", "--team", "2", "--bus-rate", "100", *replan)
        self.assertEqual(added, ["--camera-rate", "5"])
        added, _ = self.words("uml", "--team", "2", "--overrides", "camera: {width_px: 80}")
        self.assertEqual(added[:3], ["--bus-rate", "40", "--overrides"])
        self.assertEqual(yaml.safe_load(added[3])["camera"], {"width_px": 80})
        self.assertEqual(yaml.safe_load(added[3])["replan"], {"lead_s": 0.5})

    def test_three_are_too_many_for_it_which_is_said(self):
        self.assertEqual(self.words("uml", "--team", "3"), ([], "memory"))
        self.assertIn("no time for 3", self.said.getvalue())

    def test_where_none_is_booted_nothing_changes(self):
        for provider, words in (("native", ["--team", "3"]), ("uml", []), ("", ["--team", "2"])):
            self.assertEqual(self.words(provider, *words), ([], None))
            self.assertEqual(self.said.getvalue(), "")


if __name__ == "__main__":
    unittest.main()
