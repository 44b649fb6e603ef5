#!/usr/bin/python3
# Copyright 2026 the Understory authors
# SPDX-License-Identifier: BSD-3-Clause
"""Our decoding of the bus against programs of others: stock tshark, the npm package candied,
python-can. Over frames of every message with codes at all borders, and random ones."""

import json
import math
import os
import pathlib
import subprocess
import sys
import tempfile
import unittest

import can

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "support"))
from can_flight import BEGIN_US, DBC, MESSAGES, ROOT, candump, flight, line  # noqa: E402
import numpy as np  # noqa: E402
from corners import corner_frames, is_legal, physical_value  # noqa: E402
from dbc import LayoutError, crc8, frame_bytes  # noqa: E402
from decode import CODE, GOOD, Protocol, crc8_of, decode  # noqa: E402
from frame_log import read_log  # noqa: E402
from wireshark import write_wireshark  # noqa: E402

GOLDEN = ROOT / "test" / "golden" / "candied.json"
RANDOM_FRAMES = 150  # of each message


class OracleFolder(unittest.TestCase):
    def setUp(self):
        keeper = tempfile.TemporaryDirectory()
        self.addCleanup(keeper.cleanup)
        self.folder = pathlib.Path(keeper.name)
        self.file = self.folder / "oracle.log"

    def decoded(self, text):
        self.file.write_text(text, encoding="ascii")
        return decode(read_log(self.file), Protocol())

    def tshark(self, *options):
        """Its output; a missing tshark is an error: install the packages of config/."""
        outcome = subprocess.run(
            ["tshark", "-r", str(self.file), *options],
            env={**os.environ, "WIRESHARK_CONFIG_DIR": str(self.folder / "wireshark")},
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            encoding="utf-8",
            timeout=240,
            check=False,
        )
        self.assertEqual(outcome.returncode, 0, outcome.stderr)
        return outcome.stdout

    def assert_same(self, ours, theirs, where):
        is_same = math.isclose(ours, theirs, rel_tol=1e-9, abs_tol=1e-9)
        self.assertTrue(is_same, (where, ours, theirs))


class Tshark(OracleFolder):
    """Stock tshark with the tables that we generate from the DBC."""

    def setUp(self):
        super().setUp()
        write_wireshark(MESSAGES, self.folder / "wireshark")

    def test_decodes_every_signal_of_thousands_of_frames_as_we_do(self):
        corners = list(corner_frames(MESSAGES, RANDOM_FRAMES))
        log = self.decoded(
            "".join(line(at, each.message.id, each.data) for at, each in enumerate(corners))
        )
        names = [signal.dbc_name for message in MESSAGES for signal in message.signals]
        fields = [f"signal_pdu.{name}{kind}" for name in names for kind in ("_raw", "")]
        wanted = [word for field in fields for word in ("-e", field)]

        rows = self.tshark("-T", "fields", "-E", "separator=,", *wanted).splitlines()

        self.assertGreater(len(rows), 4000)
        self.assertEqual(len(rows), len(corners))
        compared = 0
        column = {field: at for at, field in enumerate(fields)}
        cells = [row.split(",") for row in rows]
        for message in MESSAGES:
            ours = log[message.dbc_name]
            for signal in message.signals:
                name = signal.dbc_name
                physical = ours.physical(name)
                for at, index in enumerate(ours.index):
                    raw = cells[index][column[f"signal_pdu.{name}_raw"]]
                    self.assertEqual(ours.codes[name][at], int(raw), (name, index))
                    if not np.isnan(physical[at]):  # tshark does not know what is not available
                        theirs = float(cells[index][column[f"signal_pdu.{name}"]])
                        self.assert_same(physical[at], theirs, (name, index))
                    compared += 1
        self.assertEqual(compared, sum(len(each.raws) for each in corners))

    def test_shows_every_message_and_the_name_of_every_code(self):
        wanted = [
            (message, signal, code)
            for message in MESSAGES
            for signal in message.signals
            for code in (signal.values or [0])
        ]
        text = ""
        for at, (message, signal, code) in enumerate(wanted):
            raws = [code if each is signal else 0 for each in message.signals]
            text += line(at, message.id, frame_bytes(message, raws, at % 16))
        self.decoded(text)

        shown = self.tshark("-V").strip().split("\n\n")

        self.assertEqual(len(shown), len(wanted))
        for (message, signal, code), page in zip(wanted, shown):
            self.assertIn(f"Signal PDU: {message.dbc_name}\n", page)
            name = f": {signal.values[code]}\\]" if signal.values else ""
            self.assertRegex(page, rf"(?m)^    {signal.dbc_name}: .*{name}$")

    def test_somebodys_own_preferences_are_left_alone(self):
        own = self.folder / "own"
        own.mkdir()
        (own / "preferences").write_text("gui.x: 1\n")

        with self.assertRaises(LayoutError):
            write_wireshark(MESSAGES, own)

        self.assertEqual([path.name for path in own.iterdir()], ["preferences"])
        self.assertEqual((own / "preferences").read_text(), "gui.x: 1\n")


class Candied(OracleFolder):
    """What the npm package candied makes of the DBC; test/support/remake_candied.js wrote it."""

    def test_decoded_every_signal_of_every_message_as_we_do(self):
        golden = json.loads(GOLDEN.read_text(encoding="ascii"))["frames"]
        text = ""
        for at, (frame, _, _) in enumerate(golden):
            identifier, data = frame.split("#")
            text += line(at, int(identifier, 16), bytes.fromhex(data))
        log = self.decoded(text)

        compared = set()
        for message in MESSAGES:
            ours = log[message.dbc_name]
            for at, index in enumerate(ours.index):
                _, values, names = golden[index]
                self.assertEqual(ours.counter[at], values[1])
                for signal, theirs in zip(message.signals, values[2:]):
                    code = int(ours.codes[signal.dbc_name][at])
                    if code != signal.not_available or signal.is_whole:
                        # It clamps what the DBC's range forbids; we say so and show the value.
                        value = min(max(physical_value(signal, code), signal.low), signal.high)
                        self.assert_same(value, theirs, (signal.dbc_name, index))
                    self.assertEqual(signal.values.get(code, ""), names.get(signal.dbc_name, ""))
                    compared.add(signal.dbc_name)
        self.assertEqual(compared, {s.dbc_name for m in MESSAGES for s in m.signals})
        self.assertGreater(len(golden), 800)


class PythonCan(OracleFolder):
    """python-can reads what we write, and we read what it writes."""

    def messages(self, frames):
        return [
            can.Message(
                timestamp=(BEGIN_US + each.time_us) / 1e6,
                arbitration_id=each.message.id,
                data=each.data,
                is_extended_id=False,
                channel="vcan0",
            )
            for each in frames
        ]

    def test_reads_our_candump_lines(self):
        frames = flight(1.0)
        self.file.write_text(candump(frames), encoding="ascii")

        with can.LogReader(str(self.file)) as reader:
            found = list(reader)

        self.assertEqual(len(found), len(frames))
        for ours, theirs in zip(frames, found):
            self.assertEqual((ours.message.id, ours.data), (theirs.arbitration_id, theirs.data))
            self.assertEqual(BEGIN_US + ours.time_us, round(theirs.timestamp * 1e6))
            self.assertEqual((theirs.channel, theirs.is_extended_id), ("vcan0", False))

    def test_its_logs_of_three_formats_decode_as_ours(self):
        frames = flight(1.0)
        expected = self.decoded(candump(frames))
        for name, writer in (
            ("its.log", can.CanutilsLogWriter),
            ("its.asc", can.ASCWriter),
            ("its.blf", can.BLFWriter),
        ):
            with self.subTest(name):
                path = self.folder / name
                channel = {} if name == "its.log" else {"channel": 1}
                with writer(str(path), **channel) as log:
                    for message in self.messages(frames):
                        message.channel = "vcan0" if name == "its.log" else 0
                        log.on_message_received(message)

                found = decode(read_log(path), Protocol())

                self.assertEqual(found.frames.count, len(frames))
                for message in MESSAGES:
                    ours, theirs = expected[message.dbc_name], found[message.dbc_name]
                    self.assertTrue((theirs.check == GOOD).all())
                    for signal in message.signals:
                        codes = theirs.codes[signal.dbc_name]
                        self.assertTrue((codes == ours.codes[signal.dbc_name]).all())
                    difference = np.diff(theirs.time_ns) - np.diff(ours.time_ns)
                    self.assertLess(np.abs(difference).max(initial=0), 2000)


class Checksum(OracleFolder):
    def test_has_the_published_check_value(self):
        self.assertEqual(crc8(b"123456789"), 0xDF)

    def test_of_many_frames_is_that_of_each(self):
        corners = list(corner_frames(MESSAGES, 20, seed=3))
        for message in MESSAGES:
            words = [each.data for each in corners if each.message is message]
            found = crc8_of(np.frombuffer(b"".join(words), "<u8"), message.data_id)
            self.assertEqual(found.tolist(), [data[0] for data in words])

    def test_corners_are_judged_by_the_range_of_each_signal(self):
        corners = list(corner_frames(MESSAGES, RANDOM_FRAMES))
        log = self.decoded(
            "".join(line(at, each.message.id, each.data) for at, each in enumerate(corners))
        )
        forbidden = 0
        for message in MESSAGES:
            ours = log[message.dbc_name]
            for at, index in enumerate(ours.index):
                corner = corners[index]
                self.assertEqual(ours.check[at], GOOD if corner.is_legal else CODE)
                forbidden += not corner.is_legal
                for signal, raw in zip(message.signals, corner.raws):
                    value = ours.physical(signal.dbc_name)[at]
                    np.testing.assert_equal(value, physical_value(signal, raw))
        self.assertGreater(forbidden, 3)

    def test_whatever_a_signal_says_is_legal_is_available(self):
        for message in MESSAGES:
            for signal in message.signals:
                low, high = signal.raw_range
                self.assertTrue(is_legal(signal, low) and is_legal(signal, high))
                self.assertTrue(signal.is_whole or not low <= signal.not_available <= high)


class Generator(unittest.TestCase):
    """generate.py, on what it does not write at build time."""

    def test_wrong_use_and_a_bad_dbc_are_told_apart(self):
        generator = ROOT / "firmware_bridge" / "can" / "generate.py"
        for words, status in (
            (["wireshark"], 2),
            (["nonsense", str(DBC)], 2),
            (["wireshark", "/nowhere.dbc", "x"], 1),
            (["wireshark", str(DBC), "/proc/x"], 1),
        ):
            with self.subTest(words):
                outcome = subprocess.run(
                    ["/usr/bin/python3", "-B", str(generator), *words],
                    capture_output=True,
                    encoding="utf-8",
                    timeout=60,
                    check=False,
                )

                self.assertEqual((outcome.returncode, outcome.stdout), (status, ""))
                self.assertNotIn("Traceback", outcome.stderr)


if __name__ == "__main__":
    unittest.main()
