#!/usr/bin/python3
# Copyright 2026 the Understory authors
# SPDX-License-Identifier: BSD-3-Clause
"""Latency of a run: reading its trace, the statistics, the file for Perfetto, and budgets."""

import csv
import io
import json
import pathlib
import random
import sys
import time
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "support"))
from latency_traces import HEADER, ROOT, WHOLE_FRAME, TraceFolder, frame, row, wakeups  # noqa: E402
from budget_file import BudgetError, excesses, read_budget  # noqa: E402
from latency_rows import (  # noqa: E402
    KNOWN_ROWS,
    Statistics,
    csv_text,
    dropped_frames,
    nearest_rank,
    samples_of,
    statistics_of,
)
from trace_events import lanes_of, trace_event_json  # noqa: E402
from trace_file import STAGES, TraceError, read_trace  # noqa: E402


class TraceFile(TraceFolder):
    """What is read, what is left out, and what is refused."""

    def test_rows_in_any_order_give_the_same_statistics(self):
        text = frame(0) + frame(33, map=(14, 25)) + frame(66) + wakeups([0.1] * 5)
        rows = text.splitlines(True)
        expected = statistics_of(self.trace("".join(rows)))

        random.Random(1).shuffle(rows)

        self.assertEqual(statistics_of(self.trace("".join(rows))), expected)

    def test_a_last_line_cut_off_is_left_out_and_noted(self):
        whole = HEADER + frame(0) + row("map", 33, 40, 50)
        for cut in (1, 5, 20):  # also just the newline: the last number may have lost digits
            with self.subTest(cut=cut):
                self.file.write_text(whole[:-cut], encoding="ascii")

                trace = read_trace(self.file)

                self.assertEqual(trace.stages["map"].count, 1)
                self.assertEqual(len(trace.notes), 1)
                self.assertIn("cut off", trace.notes[0])

    def test_a_whole_trace_has_no_notes(self):
        self.assertEqual(self.trace(frame(0) + wakeups([0, 1])).notes, [])

    def test_a_bad_line_is_refused_with_file_and_line(self):
        for bad in (
            "map,1,2",
            "map,1,2,3,4",
            "map,1,2,x",
            "map,1,2,3.5",
            "map,1,-2,3",
            "map,1, 2,3",
            "map,1,2,",
            "map,1,2,12345678901234567890",
            "map,1,2,\u00b2",
            "Map <b>,1,2,3",
            ",1,2,3",
            "",
            "\x00\x00",
            HEADER.strip(),
        ):
            with self.subTest(bad=bad):
                self.write("trace.csv", HEADER + frame(0, ["map"]) + bad + "\n" + frame(33))

                with self.assertRaises(TraceError) as caught:
                    read_trace(self.file)

                self.assertIn(f"{self.file}:3: ", str(caught.exception))
                self.assertNotIn("\n", str(caught.exception))
                self.assertTrue(str(caught.exception).isprintable())

    def test_a_foreign_header_is_refused_in_line_1(self):
        self.write("trace.csv", "time_s,x_m\n1,2\n")

        with self.assertRaisesRegex(TraceError, r"trace\.csv:1: expected stage,exposure_ns"):
            read_trace(self.file)

    def test_a_trace_without_marks_is_refused(self):
        for text in ("", HEADER, HEADER[:9], HEADER + "map,1,2,3"):
            with self.subTest(text=text):
                self.write("trace.csv", text)

                with self.assertRaisesRegex(TraceError, r"trace\.csv: no marks"):
                    read_trace(self.file)

    def test_unknown_stages_come_after_the_known_ones_as_they_began(self):
        trace = self.trace(frame(0, bus_ack=(33.5, 34), bus_tx=(33, 33.4)))

        self.assertEqual(list(trace.stages), [*STAGES, "bus_tx", "bus_ack"])
        self.assertEqual(list(statistics_of(trace))[: len(STAGES) + 2], list(trace.stages))

    def test_rows_that_should_not_be_are_noted_with_their_number(self):
        trace = self.trace(
            frame(0, setpoint=(26, 25))
            + frame(0, ["map"])
            + frame(0, [], bus_tx=(1, 2))
            + frame(0, [], bus_tx=(2, 3))
        )

        self.assertEqual(len(trace.notes), 2, trace.notes)
        self.assertIn("map: 1 rows are of a frame that has one already", trace.notes[0])
        self.assertIn("setpoint: 1 rows end before they begin", trace.notes[1])

    def test_100000_rows_are_read_in_seconds(self):
        lines = "".join(frame(33 * index) for index in range(16_700))
        began = time.process_time()

        statistics = statistics_of(self.trace(lines))

        self.assertLess(time.process_time() - began, 3.0)
        self.assertEqual(sum(statistics[stage].count for stage in STAGES), 8 * 16_700)


class Rows(TraceFolder):
    """Durations, waits, end to end, and their statistics."""

    def test_percentiles_are_of_the_nearest_rank(self):
        ascending = [float(value) for value in range(1, 101)]
        for count, percent, expected in (
            (100, 50, 50),
            (100, 90, 90),
            (100, 99, 99),
            (99, 99, 99),
            (10, 50, 5),
            (10, 90, 9),
            (10, 99, 10),
            (3, 50, 2),
            (1, 50, 1),
            (1, 99, 1),
        ):
            with self.subTest(count=count, percent=percent):
                self.assertEqual(nearest_rank(ascending[:count], percent), expected)

    def test_statistics_of_known_durations(self):
        lateness_ms = list(range(1, 101))
        random.Random(2).shuffle(lateness_ms)

        found = statistics_of(self.trace(wakeups(lateness_ms)))

        self.assertEqual(found["wakeup"], Statistics(100, 50.5, 50.0, 90.0, 99.0, 100.0))

    def test_stages_waits_and_end_to_end_of_one_frame(self):
        found = samples_of(self.trace(frame(0)))

        expected_ms = {
            "camera": 10,
            "cloud": 2,
            "map": 6.5,
            "decision": 3.75,
            "trajectory": 5.75,
            "setpoint": 7,
            "transmit": 3,
            "acknowledge": 0.5,
            "cloud_wait": 1,
            "map_wait": 0.5,
            "decision_wait": 0.25,
            "exposure_to_map": 20,
            "exposure_to_decision": 24,
            "exposure_to_trajectory": 26,
            "exposure_to_setpoint": 33,
            "exposure_to_transmit": 29,
            "exposure_to_acknowledge": 29.5,
            "camera_to_trajectory": 16,
        }
        for name, duration_ms in expected_ms.items():
            self.assertEqual(found[name].duration_ms.tolist(), [duration_ms], name)
        self.assertEqual(set(found), set(KNOWN_ROWS))

    def test_marks_of_different_frames_are_never_combined(self):
        trace = self.trace(
            frame(0, ["camera", "map"])
            + frame(33, ["cloud", "decision"])
            + frame(66, ["trajectory"])
        )

        found = statistics_of(trace)

        for name in ("cloud_wait", "map_wait", "decision_wait", "camera_to_trajectory"):
            self.assertEqual(found[name].count, 0, name)
        self.assertEqual(found["exposure_to_trajectory"].p50_ms, 26.0)

    def test_frames_that_lack_a_stage_are_left_out_of_its_rows_only(self):
        trace = self.trace(
            frame(0) + frame(33, ["camera", "cloud"]) + frame(66, ["camera", "cloud", "map"])
        )

        found = statistics_of(trace)

        counts = {name: found[name].count for name in ("cloud_wait", "map_wait", "decision_wait")}
        self.assertEqual(counts, {"cloud_wait": 3, "map_wait": 2, "decision_wait": 1})
        self.assertEqual(found["exposure_to_map"].count, 2)
        self.assertEqual(found["exposure_to_setpoint"].count, 1)

    def test_rows_of_no_frame_are_no_frame(self):
        trace = self.trace(row("camera", None, 0, 1) + row("cloud", None, 2, 3))

        self.assertEqual(statistics_of(trace)["cloud_wait"].count, 0)
        self.assertEqual(dropped_frames(trace), (0, 0))

    def test_a_wait_may_be_negative(self):
        trace = self.trace(frame(0, ["camera"], cloud=(9.5, 12)))

        self.assertEqual(statistics_of(trace)["cloud_wait"].p50_ms, -0.5)
        self.assertEqual(trace.notes, [])

    def test_the_first_row_of_a_frame_counts_for_waits_and_end_to_end(self):
        trace = self.trace(frame(0, ["cloud"], map=(20, 30)) + frame(0, ["map"]))

        found = statistics_of(trace)

        self.assertEqual(found["map"].count, 2)
        self.assertEqual(found["map_wait"], Statistics(1, 0.5, 0.5, 0.5, 0.5, 0.5))
        self.assertEqual(found["exposure_to_map"].max_ms, 20.0)

    def test_dropped_frames_have_an_image_but_no_map(self):
        trace = self.trace(
            frame(0)
            + frame(33, ["camera"])
            + frame(66, ["camera", "cloud"])
            + frame(99, ["map"])  # its image was not marked
        )

        self.assertEqual(dropped_frames(trace), (2, 3))

    def test_csv_has_a_line_per_row_and_stable_columns(self):
        text = csv_text(statistics_of(self.trace(frame(0) + frame(33))))

        rows = list(csv.DictReader(io.StringIO(text)))
        self.assertEqual(text.split("\n")[0], "stage,count,mean_ms,p50_ms,p90_ms,p99_ms,max_ms")
        self.assertEqual([row["stage"] for row in rows], list(KNOWN_ROWS))
        self.assertEqual(list(rows[2].values())[:4], ["map", "2", "6.500000", "6.500000"])
        self.assertEqual(set(list(rows[8].values())[2:]), {""})  # no wakeup was marked


class TraceEvents(TraceFolder):
    """The file for Perfetto."""

    def events(self, rows):
        document = json.loads(trace_event_json(self.trace(rows)))
        tracks = {
            event["tid"]: event["args"]["name"]
            for event in document["traceEvents"]
            if event["name"] == "thread_name"
        }
        complete = [event for event in document["traceEvents"] if event["ph"] == "X"]
        return tracks, complete

    def test_durations_and_times_are_microseconds_since_the_first_mark(self):
        _, events = self.events(frame(5) + row("wakeup", None, 2, 2.001034))

        found = {event["name"]: (event["ts"], event["dur"]) for event in events}
        self.assertEqual(found["wakeup"], (0.0, 1.034))
        self.assertEqual(found["camera"], (3000.0, 10000.0))
        self.assertEqual(found["map"], (16500.0, 6500.0))
        self.assertEqual(len(events), len(WHOLE_FRAME) + 1)

    def test_each_stage_has_a_track_of_its_name(self):
        tracks, events = self.events(frame(0) + frame(33) + wakeups([1, 1]))

        self.assertEqual(list(tracks.values()), [*WHOLE_FRAME, "wakeup"])
        self.assertNotIn(0, tracks)
        for event in events:
            self.assertEqual(tracks[event["tid"]], event["name"])

    def test_events_of_a_frame_have_its_number_and_others_none(self):
        _, events = self.events(frame(33, ["map"]) + frame(0, ["camera"]) + wakeups([1]))

        found = {event["name"]: event["args"] for event in events}
        self.assertEqual(found, {"camera": {"frame": 0}, "map": {"frame": 1}, "wakeup": {}})

    def test_events_of_a_track_never_overlap(self):
        generator = random.Random(3)
        late_ms = [generator.choice([0.1, 15, 35]) for _ in range(200)]
        tracks, events = self.events(wakeups(late_ms))

        self.assertEqual(len(events), 200)
        self.assertEqual(
            list(tracks.values()), ["wakeup", "wakeup (2)", "wakeup (3)", "wakeup (4)"]
        )
        free = dict.fromkeys(tracks, 0.0)
        for event in sorted(events, key=lambda event: event["ts"]):
            self.assertGreaterEqual(event["ts"], free[event["tid"]])
            free[event["tid"]] = event["ts"] + event["dur"]

    def test_one_after_the_other_takes_one_lane(self):
        trace = self.trace("".join(row("map", at, at, at + 10) for at in range(0, 100, 10)))

        self.assertEqual(set(lanes_of(trace.stages["map"])), {0})

    def test_an_event_that_ends_before_it_begins_has_no_duration(self):
        _, events = self.events(frame(0, ["camera"], setpoint=(26, 25)))

        self.assertEqual([event["dur"] for event in events], [10000.0, 0.0])


class BudgetFile(TraceFolder):
    """Limits: what is over, and what is no budget."""

    def budget(self, text):
        return read_budget(self.write("budget.yaml", text), KNOWN_ROWS)

    def found(self, budget, lateness_ms):
        return excesses(self.budget(budget), statistics_of(self.trace(wakeups(lateness_ms))))

    def test_only_what_is_above_its_limit_is_over(self):
        hundred = list(range(1, 101))
        for limits, over in (
            ("{p99_ms: 99}", []),
            ("{p99_ms: 98.9}", ["p99_ms"]),
            ("{p50_ms: 49, p90_ms: 90, max_ms: 99}", ["p50_ms", "max_ms"]),
            ("{mean_ms: 50.5}", []),
            ("{mean_ms: 50.4}", ["mean_ms"]),
        ):
            with self.subTest(limits=limits):
                lines = self.found(f"wakeup: {limits}\n", hundred)

                self.assertEqual([line.split()[1] for line in lines], over)
                self.assertTrue(all(line.startswith("wakeup: ") for line in lines))

    def test_a_row_without_samples_is_over(self):
        found = self.found("wakeup: {max_ms: 1000}\nmap: {p99_ms: 1000}\n", [1])

        self.assertEqual(found, ["map: no samples"])

    def test_bad_budgets_are_refused_with_file_and_key(self):
        for content, key in (
            ("wakupe: {p99_ms: 1}\n", "wakupe: unknown stage"),
            ("3: {p99_ms: 1}\n", "3: unknown stage"),
            ("wakeup: {p95_ms: 1}\n", "wakeup.p95_ms: unknown key"),
            ("wakeup: {count: 1}\n", "wakeup.count: unknown key"),
            ("wakeup: {p99_ms: soon}\n", "wakeup.p99_ms: expected milliseconds"),
            ("wakeup: {p99_ms: true}\n", "wakeup.p99_ms: expected milliseconds"),
            ("wakeup: {p99_ms: -1}\n", "wakeup.p99_ms: expected milliseconds"),
            ("wakeup: {p99_ms: .nan}\n", "wakeup.p99_ms: expected milliseconds"),
            ("wakeup: {p99_ms: .inf}\n", "wakeup.p99_ms: expected milliseconds"),
            ("wakeup: 20\n", "wakeup: expected limits"),
            ("wakeup: {}\n", "wakeup: expected limits"),
            ("map: {p99_ms: 1}\nmap: {max_ms: 1}\n", "map: given twice"),
            ("", "expected stages"),
            ("- wakeup\n", "expected stages"),
            ("wakeup: [\n", "not YAML"),
            ("[a]: {p99_ms: 1}\n", "not YAML"),
        ):
            with self.subTest(content=content):
                with self.assertRaises(BudgetError) as caught:
                    self.budget(content)

                self.assertIn(f"{self.folder / 'budget.yaml'}: {key}", str(caught.exception))
                self.assertNotIn("\n", str(caught.exception))

    def test_our_budget_is_one(self):
        budget = read_budget(ROOT / "config" / "latency_budget.yaml", KNOWN_ROWS)

        self.assertIn("exposure_to_trajectory", budget)
        self.assertIn("wakeup", budget)


if __name__ == "__main__":
    unittest.main()
