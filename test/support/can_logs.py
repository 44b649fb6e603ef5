# Copyright 2026 the Understory authors
# SPDX-License-Identifier: BSD-3-Clause
"""Made-up flights as decoded logs, for the tests of `understory log`; and ways to spoil them."""

import pathlib
import tempfile
import unittest

from can_flight import candump, without
from decode import Protocol, decode
from frame_log import read_log
from summary import summary_of

PROTOCOL = Protocol()


class FlightTest(unittest.TestCase):
    def log_of_text(self, text):
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "flight.log"
            path.write_text(text, encoding="ascii")
            return decode(read_log(path), PROTOCOL)

    def log(self, frames):
        return self.log_of_text(candump(frames))

    def summary(self, frames):
        return summary_of(self.log(frames), 1_000_000)


def number_of(frames, name):
    """Positions of the frames of one message."""
    return [at for at, frame in enumerate(frames) if frame.name == name]


def drop(frames, name, which):
    """Without these of the message, counted from 0."""
    lost = {id(frames[number_of(frames, name)[at]]) for at in which}
    return without(frames, lambda frame: id(frame) in lost)
