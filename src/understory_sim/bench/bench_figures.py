# Copyright 2026 the Understory authors
# SPDX-License-Identifier: BSD-3-Clause
"""Figures of a table: what all missions of a kind have covered, and how fast they flew, over time.
Lines are means over the missions, bands reach one standard deviation to either side.
"""

import pathlib
import sys

import numpy as np
from matplotlib import pyplot

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "report"))
from look import BLUE, GREEN, ORANGE, PINK, STYLE  # noqa: E402

COLOURS = [BLUE, ORANGE, GREEN, PINK]
LINES = {"paper": "-", "strict": (0, (4, 2))}
SPEED_WINDOW_S = 30


def coverage_percent(series, length):
    """Who has finished has what it had at its end."""
    covered = 100.0 * series.coverage
    return np.concatenate([covered, np.full(length - len(covered), covered[-1])])


def speed_mps(series, length):
    """Over a window; nothing after the end."""
    ahead = np.minimum(np.arange(len(series.distance_m)) + SPEED_WINDOW_S // 2,
                       len(series.distance_m) - 1)
    behind = np.maximum(np.arange(len(series.distance_m)) - SPEED_WINDOW_S // 2, 0)
    passed = series.distance_m[ahead] - series.distance_m[behind]
    speed = passed / np.maximum(ahead - behind, 1)
    return np.concatenate([speed, np.full(length - len(speed), np.nan)])


def draw(groups, measure, unit):
    """groups: {(title, cap, strategy): [Series]}; one panel per title."""
    titles = list(dict.fromkeys(title for title, _, _ in groups))
    strategies = list(dict.fromkeys(strategy for _, _, strategy in groups))
    columns = min(2, len(titles))
    rows = -(-len(titles) // columns)
    with pyplot.rc_context(STYLE):
        figure, panels = pyplot.subplots(
            rows, columns, figsize=(5.2 * columns, 3.1 * rows), constrained_layout=True,
            squeeze=False, sharey=True,
        )
        for panel in panels.flat[len(titles):]:
            panel.set_visible(False)
        for (title, cap, strategy), missions in groups.items():
            panel = panels.flat[titles.index(title)]
            length = max(len(series.coverage) for series in missions)
            values = np.array([measure(series, length) for series in missions])
            counted = np.maximum(np.sum(~np.isnan(values), axis=0), 1)
            mean = np.nansum(values, axis=0) / counted
            deviation = np.sqrt(np.nansum((values - mean) ** 2, axis=0) / counted)
            colour = COLOURS[strategies.index(strategy) % len(COLOURS)]
            seconds = np.arange(length)
            panel.fill_between(seconds, mean - deviation, mean + deviation, color=colour,
                               alpha=0.12, linewidth=0)
            panel.plot(seconds, mean, color=colour, linestyle=LINES.get(cap, "-"), linewidth=1.6,
                       label=f"{strategy}, {cap} cap, n = {len(missions)}")
        for panel, title in zip(panels.flat, titles):
            panel.set_title(title)
            panel.set_xlabel("time, s")
            panel.set_ylabel(unit)
            panel.set_xlim(left=0)
            panel.set_ylim(bottom=0)
        panels.flat[0].legend(loc="lower right", fontsize=7)
    return figure


def write_figures(groups, folder):
    """Their paths."""
    written = []
    for name, measure, unit in (
        ("coverage", coverage_percent, "coverage, %"),
        ("speed", speed_mps, f"speed over {SPEED_WINDOW_S} s, m/s"),
    ):
        figure = draw(groups, measure, unit)
        written.append(folder / f"{name}.png")
        figure.savefig(written[-1], dpi=130)
        pyplot.close(figure)
    return written
