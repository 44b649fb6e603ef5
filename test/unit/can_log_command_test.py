#!/usr/bin/python3
# Copyright 2026 the Understory authors
# SPDX-License-Identifier: BSD-3-Clause
"""`understory log` as a user meets it: what it prints and writes, wrong use, interruption."""

import contextlib
import csv
import io
import json
import os
import pathlib
import signal
import subprocess
import sys
import tempfile
import time
import unittest
import warnings

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "support"))
from can_flight import BEGIN_US, BY_NAME, DBC, LOG, ROOT, Sent, candump, flight, line  # noqa: E402
from can_logs import drop  # noqa: E402
import log  # noqa: E402

NOT_OURS = "(1700000002.997008) vcan0 7F0#0102\n"  # 2.997 s after the first


class Command(unittest.TestCase):
    def setUp(self):
        keeper = tempfile.TemporaryDirectory()
        self.addCleanup(keeper.cleanup)
        self.folder = pathlib.Path(keeper.name)
        self.file = self.folder / "flight.log"

    def write(self, text):
        self.file.write_text(text, encoding="ascii")
        return self.file

    def run_here(self, *words):
        """In this process: exit status, output and errors."""
        with contextlib.redirect_stdout(io.StringIO()) as output:
            with contextlib.redirect_stderr(io.StringIO()) as errors:
                try:
                    status = log.main([str(word) for word in words])
                except SystemExit as exit_:
                    status = exit_.code
        return status, output.getvalue(), errors.getvalue()

    def run_command(self, *words, **options):
        return subprocess.run(
            [str(ROOT / "understory"), "log", *map(str, words)],
            cwd=self.folder,
            stdin=subprocess.DEVNULL,
            capture_output=True,
            encoding="utf-8",
            timeout=120,
            check=False,
            **options,
        )


class Views(Command):
    def test_the_summary_is_the_default_and_says_it_all(self):
        self.write(candump(flight()))

        outcome = self.run_command("flight.log")

        self.assertEqual((outcome.returncode, outcome.stderr), (0, ""))
        for words in (
            r"^flight\.log: 4011 frames of vcan0 in 2\.996 s, from 2023-11-14 22:13:20 UTC$",
            r"^SP_VEL +300 +\d+\.\d+ +10\.00",
            r"^not seen: KILL, ESC_CMD$",
            r"^bus load at 1 Mbit/s: mean 15\.\d %, peak 16\.\d % in 100 ms",
            r"^setpoints: 300 complete, 0 torn; answers: 200 FLOWN, 100 NOT_ARMED; 0 unanswered$",
            r"^ +0\.507 +2\.000 +ARMED$",
            r"^commit_to_ack +300 ",
            r"^no errors$",
        ):
            self.assertRegex(outcome.stdout, f"(?m){words}")

    def test_the_summary_as_json_has_the_same(self):
        self.write(candump(flight()))

        status, output, errors = self.run_here(self.file, "--summary", "--json")

        self.assertEqual((status, errors), (0, ""))
        self.assertEqual(json.loads(output)["sets"]["setpoint"]["complete"], 300)

    def test_decode_shows_every_frame_with_units_names_and_marks(self):
        missing = Sent(2_998_000, BY_NAME["SP_VEL"], 12, {"SpVx": -32768, "SpVy": -1500})
        bad = candump([missing]).replace(".998000", ".998500")[:-2] + "1\n"
        self.write(candump(flight()) + NOT_OURS + candump([missing]) + bad)

        status, output, errors = self.run_here(self.file, "--decode")

        lines = output.splitlines()
        self.assertEqual((status, errors, len(lines)), (0, "", 4014))
        self.assertIn("0.000000 SP_POS_XY   0  SpXyFrame=MAP  SpX=0.000 m  SpY=0.000 m", lines[0])
        self.assertEqual(lines[-3].split(), ["2.997000", "other", "7F0#0102"])
        self.assertIn("SpVx=nan m/s  SpVy=-1.500 m/s  SpVz=0.000 m/s", lines[-2])
        self.assertIn(" SP_VEL     12 !checksum  ", lines[-1])

    def test_json_has_an_object_a_line_with_null_for_what_is_not_available(self):
        missing = Sent(2_998_000, BY_NAME["SP_VEL"], 12, {"SpVx": -32768, "SpVy": -1500})
        short = "(1700000002.999000) vcan0 104#0102\n"
        self.write(candump(flight()) + NOT_OURS + candump([missing]) + short)

        status, output, errors = self.run_here(self.file, "--json")

        rows = [json.loads(each) for each in output.splitlines()]
        self.assertEqual((status, errors, len(rows)), (0, "", 4014))
        self.assertEqual(rows[4]["signals"]["sp_mask_name"], "ALL")
        self.assertEqual(rows[-3], {"time_s": 2.997, "message": None, "frame": "7F0#0102"})
        velocity = {"sp_vx_mps": None, "sp_vy_mps": -1.5, "sp_vz_mps": 0.0, "sp_vel_rsv": 0}
        self.assertEqual(rows[-2]["signals"], velocity)
        self.assertEqual((rows[-2]["counter"], rows[-2]["check"]), (12, "good"))
        self.assertEqual((rows[-1]["check"], rows[-1]["frame"]), ("length", "104#0102"))
        self.assertEqual(set(rows[-1]["signals"].values()), {None})

    def test_csv_is_a_table_for_each_message_or_one_for_all(self):
        self.write(candump(flight()) + NOT_OURS + "(1700000002.999000) vcan0 102#01\n")
        folder, single = self.folder / "tables", self.folder / "all.csv"

        self.assertEqual(self.run_here(self.file, "--csv", folder)[0], 0)
        self.assertEqual(self.run_here(self.file, "--csv", single)[0], 0)

        tables = {}
        for path in folder.iterdir():
            with open(path, encoding="utf-8", newline="") as file:
                tables[path.stem] = list(csv.DictReader(file))
        self.assertEqual(len(tables), 26)  # all messages but two, and the others
        self.assertEqual(sum(len(rows) for rows in tables.values()), 4013)
        self.assertEqual(tables["other"], [{"time_s": "2.997000", "frame": "7F0#0102"}])
        self.assertEqual(tables["VEH_STATE"][0]["state_name"], "DISARMED")
        self.assertEqual(tables["SP_VEL"][-1]["check"], "length")
        self.assertEqual(tables["SP_VEL"][-1]["sp_vx_mps"], "")
        with open(single, encoding="utf-8", newline="") as file:
            rows = list(csv.reader(file))
        self.assertEqual({len(row) for row in rows}, {len(rows[0])})
        self.assertEqual(len(rows), 4014)
        wide = [dict(zip(rows[0], row)) for row in rows[1:]]
        for message, table in tables.items():
            if message != "other":
                of_message = [row for row in wide if row["message"] == message]
                self.assertEqual([{k: row[k] for k in table[0]} for row in of_message], table)

    def test_absolute_stamps_are_those_of_the_log(self):
        self.write(candump(flight(0.1)))

        _, output, _ = self.run_here(self.file, "--json", "--absolute")

        stamps = [line_.split(",")[0].split(":")[1] for line_ in output.splitlines()]
        expected = [BEGIN_US + each.time_us for each in flight(0.1)]
        self.assertEqual([round(float(stamp) * 1e6) for stamp in stamps], expected)

    def test_latency_is_a_table_also_as_json_and_csv(self):
        self.write(candump(flight()))

        status, output, _ = self.run_here(self.file, "--latency", "--csv", self.folder / "out")
        _, as_json, _ = self.run_here(self.file, "--latency", "--json")
        single = self.folder / "one.csv"
        self.run_here(self.file, "--latency", "--csv", single)

        self.assertEqual(status, 0)
        self.assertRegex(output, r"(?m)^commit_to_ack +300 +0\.15\d +0\.24\d ")
        self.assertEqual(json.loads(as_json)["commit_to_ack"]["count"], 300)
        self.assertEqual(single.read_text(), (self.folder / "out" / "latency.csv").read_text())
        self.assertIn("\ncommit_to_ack,300,0.15", single.read_text())
        samples = (self.folder / "out" / "latency_samples.csv").read_text().splitlines()
        self.assertEqual(len([each for each in samples if each.startswith("setpoint_age,")]), 300)

    def test_plots_are_drawn_of_whole_and_of_sparse_logs_alike_each_time(self):
        names = ["bus_load.png", "latency.png", "power.png", "setpoints.png", "states.png"]
        early = "(0000000010.000000) vcan0 104#01\n"  # and then the computer learned the time
        texts = (candump(flight()), candump(flight()[:1]), NOT_OURS, early + candump(flight(0.5)))
        for number, text in enumerate(texts):
            with self.subTest(text[:60]), warnings.catch_warnings():
                warnings.simplefilter("error")
                self.write(text)
                folder = self.folder / str(number)

                status, _, errors = self.run_here(self.file, "--plots", folder)

                self.assertEqual(status, 0)
                self.assertEqual(len(errors.splitlines()), 5)
                self.assertEqual(sorted(path.name for path in folder.iterdir()), names)
                for path in folder.iterdir():
                    self.assertEqual(path.read_bytes()[:8], b"\x89PNG\r\n\x1a\n")
        first = (folder / "states.png").read_bytes()
        self.run_here(self.file, "--plots", folder)
        self.assertEqual((folder / "states.png").read_bytes(), first)

    def test_check_is_1_only_for_a_log_with_errors(self):
        for frames, words, status in (
            (flight(), ["--check"], 0),
            (drop(flight(), "SP_VEL", [7]), ["--check"], 1),
            (drop(flight(), "SP_VEL", [7]), ["--check", "--latency"], 1),
            (drop(flight(), "SP_VEL", [7]), [], 0),
        ):
            with self.subTest(words):
                self.assertEqual(self.run_here(self.write(candump(frames)), *words)[0], status)
        self.assertIn("error: SP_VEL: 1 frames lost\n", self.run_here(self.file)[1])

    def test_the_bitrate_scales_the_load(self):
        self.write(candump(flight()))

        _, output, _ = self.run_here(self.file, "--bitrate", "250000")

        self.assertRegex(output, r"bus load at 0\.25 Mbit/s: mean 63\.\d %")

    def test_wireshark_writes_configuration_and_dbc(self):
        folder = self.folder / "w"

        outcome = self.run_command("--wireshark", folder)

        self.assertEqual((outcome.returncode, outcome.stderr), (0, ""))
        self.assertEqual((folder / "understory.dbc").read_bytes(), DBC.read_bytes())
        self.assertEqual(len(list(folder.iterdir())), 6)
        self.assertEqual(self.run_here("--wireshark", folder)[0], 0)  # over its own


class Trouble(Command):
    def assert_refused(self, outcome, words):
        status, output, errors = outcome
        self.assertEqual((status, output), (2, ""))
        self.assertEqual(len(errors.splitlines()), 1, errors)
        self.assertTrue(errors.startswith("understory log: "), errors)
        self.assertIn(words, errors)

    def test_wrong_use_is_one_line(self):
        self.write(candump(flight(0.1)))
        for words, said in (
            ([], "no FILE"),
            ([self.file, "more"], "more"),
            ([self.file, "--nonsense"], "--nonsense"),
            ([self.file, "--bitrate", "fast"], "--bitrate"),
            ([self.file, "--bitrate", "0"], "--bitrate"),
            ([self.file, "--summary", "--decode"], "not allowed with"),
            ([self.file, "--json", "--csv", "x"], "not allowed with"),
            ([self.file, "--summary", "--csv", "x"], "--csv"),
            ([self.file, "--absolute"], "--absolute"),
            (["--wireshark", "x", self.file], "--wireshark"),
            ([self.file, "--interface", "can9"], "can9"),
            ([self.file, "--dbc", "/nowhere.dbc"], "/nowhere.dbc"),
            ([self.folder / "none.log"], "none.log"),
            ([DBC], "understory.dbc:1"),
        ):
            with self.subTest(words):
                self.assert_refused(self.run_here(*words), said)

    def test_what_cannot_be_written_is_one_line_and_leaves_no_pieces(self):
        self.write(candump(flight(0.1)))
        blocked = self.folder / "file"
        blocked.write_text("")
        for words in (["--csv", blocked], ["--csv", blocked / "a.csv"], ["--plots", blocked]):
            with self.subTest(words):
                status, _, errors = self.run_here(self.file, *words)
                self.assertEqual((status, len(errors.splitlines())), (2, 1))
                self.assertIn("cannot write", errors)
        self.assert_refused(self.run_here("--wireshark", blocked), "cannot write")
        self.assertEqual(sorted(p.name for p in self.folder.iterdir()), ["file", "flight.log"])

    def test_a_log_cut_off_is_read_with_a_note(self):
        self.write(candump(flight())[:-9])

        status, output, errors = self.run_here(self.file)

        self.assertEqual(status, 0)
        self.assertIn("4010 frames", output)
        self.assertRegex(errors, r"^understory log: note: .*:4011: the last line was cut off.*\n$")

    def test_a_log_may_come_through_a_pipe(self):
        outcome = subprocess.run(
            [str(ROOT / "understory"), "log", "-"],
            input=candump(flight()),
            capture_output=True,
            encoding="utf-8",
            timeout=60,
            check=False,
        )

        self.assertEqual((outcome.returncode, outcome.stderr), (0, ""))
        self.assertIn("4011 frames", outcome.stdout)

    def test_a_reader_that_has_enough_ends_it_quietly(self):
        self.write(candump(flight()))
        command = f"{ROOT}/understory log {self.file} --decode | head -n 1"

        outcome = subprocess.run(
            ["bash", "-c", command], capture_output=True, encoding="utf-8", timeout=60, check=False
        )

        self.assertEqual((outcome.stderr, len(outcome.stdout.splitlines())), ("", 1))

    def test_an_interrupt_ends_with_130_and_without_a_traceback(self):
        pipe = self.folder / "endless.log"
        os.mkfifo(pipe)
        # Unlike the end of a file, a pipe keeps it waiting while we interrupt.
        with subprocess.Popen(
            ["/usr/bin/python3", "-B", str(LOG / "log.py"), str(pipe)],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            encoding="utf-8",
        ) as process:
            with open(pipe, "w", encoding="ascii") as writer:  # opens once it reads
                writer.write(line(0, 0x104, b"\1"))
                writer.flush()
                time.sleep(0.2)
                process.send_signal(signal.SIGINT)
                output, errors = process.communicate(timeout=30)

        self.assertEqual((process.returncode, output, errors), (130, "", ""))

    def test_progress_is_for_terminals_only(self):
        progress = log.Progress()
        progress.begin_s -= 10
        with contextlib.redirect_stderr(io.StringIO()) as errors:
            progress("50 % read")
            progress.clear()
            self.assertEqual(errors.getvalue(), "")
            errors.isatty = lambda: True
            progress("50 % read")
            progress.clear()

        self.assertEqual(errors.getvalue(), "\r\033[K50 % read\r\033[K")


if __name__ == "__main__":
    unittest.main()
