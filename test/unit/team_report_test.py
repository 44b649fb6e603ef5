#!/usr/bin/python3
# Copyright 2026 the Understory authors
# SPDX-License-Identifier: BSD-3-Clause
"""The report of a team's mission: a page of all, one of each vehicle, and what is missing."""

import contextlib
import io
import json
import pathlib
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "src" / "understory_sim" / "report"))
import report  # noqa: E402
import team_time  # noqa: E402

TICKS = (
    "time_s,x_m,y_m,z_m,vx_mps,vy_mps,vz_mps,speed_mps,yaw_rad,yaw_rate_radps,mode,mission_state,"
    "coverage,explored_volume_m3,clusters,trails,dormant,target_id,target_x_m,target_y_m,target_z_m,"
    "clearance_m\n"
)
RESULT = {"completed": True, "stop_reason": "nothing_left", "scenario": "<pair>", "collisions": 0}
RESULT["completion_time_s"] = 71.25


class TeamReport(unittest.TestCase):
    """A team of two that has flown two seconds."""

    def setUp(self):
        keeper = tempfile.TemporaryDirectory()
        self.addCleanup(keeper.cleanup)
        self.folder = pathlib.Path(keeper.name)
        for number in (0, 1):
            vehicle = self.folder / f"vehicle_{number}"
            vehicle.mkdir()
            (vehicle / "result.json").write_text(json.dumps(RESULT))
            rows = "".join(
                f"{t}.0,{t},{number},1,1,0,0,1,0,0,explorer,explore,0.{t}5,{t}0,3,1,0,,,,,2.0\n"
                for t in range(3)
            )
            (vehicle / "ticks.csv").write_text(TICKS + rows)
        mates = [{"id": 0, "completion_time_s": 70.5}, {"id": 1, "is_lost": True}]
        content = dict(RESULT, team=mates, least_separation_m=1.75, coverage=0.9975)
        (self.folder / "result.json").write_text(json.dumps(content))

    def test_there_is_a_page_of_all_and_one_of_each(self):
        page = report.make_report(self.folder).read_text(encoding="utf-8")
        self.assertIn("71.2 s", page)
        self.assertIn("1.75 m", page)
        self.assertIn("vehicle 1 (lost)", page)
        self.assertIn("&lt;pair&gt;", page)
        for number in (0, 1):
            self.assertIn(f'href="vehicle_{number}/report.html"', page)
            self.assertTrue((self.folder / f"vehicle_{number}" / "report.html").exists())
        for name in ("team_path.png", "team_volume.png", "team_time.png"):
            self.assertEqual((self.folder / name).read_bytes()[:4], b"\x89PNG")

    def test_a_collision_is_not_good(self):
        content = json.loads((self.folder / "result.json").read_text())
        (self.folder / "result.json").write_text(json.dumps(dict(content, collisions=1)))
        page = report.make_report(self.folder).read_text(encoding="utf-8")
        self.assertIn("collided", page)

    def test_a_vehicle_whose_ticks_are_cut_off_in_the_head_is_named(self):
        (self.folder / "vehicle_1" / "ticks.csv").write_text("time_s\n")
        said = io.StringIO()
        with contextlib.redirect_stderr(said):
            self.assertEqual(report.main([str(self.folder)]), 2)
        self.assertIn("vehicle_1/ticks.csv:1: no column", said.getvalue())

    def test_all_the_time_until_the_last_is_down_is_put_to_some_use(self):
        flown = [
            "0.0,brake,take_off,0.0",
            "1.0,explorer,explore,1.5",
            "3.0,collector,explore,2.0",
            "7.0,collector,explore,0.05",
            "15.0,transit,meet,1.0",
            "21.0,transit,return_home,1.0",
            "29.0,transit,land,0.2",
            "31.0,transit,land,0.0",
        ]
        rows = [line.split(",") for line in flown]
        for number, end in ((0, len(rows)), (1, 2)):
            text = "".join(
                f"{t},0,0,1,1,0,0,{v},0,0,{mode},{state},0.1,1,3,1,0,,,,,2.0\n"
                for t, mode, state, v in rows[:end]
            )
            (self.folder / f"vehicle_{number}" / "ticks.csv").write_text(TICKS + text)
        said = io.StringIO()

        with contextlib.redirect_stdout(said):
            self.assertEqual(team_time.main([str(self.folder)]), 0)

        means = [float(cell) for cell in said.getvalue().splitlines()[-1].split("|")[2:-1]]
        self.assertEqual(means, [1.0, 2.0, 4.0, 3.0, 5.0, 16.0])
        self.assertEqual(sum(means), 31.0)


if __name__ == "__main__":
    unittest.main()
