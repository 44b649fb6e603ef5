#!/usr/bin/python3
# Copyright 2026 the Understory authors
# SPDX-License-Identifier: BSD-3-Clause
"""The report on missions of every kind: flown to the end, broken off, not begun, and unreadable."""

import contextlib
import io
import json
import re
import subprocess
import sys
import tempfile
import unittest
import warnings
from pathlib import Path

REPORT = Path(__file__).resolve().parents[2] / "src" / "understory_sim" / "report" / "report.py"
sys.path.insert(0, str(REPORT.parent))
import report  # noqa: E402
FIGURES = ["path", "coverage", "speed", "modes", "times"]
HEADER = (
    "time_s,x_m,y_m,z_m,vx_mps,vy_mps,vz_mps,speed_mps,yaw_rad,yaw_rate_radps,mode,mission_state,"
    "coverage,explored_volume_m3,clusters,trails,dormant,target_id,target_x_m,target_y_m,"
    "target_z_m,clearance_m\n"
)


def tick(index: int, count: int, clearance: str = "0.5000") -> str:
    mode = "collector" if (index // 100) % 3 == 2 else "explorer"
    target = "7,1.0000,2.0000,1.0000" if index % 2 else ",,,"
    return (
        f"{index / 10:.3f},{index / 100 - 4:.4f},{(index % 50) / 25:.4f},1.0000,1.0000,0.0000,"
        f"0.0000,1.0000,0.0000,0.0000,{mode},explore,{index / count:.6f},{index:.3f},"
        f"12,3,1,{target},{clearance}\n"
    )


def result(**changes) -> dict:
    values = {
        "completed": True,
        "stop_reason": "nothing left",
        "completion_time_s": 79.9,
        "coverage": 0.999,
        "t50_s": 40.0,
        "t90_s": 72.0,
        "t95_s": 76.0,
        "t99_s": None,
        "distance_m": 80.0,
        "speed_mean_mps": 1.0,
        "speed_max_mps": 1.5,
        "collisions": 0,
        "min_clearance_m": 0.5,
        "explorer_speed_mps": 1.5,
        "collector_speed_mps": 3.0,
        "scenario": "small <&>",
        "strategy": "explorer_collector",
        "seed": 1,
        "box_m": {"min": [-5, -5, 0], "max": [5, 5, 2]},
        "topview": {"x0_m": -5, "y0_m": -5, "cell_m": 1, "width": 10, "height": 10},
        "stages": {"map": {"count": 9, "mean_ms": 1, "p50_ms": 1, "p99_ms": 2, "max_ms": 3}},
        "counters": {"braked": 4},
    }
    values.update(changes)
    return values


class ReportTest(unittest.TestCase):
    def setUp(self):
        self.temporary = tempfile.TemporaryDirectory()
        self.addCleanup(self.temporary.cleanup)
        self.folder = Path(self.temporary.name)
        self.write_mission()

    def write_mission(self, ticks: int = 800, cut: str = "", clearance: str = "0.5000", **changes):
        rows = "".join(tick(index, 800, clearance) for index in range(ticks))
        self.put("ticks.csv", HEADER + rows + cut)
        self.put("result.json", json.dumps(result(**changes)))
        self.put("config.yaml", "map:\n  resolution_m: 0.1  # <b>\n")
        self.put("trunks.csv", "x_m,y_m,radius_m\n1.0,2.0,0.25\n-3.0,0.5,0.10\n")
        pixels = bytes([0, 1, 128, 255] * 25)
        (self.folder / "topview.pgm").write_bytes(b"P5\n10 10\n255\n" + pixels)

    def put(self, name: str, text: str):
        (self.folder / name).write_text(text, encoding="utf-8")

    def run_report(self, folder=None):
        """Exit code, standard output and standard error."""
        with contextlib.redirect_stdout(io.StringIO()) as output:
            with contextlib.redirect_stderr(io.StringIO()) as errors:
                with warnings.catch_warnings():
                    warnings.simplefilter("error")
                    code = report.main([str(folder or self.folder)])
        return code, output.getvalue(), errors.getvalue()

    def report(self) -> str:
        code, output, errors = self.run_report()
        self.assertEqual((code, errors), (0, ""))
        self.assertEqual(output, f"{self.folder / 'report.html'}\n")
        return (self.folder / "report.html").read_text(encoding="utf-8")

    def error(self, folder=None) -> str:
        code, output, errors = self.run_report(folder)
        self.assertEqual((code, output), (2, ""))
        self.assertEqual(len(errors.splitlines()), 1, errors)
        return errors.strip()

    def test_command_prints_the_path_of_the_page_or_fails_in_one_line(self):
        for folder, code, lines in ((self.folder, 0, (1, 0)), (self.folder / "none", 2, (0, 1))):
            with self.subTest(folder=folder):
                run = subprocess.run(
                    [str(REPORT), str(folder)], capture_output=True, text=True, check=False
                )

                self.assertEqual(run.returncode, code, run.stderr)
                self.assertEqual(
                    (len(run.stdout.splitlines()), len(run.stderr.splitlines())), lines
                )

    def test_complete_mission_makes_five_pictures_and_one_page_that_needs_nothing_else(self):
        page = self.report()

        for name in FIGURES:
            png = (self.folder / f"{name}.png").read_bytes()
            self.assertEqual(png[:8], b"\x89PNG\r\n\x1a\n")
            self.assertGreater(len(png), 5000)
        self.assertEqual(page.count("data:image/png;base64,"), len(FIGURES))
        self.assertNotRegex(page, r'(src|href)="(?!data:)')
        self.assertIn(">completed</span>", page)
        self.assertIn("79.9 s", page)
        self.assertIn("99.90 %", page)
        self.assertNotIn('<ul class="warnings">', page)
        self.assertNotIn('<ul class="notes">', page)

    def test_text_from_files_cannot_become_markup(self):
        page = self.report()

        self.assertIn("Mission in small &lt;&amp;&gt;", page)
        self.assertIn("# &lt;b&gt;", page)
        self.assertNotIn("<b>\n", page)

    def test_same_folder_gives_the_same_bytes(self):
        first = self.report()
        pictures = [(self.folder / f"{name}.png").read_bytes() for name in FIGURES]

        self.assertEqual(self.report(), first)
        self.assertEqual(
            [(self.folder / f"{name}.png").read_bytes() for name in FIGURES], pictures
        )

    def test_collisions_are_a_red_warning(self):
        self.write_mission(collisions=2, clearance="0.1000")

        page = self.report()

        self.assertIn('<ul class="warnings"><li>2 collisions with a trunk.</li>', page)
        self.assertIn(">collided</span>", page)
        self.assertRegex(page, r'class="card alarm"><b>2</b><span>collisions')

    def test_completion_below_99_percent_and_excess_speed_are_warnings(self):
        self.write_mission(coverage=0.91, speed_max_mps=3.2)

        page = self.report()

        self.assertIn("It declared itself complete at 91.00 % coverage.", page)
        self.assertIn("Flew 3.20 m/s where 3 m/s is the limit.", page)

    def test_interrupted_mission_says_why_and_leaves_out_the_row_that_was_cut_off(self):
        self.write_mission(
            ticks=300,
            cut="30.000,1.0",
            completed=False,
            completion_time_s=None,
            stop_reason="interrupted",
        )

        page = self.report()

        self.assertIn("The mission did not complete: interrupted.", page)
        self.assertIn("ticks.csv was cut off in mid-row", page)
        self.assertIn("<b>never</b><span>completion time", page)

    def test_missions_without_a_tick_or_with_one_still_have_a_report(self):
        for ticks in (0, 1, 2):
            with self.subTest(ticks=ticks):
                self.write_mission(ticks=ticks, completed=False, stages={})

                self.assertEqual(self.report().count("data:image/png"), len(FIGURES))

    def test_what_may_be_missing_is_noted(self):
        for name in ("config.yaml", "trunks.csv", "topview.pgm"):
            (self.folder / name).unlink()

        page = self.report()

        for name in ("config.yaml", "trunks.csv", "topview.pgm"):
            self.assertIn(f"{name} is missing from the result folder.", page)

    def test_sparse_result_still_has_a_report(self):
        (self.folder / "topview.pgm").unlink()
        self.put("result.json", '{"completed": false, "stages": 3, "box_m": [1], "coverage": "x"}')

        self.assertIn("no reason was recorded", self.report())

    def test_long_and_tall_scenes_fit_the_page(self):
        for size_x, size_y in ((100, 10), (10, 100)):
            with self.subTest(size=(size_x, size_y)):
                box = {"min": [-size_x / 2, -size_y / 2, 0], "max": [size_x / 2, size_y / 2, 2]}
                (self.folder / "topview.pgm").unlink(missing_ok=True)
                self.put("result.json", json.dumps(result(box_m=box)))

                self.report()

                png = (self.folder / "path.png").read_bytes()
                width, height = (int.from_bytes(png[at : at + 4], "big") for at in (16, 20))
                self.assertLessEqual(width, 1200)
                self.assertLessEqual(height, 1500)
                self.assertGreaterEqual(height, 300)

    def test_bad_input_is_one_line_that_names_file_and_line(self):
        row = tick(0, 800)
        cases = [
            ("result.json", "{", r"result\.json:1: not valid JSON"),
            ("result.json", "[]", r"result\.json: expected an object of keys"),
            ("ticks.csv", "", r"ticks\.csv:1: no column time_s"),
            ("ticks.csv", "time_s\n1.0\n", r"ticks\.csv:1: no column x_m"),
            ("ticks.csv", HEADER + "1,2\n", r"ticks\.csv:2: 2 columns where 22 belong"),
            ("ticks.csv", HEADER + row + row.replace("1.0000", "x", 1), r"csv:3: 'x' is not a n"),
            ("trunks.csv", "x_m,y_m,radius_m\n1,2\n", r"trunks\.csv:2: expected x_m,y_m,radius_m"),
            ("trunks.csv", "x_m,y_m,radius_m\n1,2,z\n", r"trunks\.csv:2: 'z' is not a number"),
            ("topview.pgm", "P6\n1 1\n255\n", r"topview\.pgm: not a binary PGM"),
            ("topview.pgm", "P5\n10 10\n255\nabc", r"topview\.pgm: 3 pixels where 10 x 10 belong"),
            ("topview.pgm", "P5\n0 0\n255\n", r"topview\.pgm: 0 pixels where 0 x 0 belong"),
        ]
        for name, text, expected in cases:
            with self.subTest(file=name, expected=expected):
                self.write_mission()
                self.put(name, text)

                self.assertRegex(self.error(), "^report: .*" + expected)

    def test_missing_folder_and_missing_files_are_named(self):
        self.assertRegex(self.error(self.folder / "none"), r"/none: not a folder$")
        (self.folder / "ticks.csv").unlink()
        self.assertRegex(self.error(), r"ticks\.csv: No such file or directory$")
        (self.folder / "result.json").unlink()
        self.assertRegex(self.error(), r"result\.json: No such file or directory$")

    def test_figure_that_cannot_be_written_is_named(self):
        (self.folder / "speed.png").mkdir()

        self.assertRegex(self.error(), r"speed\.png: cannot write: Is a directory$")

    def test_columns_are_those_that_the_simulator_writes(self):
        source = REPORT.parents[1] / "understory" / "sim" / "result_writer.cpp"
        literals = re.findall(r'"((?:[a-z0-9_]+,)*[a-z0-9_]+(?:,|\\n))"', source.read_text())

        self.assertIn(HEADER, "".join(literals).replace("\\n", "\n"))


if __name__ == "__main__":
    unittest.main()
