# Copyright 2026 the Understory authors
# SPDX-License-Identifier: BSD-3-Clause
"""What is kept of a mission's course for the figures: coverage and distance flown at whole seconds.

One small CSV file per mission, so that the mission's own folder need not be kept.
"""

import csv
from typing import NamedTuple

import numpy as np

HEADER = ["time_s", "coverage", "distance_m"]


class Series(NamedTuple):
    """At whole seconds from 0 to the end of the mission."""

    coverage: np.ndarray
    distance_m: np.ndarray


def sampled(ticks_path):
    """Of a mission's ticks.csv; an empty series if it has no whole row."""
    times, coverage, distance = [], [], [0.0]
    last = None
    with ticks_path.open(encoding="utf-8", newline="") as lines:
        for row in csv.DictReader(lines):
            if row["clearance_m"] is None:
                break  # cut short
            at = np.array([float(row[name]) for name in ("x_m", "y_m", "z_m")])
            distance.append(distance[-1] + (0.0 if last is None else np.linalg.norm(at - last)))
            last = at
            times.append(float(row["time_s"]))
            coverage.append(float(row["coverage"]) if row["coverage"] else np.nan)
    if not times:
        return Series(np.empty(0), np.empty(0))
    seconds = np.arange(0.0, np.floor(times[-1]) + 1.0)
    times, coverage = np.array(times), np.array(coverage)
    known = ~np.isnan(coverage)
    covered = np.interp(seconds, times[known], coverage[known]) if known.any() else 0.0 * seconds
    return Series(covered, np.interp(seconds, times, np.array(distance[1:])))


def sampled_of(folder):
    """Of a mission's result folder; of a team's: what the one knows who knows most, and how far they
    fly on average. None if there are no ticks."""
    if (folder / "ticks.csv").exists():
        return sampled(folder / "ticks.csv")
    courses = [sampled(path) for path in sorted(folder.glob("vehicle_*/ticks.csv"))]
    length = max((len(course.coverage) for course in courses), default=0)
    if length == 0:
        return None
    courses = [course for course in courses if len(course.coverage) > 0]

    def together(name):
        values = [getattr(course, name) for course in courses]
        return np.array([np.pad(one, (0, length - len(one)), mode="edge") for one in values])

    return Series(together("coverage").max(axis=0), together("distance_m").mean(axis=0))


def write(path, series):
    """Whole or not at all."""
    part = path.with_suffix(".part")
    with part.open("w", encoding="utf-8", newline="") as lines:
        writer = csv.writer(lines, lineterminator="\n")
        writer.writerow(HEADER)
        for second, (coverage, distance_m) in enumerate(zip(*series)):
            writer.writerow([second, f"{coverage:.5f}", f"{distance_m:.2f}"])
    part.replace(path)


def read(path):
    """None if there is no such file: the mission left no course."""
    if not path.exists():
        return None
    values = np.loadtxt(path, delimiter=",", skiprows=1, ndmin=2)
    if values.size == 0:
        return None
    return Series(values[:, 1], values[:, 2])
