# Copyright 2026 the Understory authors
# SPDX-License-Identifier: BSD-3-Clause
"""Reads trace.csv, the marks that the onboard pipeline leaves: when which stage worked on what.

    stage,exposure_ns,begin_ns,end_ns       integers, all of one steady clock, in any order

exposure_ns is when the depth frame was exposed that the product derives from: it names the frame.
It is 0 where a row belongs to no frame.

    camera      exposure -> image published: rendering, or the delay of the driver
    cloud       image received -> cloud published
    map         cloud received -> snapshot published
    decision    snapshot received -> decision done, of every frame
    trajectory  begin of its decision -> trajectory published, of those that led to one
    setpoint    trajectory published -> its first setpoint sent
    transmit    trajectory published -> the first setpoint sent in knowledge of it, on the CAN bus
    acknowledge that setpoint on the bus -> the vehicle's answer on the bus
    wakeup      thread of the setpoints: deadline -> woken; no frame

Other stages may occur and come after these. Whatever cannot be read raises TraceError with one
line that names file and line.
"""

import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import Dict, List

import numpy as np

STAGES = ("camera", "cloud", "map", "decision", "trajectory", "setpoint")
STAGES += ("transmit", "acknowledge", "wakeup")
HEADER = "stage,exposure_ns,begin_ns,end_ns"
# 18 digits are 31 years and fit 64 bits.
ROW = re.compile(r"([a-z][a-z0-9_]*),(\d{1,18}),(\d{1,18}),(\d{1,18})", re.ASCII)


class TraceError(Exception):
    """A trace that cannot be used; the message names the file."""


@dataclass(frozen=True)
class Marks:
    """The rows of one stage, by begin."""

    exposure_ns: np.ndarray
    begin_ns: np.ndarray
    end_ns: np.ndarray

    @property
    def count(self) -> int:
        return len(self.begin_ns)

    def of_frames(self) -> "Marks":
        """The first row of each frame, by exposure."""
        known = self.exposure_ns > 0
        exposure_ns, first = np.unique(self.exposure_ns[known], return_index=True)
        return Marks(exposure_ns, self.begin_ns[known][first], self.end_ns[known][first])


@dataclass(frozen=True)
class Trace:
    stages: Dict[str, Marks]  # every one of STAGES, with or without rows, then the others
    notes: List[str] = field(default_factory=list)  # what is odd or cut off

    @property
    def first_ns(self) -> int:
        return min(int(marks.begin_ns[0]) for marks in self.stages.values() if marks.count)


def read_trace(path: Path) -> Trace:
    lines = _read_text(path).split("\n")
    notes = []
    # The writer ends every row with a newline: what stands after the last one was cut off.
    if lines.pop():
        notes.append(f"{path}: the last line was cut off and is left out")
    if lines and lines[0] != HEADER:
        raise TraceError(f"{path}:1: expected {HEADER}, not {_quoted(lines[0])}")
    numbers: Dict[str, List[int]] = {}
    for line, text in enumerate(lines[1:], start=2):
        row = ROW.fullmatch(text)
        if row is None:
            raise TraceError(f"{path}:{line}: expected a row of {HEADER}, not {_quoted(text)}")
        stage, exposure_ns, begin_ns, end_ns = row.groups()
        numbers.setdefault(stage, []).extend((int(exposure_ns), int(begin_ns), int(end_ns)))
    if not numbers:
        raise TraceError(f"{path}: no marks in it")
    found = {stage: _marks(values) for stage, values in numbers.items()}
    others = sorted((found[stage].begin_ns[0], stage) for stage in found if stage not in STAGES)
    stages = {stage: found.get(stage) or _marks([]) for stage in STAGES}
    stages.update((stage, found[stage]) for _, stage in others)
    return Trace(stages, notes + _oddities(path, stages))


def _read_text(path: Path) -> str:
    try:
        return path.read_bytes().decode("ascii", errors="replace")
    except OSError as error:
        raise TraceError(f"{path}: {error.strerror}") from error


def _quoted(text: str) -> str:
    return ascii(text if len(text) <= 60 else text[:60] + "...")


def _marks(numbers: List[int]) -> Marks:
    columns = np.array(numbers, dtype=np.int64).reshape(-1, 3)
    columns = columns[np.argsort(columns[:, 1], kind="stable")]
    return Marks(columns[:, 0], columns[:, 1], columns[:, 2])


def _oddities(path: Path, stages: Dict[str, Marks]) -> List[str]:
    """Rows that are used but should not be there."""
    found = []
    for stage, marks in stages.items():
        backward = int(np.count_nonzero(marks.end_ns < marks.begin_ns))
        if backward:
            found.append(f"{path}: {stage}: {backward} rows end before they begin")
        # Of other stages, such as those of the bus, a frame may well have several.
        repeated = int(np.count_nonzero(marks.exposure_ns)) - marks.of_frames().count
        if repeated and stage in STAGES:
            found.append(
                f"{path}: {stage}: {repeated} rows are of a frame that has one already; "
                "waits and end to end take the first"
            )
    return found
