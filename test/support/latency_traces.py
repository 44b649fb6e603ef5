# Copyright 2026 the Understory authors
# SPDX-License-Identifier: BSD-3-Clause
"""Traces for the tests of `understory latency`; where its modules are found."""

import pathlib
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
LATENCY = ROOT / "src" / "understory_nodelets" / "latency" / "latency.py"
sys.path.insert(0, str(LATENCY.parent))
from trace_file import read_trace  # noqa: E402

HEADER = "stage,exposure_ns,begin_ns,end_ns\n"
MS = 1_000_000
START_NS = 7_000_000 * MS  # the clock began at boot, not with the run
# Of one frame, in ms since its exposure. Waits: 1 for cloud, 0.5 for map, 0.25 for decision.
WHOLE_FRAME = {
    "camera": (0, 10),
    "cloud": (11, 13),
    "map": (13.5, 20),
    "decision": (20.25, 24),
    "trajectory": (20.25, 26),
    "setpoint": (26, 33),
    "transmit": (26, 29),
    "acknowledge": (29, 29.5),
}


def row(stage, exposure_ms, begin_ms, end_ms):
    """Times since START_NS; no exposure: the row belongs to no frame."""
    begin_ns, end_ns = (START_NS + round(MS * time_ms) for time_ms in (begin_ms, end_ms))
    exposure_ns = 0 if exposure_ms is None else START_NS + round(MS * exposure_ms)
    return f"{stage},{exposure_ns},{begin_ns},{end_ns}\n"


def frame(exposure_ms, stages=tuple(WHOLE_FRAME), **changes):
    """Rows of one frame; changes: other times of a stage, in ms since the exposure."""
    times = {stage: WHOLE_FRAME[stage] for stage in stages}
    times.update(changes)
    return "".join(
        row(stage, exposure_ms, exposure_ms + begin_ms, exposure_ms + end_ms)
        for stage, (begin_ms, end_ms) in times.items()
    )


def wakeups(lateness_ms):
    return "".join(
        row("wakeup", None, 10 * index, 10 * index + late_ms)
        for index, late_ms in enumerate(lateness_ms)
    )


class TraceFolder(unittest.TestCase):
    """A folder with a trace that is gone afterwards."""

    def setUp(self):
        keeper = tempfile.TemporaryDirectory()
        self.addCleanup(keeper.cleanup)
        self.folder = pathlib.Path(keeper.name)
        self.file = self.folder / "trace.csv"

    def trace(self, rows):
        self.file.write_text(HEADER + rows, encoding="ascii")
        return read_trace(self.file)

    def write(self, name, text):
        path = self.folder / name
        path.write_text(text, encoding="utf-8")
        return path
