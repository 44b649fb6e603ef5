#!/usr/bin/python3
# Copyright 2026 the Understory authors
# SPDX-License-Identifier: BSD-3-Clause
"""Tables of missions: what is flown, what is kept, what is said of it, and bad table files."""

import contextlib
import io
import json
import os
import pathlib
import subprocess
import sys
import tempfile
import unittest

import numpy as np
import yaml

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "src" / "understory_sim" / "bench"))
import bench_figures  # noqa: E402
import series  # noqa: E402
import spread  # noqa: E402
from rows import COLUMNS, append_row, comparison, cost_of_variants  # noqa: E402
from rows import is_good, markdown, read_rows, row_of  # noqa: E402
from table_file import Mission, TableError, quick, read_table  # noqa: E402


class TemporaryFolder(unittest.TestCase):
    """A folder that is gone afterwards."""

    def setUp(self):
        keeper = tempfile.TemporaryDirectory()
        self.addCleanup(keeper.cleanup)
        self.folder = pathlib.Path(keeper.name)

    def write(self, name, text):
        path = self.folder / name
        path.write_text(text, encoding="utf-8")
        return path


class TableFiles(TemporaryFolder):
    """Which missions a file names."""

    def test_every_scenario_seed_and_cap(self):
        path = self.write("t.yaml", "scenarios: [a, b]\nseeds: 3\nspeed_caps: [paper, strict]\n")
        missions = read_table(path, self.folder)
        self.assertEqual(len(missions), 12)
        self.assertEqual(missions[0], Mission("a", "", 1, "paper"))
        self.assertEqual(missions[-1], Mission("b", "", 3, "strict"))
        self.assertEqual(len({mission.name for mission in missions}), 12)

    def test_forests_are_found_relative_to_the_project(self):
        (self.folder / "project").mkdir()
        for name in ("f_s2.csv", "f_s1.csv"):
            self.write(name, "")
        path = self.write("t.yaml", "scenario: a\nforests: ../*.csv\nspeed_caps: [paper]\n")
        missions = read_table(path, self.folder / "project")
        self.assertEqual([mission.scene for mission in missions], ["f_s1", "f_s2"])

    def test_our_tables_name_scenarios_that_exist(self):
        tables = sorted((ROOT / "config" / "tables").glob("*.yaml"))
        self.assertGreaterEqual(len(tables), 3)
        known = {path.stem for path in (ROOT / "config" / "scenarios").glob("*.yaml")}
        for path in tables:
            try:
                missions = read_table(path, ROOT)
            except TableError as error:  # the forests need not be beside the project
                self.assertIn("no file matches", str(error))
                continue
            self.assertLessEqual({mission.scenario for mission in missions}, known)

    def test_groups_have_their_own_seeds_strategies_and_titles(self):
        path = self.write(
            "t.yaml",
            "groups:\n- {scenarios: [a, b], seeds: 2, strategies: [x, y], speed_caps: [paper]}\n"
            "- {scenario: c, title: three}\n",
        )
        missions = read_table(path, self.folder)
        self.assertEqual(len(missions), 8 + 2)
        self.assertEqual(missions[0], Mission("a", "", 1, "paper", "x"))
        self.assertEqual(missions[-1].title, "three")
        self.assertEqual(missions[0].title, "a")
        names = [f"{mission.scenario}{mission.strategy[0]}" for mission in quick(missions)]
        self.assertEqual(names, ["ax", "ay", "ce"])

    def test_variants_have_settings_and_a_line_each(self):
        path = self.write(
            "t.yaml",
            "scenario: a\nspeed_caps: [paper]\nvariants:\n  as it is: {}\n"
            "  slow camera: {camera: {rate_hz: 5}}\n",
        )
        missions = read_table(path, self.folder)
        self.assertEqual([mission.title for mission in missions], ["as it is", "slow camera"])
        self.assertEqual(missions[0].settings, "")
        self.assertEqual(yaml.safe_load(missions[1].settings), {"camera": {"rate_hz": 5}})
        self.assertNotIn(" ", missions[1].name)
        self.assertEqual(len({mission.name for mission in missions}), 2)

    def test_bad_files_are_refused_with_file_and_key(self):
        for content, key in (
            ("scenario: a\nsede: 3\n", "sede"),
            ("scenario: a\nseeds: 0\n", "seeds"),
            ("scenario: a\nseeds: many\n", "seeds"),
            ("scenario: a\nspeed_caps: [fast]\n", "speed_caps"),
            ("scenario: a\nforests: nowhere/*.csv\n", "forests"),
            ("seeds: 2\n", "scenario"),
            ("scenarios: [1]\n", "scenario"),
            ("scenario: a\nstrategies: x\n", "strategies"),
            ("scenario: a\nvariants: [x]\n", "variants"),
            ("scenario: a\nvariants: {x: 3}\n", "variants"),
            ("groups: 3\n", "groups"),
            ("groups: [{scenario: a, sede: 3}]\n", "sede"),
            ("- a\n", "expected keys"),
            ("a: [\n", "not YAML"),
        ):
            path = self.write("bad.yaml", content)
            with self.assertRaises(TableError, msg=content) as caught:
                read_table(path, self.folder)
            self.assertIn("bad.yaml", str(caught.exception))
            self.assertIn(key, str(caught.exception))
            self.assertNotIn("\n", str(caught.exception))

    def test_missing_file_is_named(self):
        with self.assertRaisesRegex(TableError, "gone.yaml"):
            read_table(self.folder / "gone.yaml", self.folder)


RESULT = {
    "completed": True,
    "stop_reason": "nothing_left",
    "completion_time_s": 100.0,
    "coverage": 0.995,
    "distance_m": 110.0,
    "speed_mean_mps": 1.1,
    "collisions": 0,
    "min_clearance_m": 0.31,
    "stages": {"decision": {"p50_ms": 4.0, "p99_ms": 9.0}},
}


def key_of(scene):
    """Of the row of its mission."""
    return (scene, "1", "paper", "explorer_collector", "")


class Rows(TemporaryFolder):
    """What is kept of a mission."""

    def row(self, scene="f_s1", cap="paper", strategy="explorer_collector", **changes):
        (self.folder / "result.json").write_text(json.dumps(dict(RESULT, **changes)))
        return row_of(Mission("a", f"{scene}.csv", 1, cap, strategy), self.folder, "", "abc")

    def test_survive_the_file(self):
        path = self.folder / "rows.csv"
        first, second = self.row(), self.row("f_s2", error="said, \"so\"")
        for row in (first, second):
            append_row(path, row)
        rows = read_rows(path)
        self.assertEqual(list(rows), [key_of("f_s1"), key_of("f_s2")])
        self.assertEqual(rows[key_of("f_s1")], first)
        self.assertEqual(first["decision_p99_ms"], "9.0")

    def test_a_last_row_cut_short_is_flown_again(self):
        path = self.folder / "rows.csv"
        append_row(path, self.row())
        with path.open("a", encoding="utf-8") as lines:
            lines.write("f_s2,1")
        self.assertEqual(list(read_rows(path)), [key_of("f_s1")])

        append_row(path, self.row("f_s3"))
        self.assertEqual([key[0] for key in read_rows(path)], ["f_s1", "f_s3"])

    def test_a_last_value_cut_short_is_not_taken_for_whole(self):
        path = self.folder / "rows.csv"
        append_row(path, self.row())
        path.write_bytes(path.read_bytes()[:-2])
        self.assertEqual(read_rows(path), {})

    def test_failures_are_kept_and_not_good(self):
        self.assertTrue(is_good(self.row()))
        self.assertFalse(is_good(self.row(collisions=1)))
        self.assertFalse(is_good(self.row(completed=False, completion_time_s=None)))
        (self.folder / "result.json").unlink()
        row = row_of(Mission("a", "", 1, "paper"), self.folder, "no such scenario", "abc")
        self.assertFalse(is_good(row))
        self.assertEqual(set(row), set(COLUMNS))

    def test_table_has_mean_deviation_and_failures(self):
        rows = [
            self.row("f_s1"),
            self.row("f_s2", completion_time_s=120.0),
            self.row("f_s3", collisions=2, coverage=0.5),
        ]
        lines = markdown(rows).splitlines()
        self.assertEqual(len(lines), 3)
        cells = [cell.strip() for cell in lines[2].split("|")]
        self.assertEqual(
            cells[1:7], ["f", "paper", "explorer_collector", "3", "1", "110.0 ± 14.1"]
        )
        self.assertEqual(cells[9:11], ["50.00", "2"])

    def test_comparison_is_of_mean_times_of_good_missions(self):
        rows = [
            self.row("f_s1"),
            self.row("f_s2", completion_time_s=120.0),
            self.row("f_s3", completion_time_s=9.0, collisions=1),
            self.row("f_s1", strategy="fuel", completion_time_s=200.0),
            self.row("f_s1", cap="strict", strategy="fuel", completion_time_s=200.0),
        ]
        lines = comparison(rows).splitlines()
        self.assertEqual(lines[2], "| f | paper | 0.55 |")
        self.assertEqual(lines[3], "| f | strict | - |")
        self.assertEqual(comparison(rows[:2]), "")

    def test_cost_of_variants_is_against_the_first(self):
        rows = [
            dict(self.row(**changes), variant=name, title=name)
            for name, changes in (
                ("as it is", {}),
                ("slow", {"completion_time_s": 125.0, "coverage": 0.9}),
                ("blind", {"completed": False, "completion_time_s": None}),
            )
        ]
        lines = cost_of_variants(rows).splitlines()
        self.assertEqual(lines[2], "| as it is | 1.00 | 99.50 | 0 of 1 |")
        self.assertEqual(lines[3], "| slow | 1.25 | 90.00 | 0 of 1 |")
        self.assertEqual(lines[4], "| blind | - | 99.50 | 1 of 1 |")
        self.assertEqual(cost_of_variants(rows[:1]), "")
        self.assertEqual(cost_of_variants([dict(row, title="group") for row in rows]), "")

    def test_of_another_version_are_refused(self):
        path = self.write("rows.csv", "scene,seed,speed_cap\na,1,paper\n")
        with self.assertRaisesRegex(OSError, "another version"):
            read_rows(path)


TICKS = """time_s,x_m,y_m,z_m,coverage,clearance_m
0.0,0,0,1,0.0,1
0.5,0.5,0,1,,1
1.0,1.0,0,1,0.5,1
2.5,1.0,1.5,1,0.8,1
3.0,1.0"""


class Courses(TemporaryFolder):
    """What is kept for the figures, and the figures."""

    def test_are_sampled_at_whole_seconds_and_survive_the_file(self):
        found = series.sampled(self.write("ticks.csv", TICKS))
        path = self.folder / "m.csv"
        series.write(path, found)
        kept = series.read(path)
        self.assertEqual([round(x, 4) for x in kept.coverage], [0.0, 0.5, 0.7])
        self.assertEqual([round(x, 2) for x in kept.distance_m], [0.0, 1.0, 2.0])
        self.assertIsNone(series.read(self.folder / "none.csv"))

    def test_are_drawn_with_who_has_finished_staying_where_it_ended(self):
        long = series.Series(np.linspace(0, 1, 101), np.linspace(0, 150, 101))
        short = series.Series(np.linspace(0, 1, 51), np.linspace(0, 75, 51))
        self.assertEqual(bench_figures.coverage_percent(short, 101)[-1], 100.0)
        self.assertTrue(np.isnan(bench_figures.speed_mps(short, 101)[-1]))
        self.assertAlmostEqual(bench_figures.speed_mps(long, 101)[50], 1.5)
        groups = {("f", "paper", "a"): [long, short], ("f", "strict", "b"): [short]}
        for path in bench_figures.write_figures(groups, self.folder):
            self.assertGreater(path.stat().st_size, 10000)


class Elsewhere(TemporaryFolder):
    """Missions that other machines fly."""

    def test_survive_the_way_back(self):
        course = series.Series(np.array([0.0, 0.5]), np.array([0.0, 1.5]))
        row, back = spread.from_line(spread.line_of({"scene": "a"}, course))
        self.assertEqual(row, {"scene": "a"})
        self.assertEqual(list(back.coverage), [0.0, 0.5])
        self.assertIsNone(spread.from_line(spread.line_of({"scene": "a"}, None))[1])

    def test_are_run_by_parallel_and_what_is_no_mission_is_told(self):
        script = self.write(
            "fly.py",
            "import sys\nprint('noise' if sys.argv[1] == 'b' else "
            "'{\"row\": {\"scene\": \"%s\"}}' % sys.argv[1])\n",
        )
        said = io.StringIO()
        with contextlib.redirect_stderr(said):
            found = list(spread.fly(["a", "b", "c"], ":", 2, [sys.executable, str(script)]))
        self.assertEqual(sorted(row["scene"] for row, _ in found), ["a", "c"])
        self.assertIn("noise", said.getvalue())


class Command(TemporaryFolder):
    """The command as a user meets it, without flying."""

    def bench(self, *words):
        return subprocess.run(
            [sys.executable, str(ROOT / "src/understory_sim/bench/bench.py"), *words],
            env=dict(os.environ, UNDERSTORY_ROOT=str(ROOT)),
            cwd=self.folder,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            encoding="utf-8",
            check=False,
        )

    def test_unknown_table_is_one_line_with_the_known_ones(self):
        done = self.bench("--table", "nothing")
        self.assertEqual(done.returncode, 2)
        self.assertEqual(len(done.stderr.splitlines()), 1)
        self.assertIn("generated", done.stderr)

    def test_unknown_mission_is_one_line(self):
        done = self.bench("--table", "generated", "--only", "nothing")
        self.assertEqual(done.returncode, 2)
        self.assertEqual(len(done.stderr.splitlines()), 1)

    def test_folder_that_cannot_be_written_is_found_at_start(self):
        self.write("occupied", "")
        done = self.bench("--table", "generated", "--out", "occupied/here")
        self.assertEqual(done.returncode, 2)
        self.assertIn("occupied", done.stderr)

    def test_help(self):
        done = self.bench("--help")
        self.assertEqual(done.returncode, 0)
        self.assertIn("--table", done.stdout)


if __name__ == "__main__":
    unittest.main()
