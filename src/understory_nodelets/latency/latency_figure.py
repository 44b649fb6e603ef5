# Copyright 2026 the Understory authors
# SPDX-License-Identifier: BSD-3-Clause
"""The picture of a trace: how long every row takes, and the way to the product over the mission."""

import sys
from pathlib import Path
from typing import Dict, List, Tuple

import numpy as np

# The look of all our figures; beside us in the sources as where catkin installs packages.
sys.path.append(str(Path(__file__).resolve().parents[2] / "understory_sim" / "report"))
from look import BLUE, GREEN, GRID, INK, MUTED, ORANGE, RED, STYLE  # noqa: E402
from matplotlib import pyplot  # noqa: E402
from matplotlib.figure import Figure  # noqa: E402
from matplotlib.lines import Line2D  # noqa: E402
from matplotlib.ticker import FormatStrFormatter, LogLocator, NullFormatter  # noqa: E402

from budget_file import Budget  # noqa: E402
from latency_rows import (  # noqa: E402
    END_TO_END,
    PIPELINE,
    WAITS,
    Samples,
    Statistics,
    dropped_frames,
    nearest_rank,
    samples_of,
    statistics_of,
)
from trace_file import STAGES, Trace  # noqa: E402

LEAST_MS = 1e-3  # shorter ones, and waits below 0, are drawn here: the axis is logarithmic
WAIT_COLOUR = "#9aa1a9"
COLUMNS = (("p50_ms", "p50"), ("p99_ms", "p99"), ("max_ms", "max"))
COLUMN_IN = 0.62
ROW_IN = 0.30
WIDTH_IN, LEFT_IN, RIGHT_IN = 10.0, 1.75, 0.2
SPANS = 60  # over the mission
OVER_TIME = (("exposure_to_map", ORANGE), ("exposure_to_trajectory", GREEN))


def draw_latency(trace: Trace, budget: Budget) -> Figure:
    samples = samples_of(trace)
    statistics = {name: row for name, row in statistics_of(trace).items() if row.count}
    groups = groups_of(list(statistics))
    bars_in = ROW_IN * (sum(len(group) for group in groups) + 0.6 * len(groups) + 0.8)
    over_time_in = 2.8 if any(name in statistics for name, _ in OVER_TIME) else 0.4
    foot_in, between_in, head_in = 0.6, 1.15, 0.75
    height_in = foot_in + over_time_in + between_in + bars_in + head_in
    # Placed by hand: the columns of figures beside the bars are no part of an automatic layout.
    width = (WIDTH_IN - LEFT_IN - RIGHT_IN) / WIDTH_IN
    beside = (len(COLUMNS) * COLUMN_IN + 0.15) / WIDTH_IN
    left = LEFT_IN / WIDTH_IN
    with pyplot.rc_context(STYLE):
        figure = pyplot.figure(figsize=(WIDTH_IN, height_in))
        bars_bottom = (foot_in + over_time_in + between_in) / height_in
        bars = figure.add_axes((left, bars_bottom, width - beside, bars_in / height_in))
        over_time = figure.add_axes((left, foot_in / height_in, width, over_time_in / height_in))
        _draw_bars(bars, groups, statistics, budget)
        dropped, images = dropped_frames(trace)
        bars.set_title(f"Latency: {images} frames, {dropped} without a map", pad=26)
        _draw_over_time(over_time, samples, trace.first_ns)
    return figure


def groups_of(names: List[str]) -> List[List[str]]:
    """From top to bottom: the way of a frame with its waits, what belongs to none, end to end."""
    way = [name for stage in PIPELINE for name in (f"{stage}_wait", stage)]
    way += ["trajectory", "setpoint", "transmit", "acknowledge"]
    others = [name for name in names if name not in STAGES + WAITS + END_TO_END]
    groups = [way + others, ["wakeup"], list(END_TO_END)]
    present = [[name for name in group if name in names] for group in groups]
    return [group for group in present if group]


def _draw_bars(
    axes, groups: List[List[str]], statistics: Dict[str, Statistics], budget: Budget
) -> None:
    heights, labels, height = [], [], 0.0
    for group in groups:
        for name in group:
            _draw_row(axes, height, name, statistics[name], budget.get(name, {}))
            heights.append(height)
            labels.append(name.replace("_", " "))
            height += 1.0
        height += 0.6
    axes.set_yticks(heights, labels)
    axes.tick_params(axis="y", length=0)
    axes.set_ylim(heights[-1] + 0.6, -0.8)
    axes.set_xscale("log")
    low_ms, high_ms = axes.get_xlim()
    if high_ms < 10 * low_ms:  # else there might be no power of ten to write on the axis
        axes.set_xlim(low_ms / 4, high_ms * 4)
    axes.xaxis.set_major_formatter(FormatStrFormatter("%g"))
    axes.xaxis.set_minor_formatter(NullFormatter())
    axes.grid(axis="y", visible=False)
    axes.spines["left"].set_visible(False)
    axes.set_xlabel("ms (logarithmic)")
    for column, (_, title) in enumerate(COLUMNS):
        _beside(axes, column, -0.95, f"{title} ms", MUTED)
    marks = [("o", 6.5, INK, "median"), ("|", 10, INK, "p90, p99"), ("x", 5.5, INK, "maximum")]
    if budget:
        marks.append(("d", 5, RED, "allowed"))
    axes.legend(
        handles=[
            Line2D([], [], linestyle="none", marker=m, markersize=s, color=c, label=label)
            for m, s, c, label in marks
        ],
        loc="lower right",
        bbox_to_anchor=(1.0, 1.0),
        ncols=4,
        borderaxespad=0.2,
        handletextpad=0.1,
        columnspacing=1.2,
    )


def _draw_row(axes, height: float, name: str, row: Statistics, limits: Dict[str, float]) -> None:
    colour = WAIT_COLOUR if name in WAITS else GREEN if name in END_TO_END else BLUE
    p50, p90, p99, largest = (
        max(value_ms, LEAST_MS) for value_ms in (row.p50_ms, row.p90_ms, row.p99_ms, row.max_ms)
    )
    bar = {"linewidth": 5, "solid_capstyle": "butt"}
    axes.plot([p50, largest], [height, height], color=GRID, zorder=1, **bar)
    axes.plot([p50, p99], [height, height], color=colour, alpha=0.35, zorder=2, **bar)
    axes.plot([p50, p90], [height, height], color=colour, alpha=0.45, zorder=2, **bar)
    axes.plot(p50, height, "o", color=colour, markersize=6.5, zorder=4)
    for value_ms in (p90, p99):
        axes.plot(value_ms, height, "|", color=colour, markersize=10, markeredgewidth=1.8, zorder=3)
    axes.plot(largest, height, "x", color=colour, markersize=5.5, zorder=3)
    for column, (measure, _) in enumerate(COLUMNS):
        value_ms = getattr(row, measure)
        is_over = value_ms > limits.get(measure, np.inf)
        _beside(axes, column, height, _short(value_ms), RED if is_over else INK)
    for measure, limit_ms in limits.items():
        at = (max(limit_ms, LEAST_MS), height)
        axes.plot(*at, "d", color=RED, markersize=5, zorder=5)
        axes.annotate(
            measure[:-3], at, xytext=(0, 4), textcoords="offset points", ha="center", va="bottom",
            color=RED, fontsize=7,
        )


def _beside(axes, column: int, height: float, text: str, colour: str) -> None:
    """Right of the bars, on the height of a row."""
    axes.annotate(
        text, (1.0, height), xycoords=axes.get_yaxis_transform(),
        xytext=(72 * (column + 1) * COLUMN_IN + 8, 0), textcoords="offset points",
        color=colour, fontsize=8.5, ha="right", va="center",
    )


def _short(value_ms: float) -> str:
    """Three digits that count, down to microseconds."""
    digits = sum(abs(value_ms) < limit for limit in (99.5, 9.95, 0.995))
    return f"{value_ms:.{digits}f}"


def _draw_over_time(axes, samples: Dict[str, Samples], first_ns: int) -> None:
    drawn = [(name, colour) for name, colour in OVER_TIME if len(samples[name].begin_ns)]
    axes.set_title("End to end over the mission", pad=10)
    axes.set_xlabel("time since the first mark, s")
    if not drawn:
        axes.set_axis_off()
        axes.text(0.0, 0.9, "No frame came to a map.", transform=axes.transAxes)
        return
    last_ns = max(int(samples[name].begin_ns.max()) for name, _ in drawn)
    span_s = max(5.0, (last_ns - first_ns) / 1e9 / SPANS)
    for name, colour in drawn:
        time_s = (samples[name].begin_ns - first_ns) / 1e9
        duration_ms = np.maximum(samples[name].duration_ms, LEAST_MS)
        middles_s, p50_ms, p99_ms, above = spans_of(time_s, duration_ms, span_s)
        label = name.replace("_", " ")
        axes.plot(middles_s, p50_ms, "o-", color=colour, linewidth=2, markersize=3, label=label)
        axes.fill_between(middles_s, p50_ms, p99_ms, color=colour, alpha=0.22, linewidth=0)
        axes.plot(time_s[above], duration_ms[above], ".", color=colour, markersize=3)
    axes.set_yscale("log")
    axes.yaxis.set_major_locator(LogLocator(subs=(1, 1.5, 2, 3, 4, 6)))
    axes.yaxis.set_major_formatter(FormatStrFormatter("%g"))
    axes.yaxis.set_minor_formatter(NullFormatter())
    axes.set_ylabel("ms (logarithmic)")
    axes.set_xlim(0.0, max((last_ns - first_ns) / 1e9, 1.0))
    axes.legend(
        loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=2, borderaxespad=0.2,
        title=f"line: median of {span_s:.0f} s, shaded: up to p99, dots: above it",
        title_fontsize=8.5,
    )


def spans_of(time_s: np.ndarray, values: np.ndarray, span_s: float) -> Tuple[np.ndarray, ...]:
    """Mean time, median and p99 of each span of time, and which values are above that p99.

    A last span with few samples is part of the one before.
    """
    span = (time_s // span_s).astype(int)
    last = int(span.max())
    if last > 0 and np.count_nonzero(span == last) < 0.5 * np.count_nonzero(span == last - 1):
        span[span == last] = last - 1
    rows, above = [], np.zeros(len(values), dtype=bool)
    for at in np.unique(span):
        inside = span == at
        ascending = np.sort(values[inside])
        p99 = nearest_rank(ascending, 99)
        rows.append((time_s[inside].mean(), nearest_rank(ascending, 50), p99))
        above |= inside & (values > p99)
    middles_s, p50, p99 = np.array(rows).T
    return middles_s, p50, p99, above
