#!/usr/bin/python3
# Copyright 2026 the Understory authors
# SPDX-License-Identifier: BSD-3-Clause
"""What `understory fly --team` makes of its options and of the flights' ticks."""

import argparse
import pathlib
import sys
import unittest

import yaml

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "src" / "understory_nodelets" / "onboard"))
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


if __name__ == "__main__":
    unittest.main()
