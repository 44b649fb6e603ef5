#!/usr/bin/python3
# Copyright 2026 the Understory authors
# SPDX-License-Identifier: BSD-3-Clause
"""Tables of missions flown by teams: what is kept of how the work was shared, and missions that are
over when their time is."""

import json
import pathlib
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "src" / "understory_sim" / "bench"))
import series  # noqa: E402
import team_rows  # noqa: E402
from rows import grouped, is_good, row_of  # noqa: E402
from table_file import Mission, TableError, read_table  # noqa: E402

TEAM = {
    "completed": True,
    "stop_reason": "nothing_left",
    "completion_time_s": 600.0,
    "mission_time_s": 700.0,
    "collisions": 0,
    "explored_volume_m3": 9000.0,
    "volume_at": [{"time_s": 300.0, "volume_m3": 5000.0}, {"time_s": 600.0, "volume_m3": 8900.0}],
    "least_separation_m": 1.75,
    "team": [
        {
            "seen_volume_m3": 4000.0,
            "bytes_per_s": 900.0,
            "peak_bytes_per_s": 12000,
            "steady_peak_bytes_per_s": 7000,
        },
        {
            "seen_volume_m3": 5000.0,
            "bytes_per_s": 1100.0,
            "peak_bytes_per_s": 11000,
            "steady_peak_bytes_per_s": 8000,
        },
    ],
}


class Teams(unittest.TestCase):
    """A folder that is gone afterwards."""

    def setUp(self):
        keeper = tempfile.TemporaryDirectory()
        self.addCleanup(keeper.cleanup)
        self.folder = pathlib.Path(keeper.name)

    def row(self, timed=False, **changes):
        (self.folder / "result.json").write_text(json.dumps(dict(TEAM, **changes)))
        return row_of(Mission("t", "", 1, "paper", timed=timed), self.folder, "", "abc")

    def test_a_row_says_how_the_work_was_shared_and_what_was_sent(self):
        row = self.row()
        self.assertEqual(row["team_size"], "2")
        self.assertEqual(row["balance"], "0.8")
        self.assertEqual(row["least_separation_m"], "1.75")
        self.assertEqual(row["sent_bytes_per_s"], "1100.0")
        self.assertEqual(row["sent_peak_bytes"], "12000")
        self.assertEqual(row["sent_steady_peak_bytes"], "8000")

    def test_overlap_is_what_was_seen_more_than_once(self):
        self.assertEqual(self.row(explored_volume_m3=7200.0)["overlap"], "0.25")
        self.assertEqual(self.row(team=[])["overlap"], "")

    def test_after_the_end_there_is_as_much_as_at_the_end(self):
        row = self.row()
        self.assertEqual(row["volume_300_s"], "5000.0")
        self.assertEqual(row["volume_900_s"], "9000.0")

    def test_before_the_end_a_volume_that_was_not_taken_is_not_made_up(self):
        row = self.row(mission_time_s=1400.0)
        self.assertEqual(row["volume_900_s"], "")
        self.assertEqual(row["volume_1500_s"], "9000.0")

    def test_the_table_has_a_line_for_teams_only(self):
        rows = [self.row(), self.row(team=[])]
        rows[1]["title"] = "alone"
        lines = team_rows.markdown(grouped(rows)).splitlines()
        self.assertEqual(len(lines), 3)
        cells = [cell.strip() for cell in lines[2].split("|")][1:-1]
        self.assertEqual(cells[:5], ["t", "explorer_collector", "2", "0.80 / 0.80", "0.00"])
        self.assertEqual(cells[5], "1.75")
        self.assertEqual(team_rows.markdown(grouped(rows[1:])), "")

    def test_a_mission_over_in_time_is_good_only_where_that_is_wanted(self):
        late = {"completed": False, "completion_time_s": None, "stop_reason": "time_limit"}
        self.assertFalse(is_good(self.row(**late)))
        self.assertTrue(is_good(self.row(timed=True, **late)))
        self.assertFalse(is_good(self.row(timed=True, **dict(late, collisions=1))))
        self.assertFalse(is_good(self.row(timed=True, **dict(late, stop_reason="sensor_lost"))))

    def test_timed_is_true_or_false(self):
        path = self.folder / "t.yaml"
        path.write_text("scenario: a\ntimed: true\n")
        self.assertTrue(all(mission.timed for mission in read_table(path, self.folder)))
        path.write_text("scenario: a\ntimed: 3\n")
        with self.assertRaisesRegex(TableError, "timed: expected true or false"):
            read_table(path, self.folder)

    def test_the_course_of_a_team_is_what_the_one_knows_who_knows_most(self):
        for number, coverage in enumerate((0.5, 0.25)):
            folder = self.folder / f"vehicle_{number}"
            folder.mkdir()
            ticks = "time_s,x_m,y_m,z_m,coverage,clearance_m\n"
            ticks += f"0.0,0,0,1,0.0,1\n2.0,{2 * number},0,1,{coverage},1\n"
            (folder / "ticks.csv").write_text(ticks)
        course = series.sampled_of(self.folder)
        self.assertEqual(list(course.coverage), [0.0, 0.25, 0.5])
        self.assertEqual(course.distance_m[-1], 1.0)


if __name__ == "__main__":
    unittest.main()
