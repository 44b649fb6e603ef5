#!/usr/bin/python3
# Copyright 2026 the Understory authors
# SPDX-License-Identifier: BSD-3-Clause
"""`understory log --latency`: against delays that were put into made-up flights."""

import dataclasses
import pathlib
import random
import sys
import unittest

import numpy as np

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "support"))
from can_flight import PONG_DELAY_US, flight, without  # noqa: E402
from can_logs import FlightTest, drop, number_of  # noqa: E402
from log_latency import samples_of, statistics_of, table_csv, unanswered  # noqa: E402


class Latency(FlightTest):
    def test_injected_latencies_are_found(self):
        frames = flight()
        rng = random.Random(8)
        delays_us = []
        commits = {
            frame.raws["SpSeq"] + 256 * (frame.time_us > 2_560_000): frame
            for frame in frames
            if frame.name == "SP_COMMIT"
        }
        for frame in frames:
            if frame.name == "SP_ACK":
                number = frame.raws["AckSeq"] + 256 * (frame.time_us > 2_560_000)
                delays_us.append(rng.randrange(150, 4000))
                frame.time_us = commits[number].time_us + delays_us[-1]
                frame.raws["AckDelay"] = delays_us[-1] + 7
        frames.sort(key=lambda frame: frame.time_us)

        rows = samples_of(self.log(frames))

        found_us = np.round(1000 * rows["commit_to_ack"].value_ms).astype(int)
        self.assertEqual(sorted(found_us.tolist()), sorted(delays_us))
        row = statistics_of(rows)["commit_to_ack"]
        ascending = sorted(delays_us)
        expected = [ascending[at] / 1000 for at in (2, 149, 269, 296, 299)]
        measured = (row.p1_ms, row.p50_ms, row.p90_ms, row.p99_ms, row.max_ms)
        for value, each in zip(measured, expected):
            self.assertAlmostEqual(value, each, delta=0.0005)
        self.assertEqual(statistics_of(rows)["ack_delay"].count, 200)  # of those that were flown

    def test_an_answer_that_is_missing_or_late_belongs_to_no_other_question(self):
        frames = drop(flight(6.0), "SP_ACK", [10, 11])
        late = frames[number_of(frames, "SP_ACK")[60]]
        late.time_us += 600_000
        frames.sort(key=lambda frame: frame.time_us)

        log = self.log(frames)

        self.assertEqual(statistics_of(samples_of(log))["commit_to_ack"].count, 597)
        self.assertEqual(unanswered(log), 3)
        self.assertLess(statistics_of(samples_of(log))["commit_to_ack"].max_ms, 1)

    def test_only_the_first_of_two_answers_counts(self):
        frames = flight()
        for frame in frames:
            if frame.name == "SP_ACK":
                frame.counter = 2 * frame.counter % 16
        for at in reversed(number_of(frames, "SP_ACK")):
            first = frames[at]
            again = dataclasses.replace(
                first, time_us=first.time_us + 1000, counter=first.counter + 1
            )
            frames.insert(at + 1, again)

        row = statistics_of(samples_of(self.log(frames)))["commit_to_ack"]

        self.assertEqual(row.count, 300)
        self.assertLess(row.max_ms, 1)

    def test_setpoints_that_a_log_ends_with_are_not_unanswered(self):
        self.assertEqual(unanswered(self.log(drop(flight(), "SP_ACK", range(260, 300)))), 0)

    def test_setpoints_before_the_vehicle_is_there_are_not_unanswered(self):
        self.assertEqual(unanswered(self.log(drop(flight(), "SP_ACK", range(100)))), 0)

    def test_the_period_of_setpoints_shows_a_stall(self):
        frames = flight()
        for frame in frames:
            if frame.time_us >= 1_000_000:
                frame.time_us += 35_000

        row = statistics_of(samples_of(self.log(frames)))["setpoint_period"]

        self.assertAlmostEqual(row.max_ms, 45, delta=0.2)
        self.assertAlmostEqual(row.p50_ms, 10, delta=0.05)
        self.assertEqual(row.count, 299)

    def test_the_vehicles_clock_is_followed_over_its_wrap(self):
        rows = statistics_of(samples_of(self.log(flight(25.0))))  # it wraps twice

        self.assertEqual(rows["pong_delay"].max_ms, PONG_DELAY_US / 1000)
        self.assertAlmostEqual(rows["ping_to_pong"].p50_ms, 0.34, delta=0.02)
        self.assertAlmostEqual(rows["setpoint_age"].p1_ms, 0.53, delta=0.02)
        self.assertAlmostEqual(rows["setpoint_age"].max_ms, 0.53, delta=0.02)
        self.assertAlmostEqual(rows["odometry_age"].p50_ms, 0.33, delta=0.02)

    def test_a_slow_ping_spoils_no_age(self):
        frames = flight()
        for at in number_of(frames, "PONG")[::3]:
            frames[at].time_us += 3000
            frames[at].raws["PongT2"] = (frames[at].raws["PongT2"] + 2900) % (1 << 24)
        frames.sort(key=lambda frame: frame.time_us)

        rows = statistics_of(samples_of(self.log(frames)))

        self.assertAlmostEqual(rows["setpoint_age"].max_ms, 0.53, delta=0.02)
        self.assertGreater(rows["ping_to_pong"].max_ms, 3)

    def test_a_log_without_pings_or_setpoints_has_rows_without_samples(self):
        log = self.log(without(flight(), lambda f: f.name in ("PING", "SP_COMMIT", "SP_ACK")))

        rows = statistics_of(samples_of(log))

        empty = [name for name, row in rows.items() if not row.count]
        expected = ["commit_to_ack", "ack_delay", "setpoint_period", "ping_to_pong"]
        self.assertEqual(empty, expected + ["setpoint_age", "odometry_age"])
        self.assertIn("commit_to_ack,0,,,,,\n", table_csv(rows))


if __name__ == "__main__":
    unittest.main()
