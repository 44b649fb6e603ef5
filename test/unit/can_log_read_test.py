#!/usr/bin/python3
# Copyright 2026 the Understory authors
# SPDX-License-Identifier: BSD-3-Clause
"""`understory log`: reading logs, whole and broken, of our protocol and of others."""

import gzip
import pathlib
import sys
import tempfile
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "support"))
from can_flight import BEGIN_US, candump, flight  # noqa: E402
import frame_log  # noqa: E402
from decode import LENGTH, Protocol, decode, other_kinds  # noqa: E402
from frame_log import ERROR, EXTENDED, FD, REMOTE, LogError, read_log  # noqa: E402

GOOD_LINE = "(1700000000.000001) vcan0 104#5A0300000000FF1F\n"


class LogFile(unittest.TestCase):
    def setUp(self):
        keeper = tempfile.TemporaryDirectory()
        self.addCleanup(keeper.cleanup)
        self.folder = pathlib.Path(keeper.name)
        self.file = self.folder / "flight.log"

    def read(self, text, **options):
        self.file.write_bytes(text.encode("latin-1"))
        return read_log(self.file, **options)

    def assert_refused(self, text, message, **options):
        with self.assertRaises(LogError) as caught:
            self.read(text, **options)
        self.assertEqual(len(str(caught.exception).splitlines()), 1)
        self.assertTrue(str(caught.exception).startswith(str(self.file)), caught.exception)
        self.assertIn(message, str(caught.exception))


class Candump(LogFile):
    """candump's own format, with all it may hold."""

    def test_every_frame_is_read_with_its_stamp_and_bytes(self):
        frames = flight(1.0)

        found = self.read(candump(frames))

        self.assertEqual(found.count, len(frames))
        self.assertEqual(found.notes, [])
        self.assertEqual(found.interfaces, ("vcan0",))
        stamps_ns = [1000 * (BEGIN_US + each.time_us) for each in frames]
        self.assertEqual(found.time_ns.tolist(), stamps_ns)
        self.assertEqual(found.identifier.tolist(), [each.message.id for each in frames])
        words = [int.from_bytes(each.data, "little") for each in frames]
        self.assertEqual(found.data.tolist(), words)

    def test_chunks_of_any_size_give_the_same_frames(self):
        text = candump(flight(0.2))
        expected = self.read(text)
        usual = frame_log.CHUNK_BYTES
        self.addCleanup(setattr, frame_log, "CHUNK_BYTES", usual)
        for size in (1, 46, 47, 48, 1000):
            frame_log.CHUNK_BYTES = size

            found = self.read(text)

            self.assertEqual(found.data.tolist(), expected.data.tolist(), size)
            self.assertEqual(found.time_ns.tolist(), expected.time_ns.tolist(), size)

    def test_other_kinds_of_frames_are_read_and_marked(self):
        for text, identifier, flags, length, data in (
            ("123#R", 0x123, REMOTE, 0, 0),
            ("123#R8", 0x123, REMOTE, 8, 0),
            ("12345678#01", 0x12345678, EXTENDED, 1, 1),
            ("20000004#0000000000000000", 4, ERROR, 8, 0),
            ("104#", 0x104, 0, 0, 0),
            ("104#0102", 0x104, 0, 2, 0x0201),
            ("104#0102030405060708_E", 0x104, 0, 8, 0x0807060504030201),
            ("104##1" + "02" * 12, 0x104, FD, 12, 0x0202020202020202),
            ("7ff#ab", 0x7FF, 0, 1, 0xAB),
        ):
            with self.subTest(text):
                found = self.read(GOOD_LINE + f"(1700000000.000002) vcan0 {text}\n")

                self.assertEqual(found.count, 2)
                columns = (found.identifier, found.flags, found.length, found.data)
                self.assertEqual([int(c[1]) for c in columns], [identifier, flags, length, data])

    def test_directions_padding_blank_lines_and_carriage_returns_do_not_matter(self):
        for text in (
            GOOD_LINE.replace("\n", " R\n"),
            GOOD_LINE.replace("\n", " T\n"),
            GOOD_LINE.replace("\n", "\r\n"),
            GOOD_LINE.replace(" vcan0", "    vcan0"),
            "\n" + GOOD_LINE + "  \n",
        ):
            with self.subTest(text):
                self.assertEqual(self.read(text).count, 1)

    def test_stamps_may_have_nine_digits(self):
        found = self.read(GOOD_LINE.replace(".000001", ".000000123"))

        self.assertEqual(found.time_ns.tolist(), [1_700_000_000_000_000_123])

    def test_a_compressed_log_is_read_too(self):
        text = candump(flight(0.1))
        path = self.folder / "flight.log.gz"
        path.write_bytes(gzip.compress(text.encode()))

        self.assertEqual(read_log(path).count, text.count("\n"))
        path.write_bytes(path.read_bytes()[:200])
        with self.assertRaises(LogError):
            read_log(path)
        path.write_bytes(b"no gzip")
        with self.assertRaises(LogError):
            read_log(path)

    def test_time_that_goes_back_is_noted(self):
        found = self.read(GOOD_LINE.replace(".000001", ".000002") + GOOD_LINE)

        self.assertEqual(len(found.notes), 1)
        self.assertIn("goes back 1 times", found.notes[0])


class Broken(LogFile):
    """What is left out with a note, and what is refused in one line."""

    def test_a_last_line_cut_off_is_left_out_and_noted(self):
        text = GOOD_LINE * 3
        for cut in range(1, len(GOOD_LINE)):  # also only the newline: digits may be missing
            with self.subTest(cut):
                found = self.read(text[:-cut])

                self.assertEqual(found.count, 2)
                self.assertEqual(len(found.notes), 1)
                self.assertIn(f"{self.file}:3: the last line was cut off", found.notes[0])

    def test_zeros_at_the_end_after_a_power_cut_are_a_line_cut_off(self):
        found = self.read(GOOD_LINE + "\0" * 5000)

        self.assertEqual((found.count, len(found.notes)), (1, 1))

    def test_an_empty_log_and_one_of_half_a_line_have_no_frames(self):
        for text in ("", "\n\n", GOOD_LINE[:30]):
            self.assert_refused(text, "no frames")

    def test_a_line_of_something_else_is_refused_with_its_number(self):
        for bad in (
            "hello\n",
            "(1700000000.000001)  vcan0  104   [8]  5A 03 00 00 00 00 FF 1F\n",  # candump -ta
            "1700000000.000001 vcan0 104#5A\n",
            "(1700000000.000001) vcan0 104#5A0\n",
            "(1700000000.000001) vcan0 104#5G\n",
            "(1700000000.000001) vcan0 104#5A0300000000FF1F00\n",
            "(1700000000.000001) vcan0 904#5A\n",
            "(1700000000.000001) vcan0 1045#5A\n",
            "(1700000000) vcan0 104#5A\n",
            "(x.y) vcan0 104#5A\n",
            "(1700000000.000001) vcan0 104#5Z0300000000FF1F\n",
            "\xff\xfe\x00\n",
        ):
            with self.subTest(bad):
                self.assert_refused(GOOD_LINE * 2 + bad + GOOD_LINE, f"{self.file}:3: not a line")
                self.assert_refused(bad, f"{self.file}:1: not a line")

    def test_a_file_without_any_newline_is_refused(self):
        self.assert_refused("\x7fELF" + "x" * 100, f"{self.file}:1: not a line")

    def test_a_file_that_cannot_be_opened_is_refused_by_name(self):
        for path in (self.folder, self.folder / "none.log", self.folder / "none.blf"):
            with self.assertRaises(LogError) as caught:
                read_log(path)
            self.assertIn(str(path), str(caught.exception))

    def test_an_asc_or_blf_file_that_is_none_is_refused_by_name(self):
        for name in ("a.asc", "a.blf"):
            path = self.folder / name
            for content in (b"", b"nonsense\n", bytes(range(256)) * 10):
                path.write_bytes(content)
                with self.assertRaises(LogError) as caught:
                    read_log(path)
                self.assertIn(str(path), str(caught.exception))
                self.assertEqual(len(str(caught.exception).splitlines()), 1)


class Interfaces(LogFile):
    def test_one_of_several_interfaces_must_be_named(self):
        text = GOOD_LINE * 2 + GOOD_LINE.replace("vcan0", "can1")

        self.assert_refused(text, "vcan0 (2), can1 (1)")
        self.assert_refused(text, "no frames of can7", interface="can7")
        self.assertEqual(self.read(text, interface="can1").count, 1)
        self.assertEqual(self.read(text, interface="vcan0").count, 2)


class Decoding(LogFile):
    """Which frames are ours."""

    def test_frames_of_no_message_are_counted_by_kind(self):
        others = ("123#00", "12345678#00", "00000104#00", "20000004#00", "104##100", "7FF#R")
        text = "".join(f"(1700000000.000002) vcan0 {each}\n" for each in others)

        log = decode(self.read(GOOD_LINE + text), Protocol())

        self.assertEqual(
            other_kinds(log),
            {"error frames": 1, "CAN FD": 1, "extended": 2, "unknown identifiers": 2},
        )
        self.assertEqual(log["SP_COMMIT"].count, 1)

    def test_our_identifier_with_another_length_or_as_a_request_is_a_bad_frame(self):
        text = "".join(f"(1700000000.000002) vcan0 104#{each}\n" for each in ("R8", "", "0102"))

        log = decode(self.read(text), Protocol())

        self.assertEqual(log["SP_COMMIT"].check.tolist(), [LENGTH] * 3)
        self.assertFalse(log.is_other.any())


if __name__ == "__main__":
    unittest.main()
