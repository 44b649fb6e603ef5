#!/usr/bin/python3
# Copyright 2026 the Understory authors
# SPDX-License-Identifier: BSD-3-Clause
"""`understory latency`: its figure, and the command as a user meets it."""

import contextlib
import io
import json
import pathlib
import subprocess
import sys
import unittest
import unittest.mock
import warnings

import numpy as np

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "support"))
from latency_traces import HEADER, LATENCY, ROOT, TraceFolder, frame, wakeups  # noqa: E402
import latency  # noqa: E402
from latency_figure import groups_of, spans_of  # noqa: E402
from latency_rows import KNOWN_ROWS  # noqa: E402


class Figure(TraceFolder):
    """The picture, also of traces that have little in them."""

    def png(self, rows, budget=None):
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            return latency.figure_png(self.trace(rows), budget or {})

    def test_whole_sparse_and_odd_traces_are_drawn_alike_each_time(self):
        whole = "".join(frame(33 * index, bus_tx=(26, 27)) for index in range(40))
        for rows in (
            whole + wakeups([0.1, 0, 30]),
            frame(0, ["camera"], cloud=(9, 12), map=(11, 11)),
            wakeups([1]),
        ):
            with self.subTest(rows=rows[:40]):
                png = self.png(rows, {"wakeup": {"p99_ms": 0}})

                self.assertEqual(png[:8], b"\x89PNG\r\n\x1a\n")
                self.assertGreater(len(png), 5000)
        self.assertEqual(self.png(wakeups([1]), {"wakeup": {"p99_ms": 0}}), png)

    def test_every_row_has_its_place_in_one_group(self):
        names = [*KNOWN_ROWS, "bus_tx"]

        groups = groups_of(names)

        self.assertEqual(sorted(sum(groups, [])), sorted(names))
        self.assertEqual(groups[0][:3], ["camera", "cloud_wait", "cloud"])
        self.assertEqual(groups_of(["wakeup", "map"]), [["map"], ["wakeup"]])

    def test_spans_have_their_own_percentiles_and_a_short_last_one_is_no_span(self):
        time_s = [0.1 * index for index in range(0, 102)]  # 2 samples after 10 s
        values = [1.0 if at < 5 else 3.0 for at in time_s]
        values[7] = 9.0

        middles_s, p50, p99, above = spans_of(np.array(time_s), np.array(values), 5.0)

        self.assertEqual((p50.tolist(), p99.tolist()), ([1.0, 3.0], [9.0, 3.0]))
        self.assertEqual(len(middles_s), 2)
        self.assertFalse(above.any())


class Command(TraceFolder):
    """The command as a user meets it."""

    def run_latency(self, *words):
        return subprocess.run(
            ["/usr/bin/python3", "-B", str(LATENCY), *map(str, words)],
            cwd=self.folder,
            stdin=subprocess.DEVNULL,
            capture_output=True,
            encoding="utf-8",
            timeout=60,
            check=False,
        )

    def run_here(self, *words):
        """In this process and without the figure: exit status, output and errors."""
        with contextlib.redirect_stdout(io.StringIO()) as output:
            with contextlib.redirect_stderr(io.StringIO()) as errors:
                with unittest.mock.patch.object(latency, "figure_png", return_value=b""):
                    status = latency.main([str(word) for word in words])
        return status, output.getvalue(), errors.getvalue()

    def assert_refused(self, outcome, words):
        self.assertEqual((outcome.returncode, outcome.stdout), (2, ""))
        self.assertEqual(len(outcome.stderr.splitlines()), 1, outcome.stderr)
        self.assertTrue(outcome.stderr.startswith("understory latency: "), outcome.stderr)
        self.assertIn(words, outcome.stderr)
        self.assertEqual([path.name for path in self.folder.glob("latency*")], [])

    def test_prints_the_table_and_writes_three_files_beside_the_trace(self):
        self.trace(frame(0) + frame(33) + frame(66, ["camera"]))

        outcome = self.run_latency(self.folder)

        self.assertEqual((outcome.returncode, outcome.stderr), (0, ""))
        self.assertRegex(outcome.stdout, r"(?m)^map +2 +6\.500 +6\.500 +6\.500 +6\.500$")
        self.assertRegex(outcome.stdout, r"(?m)^wakeup +0 +- +- +- +-$")
        self.assertIn("image: 3, of these without a map (dropped): 1\n", outcome.stdout)
        written = {path.name: path.read_bytes() for path in self.folder.iterdir()}
        self.assertEqual(set(written), {"trace.csv", "latency.csv", "latency.png", "trace.json"})
        self.assertEqual(written["latency.png"][:8], b"\x89PNG\r\n\x1a\n")
        self.assertIn(b"\ncloud_wait,2,1.000000,", written["latency.csv"])
        self.assertEqual(len(json.loads(written["trace.json"])["traceEvents"]), 1 + 2 * 8 + 17)

    def test_out_is_made_and_the_result_left_alone(self):
        self.trace(frame(0))

        status, output, _ = self.run_here(self.folder, "--out", self.folder / "a" / "b")

        self.assertEqual(status, 0)
        self.assertIn(str(self.folder / "a" / "b" / "trace.json"), output)
        self.assertEqual(sorted(path.name for path in self.folder.iterdir()), ["a", "trace.csv"])

    def test_a_kept_budget_is_0_and_an_exceeded_one_1(self):
        self.trace(wakeups([1, 2, 3]))
        for budget, status, said in (
            ("wakeup: {max_ms: 3}", 0, "within the budget of "),
            ("wakeup: {max_ms: 2.5}", 1, "over budget: wakeup: max_ms is 3.000, allowed 2.5\n"),
            ("map: {max_ms: 3}", 1, "over budget: map: no samples\n"),
        ):
            with self.subTest(budget=budget):
                path = self.write("budget.yaml", budget)

                found, output, errors = self.run_here(self.folder, "--budget", path)

                self.assertEqual((found, errors), (status, ""))
                self.assertIn(said, output)
        self.assertEqual(self.run_latency(self.folder, "--budget", "budget.yaml").returncode, 1)

    def test_a_stage_that_the_trace_has_may_have_a_limit(self):
        self.trace(frame(0, bus_tx=(33, 34)))
        path = self.write("budget.yaml", "bus_tx: {max_ms: 1}")

        self.assertEqual(self.run_here(self.folder, "--budget", path)[0], 0)

    def test_a_last_line_cut_off_is_a_note_only(self):
        self.trace(frame(0) + "map,7")

        status, output, errors = self.run_here(self.folder)

        self.assertEqual(status, 0)
        self.assertEqual(len(errors.splitlines()), 1)
        self.assertRegex(errors, r"^understory latency: note: .*trace\.csv: the last line was cut")
        self.assertIn("\nmap ", output)

    def test_what_cannot_be_read_is_2_in_one_line(self):
        self.assert_refused(self.run_latency("nowhere"), "nowhere: not a folder")
        self.assert_refused(self.run_latency("."), "trace.csv: No such file or directory")
        self.trace(frame(0))
        self.write("trace.csv", HEADER + "map,1\n")
        self.assert_refused(self.run_latency("."), "trace.csv:2: expected a row")

    def test_bad_budgets_are_2_in_one_line_and_nothing_is_written(self):
        self.trace(frame(0))
        self.write("b.yaml", "map: {p98_ms: 1}")

        for name, said in (("b.yaml", "map.p98_ms: unknown key"), ("gone.yaml", "No such file")):
            self.assert_refused(self.run_latency(".", "--budget", name), f"{name}: {said}")

    def test_wrong_use_is_2_in_one_line(self):
        self.assert_refused(self.run_latency(), "RESULT")
        self.assert_refused(self.run_latency(".", "--nonsense"), "--nonsense")

    def test_a_place_that_cannot_be_written_is_named(self):
        self.trace(frame(0))
        self.write("occupied", "")

        outcome = self.run_latency(".", "--out", "occupied")

        self.assert_refused(outcome, "occupied/latency.csv: cannot write")

    def test_help_of_the_command_of_the_project(self):
        outcome = subprocess.run(
            [str(ROOT / "understory"), "latency", "--help"],
            cwd="/",
            stdin=subprocess.DEVNULL,
            capture_output=True,
            encoding="utf-8",
            timeout=60,
            check=False,
        )

        self.assertEqual((outcome.returncode, outcome.stderr), (0, ""))
        self.assertTrue(outcome.stdout.startswith("usage: understory latency ["), outcome.stdout)
        for word in ("RESULT", "--budget", "--out", "p99_ms", "config/latency_budget.yaml"):
            self.assertIn(word, outcome.stdout)


if __name__ == "__main__":
    unittest.main()
