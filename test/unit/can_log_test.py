#!/usr/bin/python3
# Copyright 2026 the Understory authors
# SPDX-License-Identifier: BSD-3-Clause
"""`understory log`: what it finds in made-up flights, against what was put there."""

import dataclasses
import json
import pathlib
import random
import sys
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "support"))
from can_flight import BY_NAME, Sent, candump, flight, line  # noqa: E402
import bus_load  # noqa: E402
from can_logs import PROTOCOL, FlightTest, drop, number_of  # noqa: E402
from sets import ODOMETRY, SETPOINT, WINDOW_NS, sets_of  # noqa: E402
from states import flag_spans, host_spans, vehicle_spans  # noqa: E402
from streams import stream_of  # noqa: E402
from summary import page, summary_of  # noqa: E402


class Streams(FlightTest):
    def test_a_good_flight_has_no_errors(self):
        summary = self.summary(flight())

        self.assertEqual(summary["errors"], [])
        self.assertEqual(summary["notes"], [])
        self.assertEqual(summary["not_seen"], ["KILL", "ESC_CMD"])
        self.assertEqual(summary["messages"]["SP_VEL"]["count"], 300)
        self.assertAlmostEqual(summary["messages"]["SP_VEL"]["rate_hz"], 100, delta=0.1)
        self.assertAlmostEqual(summary["messages"]["VEH_STATE"]["p50_ms"], 20, delta=0.01)
        self.assertAlmostEqual(summary["duration_s"], 2.996, delta=0.001)

    def test_up_to_two_lost_frames_in_a_row_are_counted_and_more_are_a_jump(self):
        for which, lost, jumps in (([5], 1, 0), ([5, 6], 2, 0), ([5, 6, 7], 0, 1), ([5, 9], 2, 0)):
            with self.subTest(which):
                stream = stream_of(self.log(drop(flight(), "ODO_VEL", which))["ODO_VEL"])

                self.assertEqual((stream.lost, stream.jumps), (lost, jumps))
                self.assertEqual(stream.gaps, int(which in ([5, 6], [5, 6, 7])))
                longest_ms = 10.0 * (2 if which in ([5], [5, 9]) else len(which) + 1)
                self.assertAlmostEqual(stream.max_ms, longest_ms, delta=0.2)

    def test_lost_at_the_counters_wrap_is_lost_as_well(self):
        stream = stream_of(self.log(drop(flight(), "ODO_VEL", [15, 31, 32]))["ODO_VEL"])

        self.assertEqual((stream.lost, stream.jumps, stream.repeated), (3, 0, 0))

    def test_a_repeated_frame_is_counted_and_has_no_part_in_periods(self):
        frames = flight()
        for at in number_of(frames, "SP_VEL")[100:20:-10]:
            again = dataclasses.replace(frames[at], time_us=frames[at].time_us + 30)
            frames.insert(at + 1, again)

        stream = stream_of(self.log(frames)["SP_VEL"])

        self.assertEqual((stream.count, stream.repeated, stream.lost), (308, 8, 0))
        self.assertGreater(stream.jitter_ms, 0)
        self.assertLess(stream.jitter_ms, 1)

    def test_bad_frames_are_counted_by_what_is_wrong_with_them(self):
        lines = candump(flight()).splitlines(True)
        esc = BY_NAME["ESC_CMD"]
        bad_code = Sent(0, esc, 0, {"EscCmd0": 4001})
        texts = [at for at, each in enumerate(lines) if " 102#" in each]
        last_byte = lines[texts[3]][-3:-1]
        lines[texts[3]] = lines[texts[3]][:-3] + ("00\n" if last_byte != "00" else "01\n")
        lines[texts[8]] = lines[texts[8]][:-3] + "\n"
        lines.append(line(2_999_000, esc.id, bad_code.data))

        log = self.log_of_text("".join(lines))
        stream = stream_of(log["SP_VEL"])

        self.assertEqual((stream.checksum, stream.length, stream.code), (1, 1, 0))
        self.assertEqual(stream.lost, 2)
        self.assertEqual(stream_of(log["ESC_CMD"]).code, 1)
        errors = "\n".join(summary_of(log, 1_000_000)["errors"])
        self.assertIn("SP_VEL: 1 frames with a wrong checksum", errors)
        self.assertIn("SP_VEL: 1 frames that are not 8 bytes", errors)
        self.assertIn("ESC_CMD: 1 frames with a forbidden code", errors)
        self.assertIn("setpoint: 2 sets torn", errors)

    def test_known_stamps_give_known_statistics(self):
        message = BY_NAME["VEH_HB"]
        stamps_us = [0, 100_000, 200_000, 300_000, 800_000, 900_000]
        frames = [Sent(at_us, message, n, {}) for n, at_us in enumerate(stamps_us)]

        stream = stream_of(self.log(frames)["VEH_HB"])

        self.assertAlmostEqual(stream.rate_hz, 5 / 0.9)
        found = (stream.p50_ms, stream.p99_ms, stream.max_ms, stream.jitter_ms, stream.gaps)
        self.assertEqual(found, (100.0, 500.0, 500.0, 400.0, 1))

    def test_a_single_frame_has_no_rate(self):
        summary = self.summary(flight()[:1])

        self.assertIsNone(summary["messages"]["SP_POS_XY"]["rate_hz"])
        self.assertIsNone(summary["load"]["mean"])
        self.assertIn("mean -", page("x", summary))


class Sets(FlightTest):
    def test_a_set_without_one_of_its_frames_is_torn(self):
        for name in SETPOINT:
            with self.subTest(name):
                log = self.log(drop(flight(), name, [10, 50, 51]))

                found = sets_of(log, SETPOINT)
                self.assertEqual((found.complete, found.torn), (297, 3))
                seconds = [round(float(log.seconds(at)), 2) for at in found.torn_ns]
                self.assertEqual(seconds, [0.1, 0.5, 0.51])
                self.assertEqual(sets_of(log, ODOMETRY).torn, 0)

    def test_order_within_a_set_does_not_matter(self):
        frames = flight()
        rng = random.Random(3)
        for tick in range(300):
            at = [i for i in range(len(frames)) if frames[i].time_us // 10_000 == tick]
            at = [i for i in at if frames[i].name in SETPOINT]
            times_us = [frames[i].time_us for i in at]
            rng.shuffle(times_us)
            for i, time_us in zip(at, times_us):
                frames[i].time_us = time_us
        frames.sort(key=lambda frame: frame.time_us)

        self.assertEqual(sets_of(self.log(frames), SETPOINT).complete, 300)

    def test_a_set_that_takes_too_long_is_torn(self):
        parts = [Sent(1000 * at, BY_NAME[name], 0, {}) for at, name in enumerate(SETPOINT)]
        filler = [Sent(-100_000, BY_NAME["VEH_HB"], 0, {}), Sent(90_000, BY_NAME["VEH_HB"], 1, {})]
        for last_us, complete in ((WINDOW_NS // 1000, 1), (WINDOW_NS // 1000 + 1, 0)):
            parts[-1].time_us = last_us
            found = sets_of(self.log([filler[0], *parts, filler[1]]), SETPOINT)
            self.assertEqual((found.complete, found.torn), (complete, 1 - complete))

    def test_what_lags_behind_a_newer_set_is_ignored(self):
        names = [*SETPOINT[:4], *SETPOINT, SETPOINT[4], *SETPOINT]
        counters = [3] * 4 + [4] * 5 + [3] + [5] * 5
        frames = [Sent(-90_000, BY_NAME["VEH_HB"], 0, {})]
        rows = enumerate(zip(names, counters))
        frames += [Sent(100 * at, BY_NAME[name], counter, {}) for at, (name, counter) in rows]

        found = sets_of(self.log(frames), SETPOINT)

        self.assertEqual((found.complete, found.torn), (2, 1))

    def test_sets_at_the_logs_ends_are_not_torn(self):
        frames = flight()
        begin, end = number_of(frames, "SP_VEL")[7], number_of(frames, "SP_VEL")[200]

        found = sets_of(self.log(frames[begin:end]), SETPOINT)

        self.assertEqual((found.complete, found.torn), (192, 0))


class Load(FlightTest):
    """The wire time of frames, against a bit-by-bit encoder without NumPy."""

    @staticmethod
    def bits_on_the_wire(identifier, data, extended=False, remote=False):
        if extended:
            text = f"0{identifier >> 18:011b}11{identifier & 0x3FFFF:018b}{remote:b}00"
        else:
            text = f"0{identifier:011b}{remote:b}00"
        text += f"{len(data):04b}"
        text += "".join(f"{byte:08b}" for byte in data) if not remote else ""
        crc = 0
        for bit in text:
            crc = (crc << 1) ^ (0x4599 if (crc >> 14) ^ int(bit) else 0)
            crc &= 0x7FFF
        text += f"{crc:015b}"
        stuffed = ""
        for bit in text:
            stuffed += bit
            if stuffed[-5:] in ("00000", "11111") and len(stuffed) >= 5:
                stuffed += "1" if bit == "0" else "0"
        return len(stuffed) + 13

    def test_every_frame_is_as_long_as_bit_by_bit(self):
        rng = random.Random(5)
        rows = [(0x000, b"\0" * 8), (0x7FF, b"\xff" * 8), (0x104, b""), (0x078, b"\x3c" * 8)]
        for _ in range(400):
            levels = rng.choice([b"\0\xff", b"\x0f\x83\xf8", bytes(range(256))])
            data = bytes(rng.choice(levels) for _ in range(rng.randrange(9)))
            rows.append((rng.randrange(2048), data))
        text = "".join(line(at, *row) for at, row in enumerate(rows))
        expected = [self.bits_on_the_wire(*row) for row in rows]
        for _ in range(50):
            identifier = rng.randrange(1 << 29)
            data = bytes(rng.choice(b"\0\xff") for _ in range(8))
            text += f"(1700000001.000000) vcan0 {identifier:08X}#{data.hex().upper()}\n"
            expected.append(self.bits_on_the_wire(identifier, data, extended=True))
        text += "(1700000001.000000) vcan0 104#R\n(1700000001.000000) vcan0 20000004#00\n"
        expected += [self.bits_on_the_wire(0x104, b"", remote=True), 0]

        found = bus_load.frame_bits(self.log_of_text(text).frames)

        self.assertEqual(found.tolist(), expected)
        self.assertLessEqual(max(expected[: len(rows)]), 135)  # the bound of the literature

    def test_mean_and_peak_follow_from_the_stamps(self):
        one = bus_load.frame_bits(self.log_of_text(line(0, 0x555, b"\x55" * 8)).frames)[0]
        quiet = [line(100_000 * at, 0x555, b"\x55" * 8) for at in range(11)]
        burst = [line(450_000 + at * 200, 0x555, b"\x55" * 8) for at in range(100)]
        text = "".join(sorted(quiet + burst))

        summary = summary_of(self.log_of_text(text), 500_000)

        self.assertAlmostEqual(summary["load"]["mean"], 110 * one / 500_000)
        self.assertAlmostEqual(summary["load"]["peak"], 101 * one / 500_000 / 0.1)
        self.assertAlmostEqual(summary["load"]["peak_s"], 0.4698, delta=0.04)


class States(FlightTest):
    def test_states_and_flags_have_begin_end_and_reason(self):
        log = self.log(flight())

        found = [(span.state, span.reason, round(span.begin_s, 1)) for span in vehicle_spans(log)]
        self.assertEqual(
            found,
            [
                ("DISARMED", "POWER_ON", 0.0),
                ("ARMED", "NONE", 0.5),
                ("LAND", "HOST_REQUEST", 2.5),
                ("DISARMED", "LANDED", 2.8),
            ],
        )
        self.assertEqual([span.state for span in host_spans(log)], ["READY", "FLYING", "READY"])
        flags = flag_spans(log)
        self.assertEqual(len(flags["FlagOnGround"]), 2)
        self.assertEqual([round(each, 1) for each in flags["FlagOnGround"][0]], [0.0, 0.5])
        self.assertEqual(flags["FlagEscFailed"], [])

    def test_what_the_stations_complain_about_is_an_error(self):
        frames = flight()
        states = number_of(frames, "VEH_STATE")
        for at in states[:20]:
            frames[at].raws["FlagLate"] = 1  # not yet flying
        for at in states[60:65]:
            frames[at].raws["FlagEscFailed"] = 1
        for at in states[70:80]:
            frames[at].raws.update(State=4, StateReason=3, FlagLate=1)
        for at in states[-3:]:
            frames[at].raws.update(State=7, StateReason=8)
        links = number_of(frames, "VEH_LINK")
        for at, count in zip(links, (254, 255, 3)):  # it wraps
            frames[at].raws["VlTorn"] = count
        frames[number_of(frames, "SP_ACK")[100]].raws["AckResult"] = 2

        errors = self.summary(frames)["errors"]

        self.assertIn("vehicle: FlagEscFailed at 1.207 s", errors)
        self.assertIn("vehicle: FAULT (LINK_FAULT) at 2.947 s", errors)
        self.assertIn("vehicle: counted 5 torn sets (VlTorn)", errors)
        self.assertIn("SP_ACK: 1 STALE", errors)
        self.assertIn("vehicle: HOLD (SETPOINT_SILENCE) at 1.407 s", errors)
        self.assertIn("vehicle: FlagLate at 1.407 s", errors)
        self.assertEqual(len(errors), 6)

    def test_a_station_of_another_protocol_is_an_error(self):
        frames = flight()
        for at in number_of(frames, "VEH_HB"):
            frames[at].raws["VehDbcHash"] ^= 1

        errors = self.summary(frames)["errors"]

        self.assertEqual(len(errors), 1)
        self.assertIn("VEH_HB says protocol", errors[0])

    def test_codes_without_a_name_are_shown_as_numbers(self):
        frames = flight()
        for at in number_of(frames, "VEH_STATE")[:10]:
            frames[at].raws.update(State=14, StateReason=200)

        first = vehicle_spans(self.log(frames))[0]

        self.assertEqual((first.state, first.reason), ("code 14", "code 200"))


class Summary(FlightTest):
    def test_is_plain_json_without_nan(self):
        for frames in (flight(), flight()[:1], flight()[5:6]):
            text = json.dumps(self.summary(frames), allow_nan=False)
            self.assertEqual(json.loads(text)["protocol"]["hash"], PROTOCOL.hash)

    def test_a_page_of_many_changes_is_cut_and_says_so(self):
        frames = flight()
        for number, at in enumerate(number_of(frames, "VEH_STATE")):
            frames[at].raws["State"] = 1 + number % 2

        text = page("flight.log", self.summary(frames))

        self.assertIn("... and 110 more", text)
        self.assertLess(len(text.splitlines()), 130)

    def test_a_log_of_strangers_says_so_and_is_no_error(self):
        summary = summary_of(self.log_of_text(line(0, 0x123, b"\1") * 3), 1_000_000)

        self.assertEqual((summary["messages"], summary["errors"]), ({}, []))
        self.assertIn("3 unknown identifiers (identifiers 123)", page("x", summary))


if __name__ == "__main__":
    unittest.main()
