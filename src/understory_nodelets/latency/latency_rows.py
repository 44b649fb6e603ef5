# Copyright 2026 the Understory authors
# SPDX-License-Identifier: BSD-3-Clause
"""Durations of a trace and their statistics: stages, waits between them, and end to end.

    from latency_rows import statistics_of
    from trace_file import read_trace
    statistics_of(read_trace(Path("trace.csv")))["exposure_to_trajectory"].p99_ms

A frame for which a stage is missing has no part in the rows that need this stage.
"""

import csv
import io
from dataclasses import astuple, dataclass, fields
from typing import Dict, Optional, Tuple

import numpy as np

from trace_file import STAGES, Marks, Trace

PIPELINE = ("camera", "cloud", "map", "decision")  # in turn, with waits between
WAITS = tuple(f"{stage}_wait" for stage in PIPELINE[1:])
END_TO_END = (
    "exposure_to_map",
    "exposure_to_decision",
    "exposure_to_trajectory",
    "exposure_to_setpoint",
    "exposure_to_transmit",
    "exposure_to_acknowledge",
    "camera_to_trajectory",
)
KNOWN_ROWS = STAGES + WAITS + END_TO_END


@dataclass(frozen=True)
class Samples:
    """Durations of one row, and when each began."""

    begin_ns: np.ndarray
    duration_ns: np.ndarray  # of waits may be less than 0: the next began while this one ended

    @property
    def duration_ms(self) -> np.ndarray:
        return self.duration_ns / 1e6


@dataclass(frozen=True)
class Statistics:
    """Percentiles are of the nearest rank: durations that did occur."""

    count: int
    mean_ms: Optional[float] = None
    p50_ms: Optional[float] = None
    p90_ms: Optional[float] = None
    p99_ms: Optional[float] = None
    max_ms: Optional[float] = None


MEASURES = tuple(column.name for column in fields(Statistics) if column.name != "count")


def samples_of(trace: Trace) -> Dict[str, Samples]:
    """By row, in the order of the table: stages, waits, end to end; also those without samples."""
    rows = {
        stage: Samples(marks.begin_ns, marks.end_ns - marks.begin_ns)
        for stage, marks in trace.stages.items()
    }
    frames = {stage: trace.stages[stage].of_frames() for stage in STAGES}
    for before, after in zip(PIPELINE, PIPELINE[1:]):
        first, second = _of_same_frames(frames[before], frames[after])
        rows[f"{after}_wait"] = Samples(first.end_ns, second.begin_ns - first.end_ns)
    for name in END_TO_END[:-1]:
        last = frames[name[len("exposure_to_") :]]
        rows[name] = Samples(last.exposure_ns, last.end_ns - last.exposure_ns)
    first, last = _of_same_frames(frames["camera"], frames["trajectory"])
    rows["camera_to_trajectory"] = Samples(first.end_ns, last.end_ns - first.end_ns)
    return rows


def _of_same_frames(first: Marks, second: Marks) -> Tuple[Marks, Marks]:
    """What both have, in the same order."""
    _, of_first, of_second = np.intersect1d(
        first.exposure_ns, second.exposure_ns, assume_unique=True, return_indices=True
    )
    return _taken(first, of_first), _taken(second, of_second)


def _taken(marks: Marks, at: np.ndarray) -> Marks:
    return Marks(marks.exposure_ns[at], marks.begin_ns[at], marks.end_ns[at])


def nearest_rank(ascending: np.ndarray, percent: int) -> float:
    """The smallest value that so many percent of all do not exceed."""
    rank = -(-percent * len(ascending) // 100)  # rounded up, without a float that is just over
    return float(ascending[rank - 1])


def statistics_of(trace: Trace) -> Dict[str, Statistics]:
    """By row, in the order of the table."""
    return {name: _statistics(samples.duration_ms) for name, samples in samples_of(trace).items()}


def _statistics(duration_ms: np.ndarray) -> Statistics:
    if not len(duration_ms):
        return Statistics(0)
    ascending = np.sort(duration_ms)
    percentiles = (nearest_rank(ascending, percent) for percent in (50, 90, 99))
    return Statistics(len(ascending), float(ascending.mean()), *percentiles, float(ascending[-1]))


def dropped_frames(trace: Trace) -> Tuple[int, int]:
    """Frames with an image but no map, and all with an image."""
    images = trace.stages["camera"].of_frames().exposure_ns
    mapped = trace.stages["map"].of_frames().exposure_ns
    return len(np.setdiff1d(images, mapped, assume_unique=True)), len(images)


def csv_text(statistics: Dict[str, Statistics]) -> str:
    """Row by row; what a row without samples has no value for is empty."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(["stage", "count", *MEASURES])
    for name, row in statistics.items():
        count, *measures_ms = astuple(row)
        writer.writerow([name, count, *("" if ms is None else f"{ms:.6f}" for ms in measures_ms)])
    return text.getvalue()


def table_text(statistics: Dict[str, Statistics]) -> str:
    """For reading: in milliseconds, an empty line before the waits and before end to end."""
    shown = ("p50_ms", "p90_ms", "p99_ms", "max_ms")
    width = max(len(name) for name in statistics)
    titles = "".join(f"{column[:-3] + ' ms':>11}" for column in shown)
    lines = [f"{'stage':<{width}}{'count':>9}{titles}"]
    for name, row in statistics.items():
        if name in (WAITS[0], END_TO_END[0]):
            lines.append("")
        values_ms = [getattr(row, column) for column in shown]
        cells = "".join(f"{'-' if ms is None else format(ms, '.3f'):>11}" for ms in values_ms)
        lines.append(f"{name:<{width}}{row.count:>9}{cells}")
    return "\n".join(lines) + "\n"
