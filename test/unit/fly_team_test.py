#!/usr/bin/python3
# Copyright 2026 the Understory authors
# SPDX-License-Identifier: BSD-3-Clause
"""What `understory fly --team` makes of its options and of the flights' ticks."""

import argparse
import contextlib
import io
import os
import pathlib
import socket
import sys
import unittest
import unittest.mock

import yaml

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "src" / "understory_nodelets" / "onboard"))
import fly  # noqa: E402
from fly_team import least_separation_m, overrides_of, parse_kill  # noqa: E402
from team_network import Ethernet  # noqa: E402


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

    def test_a_vehicle_in_its_own_kernel_is_told_all_that_the_team_was(self):
        words = ["--team", "2", "--kill", "0@3", "--seed", "7", "--fault", "1:freeze", "--quiet"]
        words += ["--fault", "2:resume", "--crop", "0,0,9,9"]

        command = fly.booted_command(fly.parse_arguments(words), "/there", "5:10.0.0.1/24")

        ours = command[: command.index("--")]
        self.assertEqual(ours[-2:], ["--network", "5:10.0.0.1/24"])
        told = fly.parse_arguments(command[command.index("--") + 3 :])
        self.assertEqual((told.team, told.kill, told.out, told.bus), (1, [], "/there", "vcan0"))
        self.assertEqual((told.seed, told.fault, told.crop), (7, ["1:freeze", "2:resume"], "0,0,9,9"))
        self.assertTrue(told.quiet and told.no_report)
        self.assertFalse(told.no_vehicle)


class BootsKernels(unittest.TestCase):
    def boots(self, provider, processors, *words):
        """Whether kernels are booted, and which bus is taken then."""
        arguments = fly.parse_arguments(list(words))
        with unittest.mock.patch.object(fly, "quickest_provider", lambda: provider):
            with unittest.mock.patch.object(os, "cpu_count", lambda: processors):
                with contextlib.redirect_stderr(io.StringIO()) as self.said:
                    return fly.boots_kernels(arguments), arguments.bus

    def test_for_a_team_on_a_machine_that_has_no_can(self):
        self.assertEqual(self.boots("uml", 4, "--team", "2"), (True, None))
        self.assertEqual(self.boots("native", 4, "--team", "2"), (False, None))
        self.assertEqual(self.boots("uml", 4), (False, None))
        self.assertEqual(self.boots("uml", 4, "--team", "2", "--bus", "memory"), (False, "memory"))
        self.assertEqual(self.said.getvalue(), "")

    def test_unless_it_is_too_small_which_is_said(self):
        self.assertEqual(self.boots("uml", 2, "--team", "2"), (False, "memory"))
        self.assertIn("2 processors are too few", self.said.getvalue())


class EthernetTest(unittest.TestCase):
    def setUp(self):
        self.ethernet = Ethernet(3)
        self.addCleanup(self.ethernet.close)
        self.cards = [socket.socket(fileno=os.dup(self.ethernet.file_of(i))) for i in range(3)]
        for card in self.cards:
            card.settimeout(10.0)
            self.addCleanup(card.close)
        self.ethernet.start()

    def test_a_frame_reaches_all_others_whole(self):
        for frame in (b"first", bytes(1514)):
            self.cards[1].send(frame)

            self.assertEqual(self.cards[0].recv(65536), frame)
            self.assertEqual(self.cards[2].recv(65536), frame)
        self.cards[1].setblocking(False)
        with self.assertRaises(BlockingIOError):
            self.cards[1].recv(65536)

    def test_one_that_is_gone_or_takes_nothing_holds_up_nobody(self):
        self.cards[0].close()
        for _ in range(2000):  # more than a socket holds
            self.cards[1].send(b"frame")
            self.assertEqual(self.cards[2].recv(65536), b"frame")

    def test_addresses_differ(self):
        self.assertEqual(len({Ethernet.address_of(number) for number in range(10)}), 10)


if __name__ == "__main__":
    unittest.main()
