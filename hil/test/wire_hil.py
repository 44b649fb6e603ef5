# Copyright 2026 the Understory authors
# SPDX-License-Identifier: BSD-3-Clause
"""A bus that behaves like a wire: its speed, its queue, faults on it."""

import errno
import statistics
import time
import unittest

from can_tools import BUS, Frame, Port, link, must_run

HIL_OPTIONS = ["--wire"]
FRAME_TIME_S = 127e-6  # 8 bytes at 1 Mbit/s
QUEUE = 10  # frames


class AWire(unittest.TestCase):
    def test_takes_the_time_of_a_frame_for_a_frame(self):
        with Port() as sender, Port() as receiver:
            for number in range(QUEUE):
                sender.send(Frame(number, bytes(8)))
            stamps = [receiver.receive().stamp_s for _ in range(QUEUE)]
        gaps = [after - before for before, after in zip(stamps, stamps[1:])]

        # Late wake-ups make single gaps longer and the next ones shorter, never the whole shorter.
        self.assertGreater(sum(gaps), 0.95 * FRAME_TIME_S * len(gaps))
        self.assertLess(statistics.median(gaps), 4 * FRAME_TIME_S)

    def replace_qdisc(self, words):
        before = f"dev {BUS} root netem rate 1mbit limit {QUEUE}".split()
        must_run("tc", "qdisc", "replace", "dev", BUS, "root", "netem", *words.split())
        self.addCleanup(must_run, "tc", "qdisc", "replace", *before)

    def test_refuses_frames_once_its_queue_is_full(self):
        self.assertIn(f"limit {QUEUE} rate 1Mbit", must_run("tc", "qdisc", "show", "dev", BUS))
        self.replace_qdisc(f"limit {QUEUE} rate 100kbit")  # we may not be as fast as a wire

        with Port() as sender, self.assertRaises(OSError) as caught:
            for _ in range(50 * QUEUE):
                sender.send(Frame(0x100, bytes(8)))

        self.assertEqual(caught.exception.errno, errno.ENOBUFS)

    def test_confirms_a_frame_only_when_it_was_sent(self):
        self.replace_qdisc(f"delay 100ms limit {QUEUE}")
        with Port(own_frames=True) as port:
            began = time.monotonic()
            port.send(Frame(0x100, b"\x01"))
            frame = port.receive()

        self.assertTrue(frame.is_own)
        self.assertGreater(time.monotonic() - began, 0.09)

    def test_says_that_it_echoes(self):
        self.assertIn("ECHO", link(BUS)["flags"])


class FaultsOnAWire(unittest.TestCase):
    def filter(self, action):
        must_run("tc", "qdisc", "add", "dev", BUS, "clsact")
        self.addCleanup(must_run, "tc", "qdisc", "del", "dev", BUS, "clsact")
        words = f"dev {BUS} ingress protocol can basic match canid(sff 0x104) {action}"
        must_run("tc", "filter", "add", *words.split())

    def test_can_be_the_loss_of_one_identifier(self):
        self.filter("action drop")
        with Port() as sender, Port() as receiver:
            sender.send(Frame(0x104, b""))
            sender.send(Frame(0x105, b""))

            self.assertEqual(receiver.receive().id, 0x105)

    def test_can_be_a_wrong_byte_in_one_identifier(self):
        # Eight bytes of the frame precede its data.
        self.filter("action pedit munge offset 8 u8 invert")
        with Port() as sender, Port() as receiver:
            for number in (0x104, 0x105):
                sender.send(Frame(number, b"\x0f\x01"))
            found = [str(receiver.receive()) for _ in range(2)]

        self.assertEqual(found, ["104#F001", "105#0F01"])


if __name__ == "__main__":
    unittest.main()
