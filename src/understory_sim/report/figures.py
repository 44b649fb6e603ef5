# Copyright 2026 the Understory authors
# SPDX-License-Identifier: BSD-3-Clause
"""Figures of one mission. Each function draws one and returns it; all bear with a mission of no or
one tick.
"""

from typing import Dict, List, Tuple

import numpy as np
from matplotlib import pyplot
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import FormatStrFormatter

from look import BLUE, GREEN, GRID, MUTED, ORANGE, RED, SKY, STYLE
from look import mode_colours, mode_runs, or_empty, rolling_mean, time_axis
from path_figure import draw_path
from result_folder import ResultFolder


def all_figures(folder: ResultFolder) -> Dict[str, Figure]:
    """By file name without ending, in the order of the report."""
    with pyplot.rc_context(STYLE):
        return {
            "path": draw_path(folder),
            "coverage": draw_coverage(folder),
            "speed": draw_speed(folder),
            "modes": draw_modes(folder),
            "times": draw_times(folder),
        }


def mode_seconds(folder: ResultFolder) -> Dict[str, float]:
    """Time in each mode: a tick's mode lasts until the next tick."""
    modes = folder.ticks["mode"]
    spans_s = np.diff(folder.ticks["time_s"])
    return {mode: float(spans_s[modes[:-1] == mode].sum()) for mode in mode_colours(modes)}


def draw_coverage(folder: ResultFolder) -> Figure:
    figure, axes = pyplot.subplots(figsize=(9, 4.2), constrained_layout=True)
    time_s = folder.ticks["time_s"]
    percent = 100.0 * folder.ticks["coverage"]
    last_s = float(np.max(time_s, initial=0.0))
    axes.plot(time_s, percent, color=BLUE, linewidth=2)
    axes.fill_between(time_s, percent, color=BLUE, alpha=0.10, linewidth=0)
    for level in (50, 90, 95, 99):
        reached_s = folder.number(f"t{level}_s")
        if reached_s is None or reached_s > last_s + 1.0:  # ticks were cut off
            continue
        axes.plot([0, reached_s], [level, level], color=MUTED, linewidth=0.7, linestyle=(0, (2, 2)))
        axes.plot(reached_s, level, "o", color="white", markeredgecolor=BLUE, markersize=5)
        axes.annotate(
            f"t{level}  {reached_s:.0f} s",
            (reached_s, level),
            xytext=(-6, 1),  # above the level, where the curve cannot be
            textcoords="offset points",
            ha="right",
            va="bottom",
            fontsize=8.5,
        )
    completed_s = folder.number("completion_time_s")
    if completed_s is not None and completed_s <= last_s + 1.0:
        _mark_completion(axes, completed_s)
    time_axis(axes, folder)
    axes.set_ylim(0, 106)
    axes.set_ylabel("coverage, %")
    final = folder.number("coverage")
    axes.set_title("Coverage" if final is None else f"Coverage: {100 * final:.2f} % at the end")
    return or_empty(figure, axes, folder)


def draw_speed(folder: ResultFolder) -> Figure:
    figure, (axes, band) = pyplot.subplots(
        2,
        1,
        figsize=(9, 4.4),
        sharex=True,
        constrained_layout=True,
        gridspec_kw={"height_ratios": [12, 1]},
    )
    time_s, speed_mps = folder.ticks["time_s"], folder.ticks["speed_mps"]
    axes.plot(time_s, speed_mps, color=BLUE, alpha=0.35, linewidth=0.7, label="speed")
    axes.plot(
        time_s,
        rolling_mean(time_s, speed_mps, 10.0),
        color=BLUE,
        linewidth=1.8,
        label="mean over 10 s",
    )
    caps: Dict[float, List[str]] = {}
    for mode in ("explorer", "collector"):
        cap_mps = folder.number(f"{mode}_speed_mps")
        if cap_mps is not None:
            caps.setdefault(cap_mps, []).append(mode)
    for cap_mps, names in sorted(caps.items()):
        axes.axhline(cap_mps, color=RED, linewidth=1.0, linestyle=(0, (4, 3)))
        axes.annotate(
            f"{' and '.join(names)}: at most {cap_mps:g} m/s",
            (1.0, cap_mps),
            xycoords=("axes fraction", "data"),
            xytext=(-3, 3),
            textcoords="offset points",
            ha="right",
            color=RED,
            fontsize=8.5,
        )
    top_mps = max([*caps, float(np.max(speed_mps, initial=0.1))])
    axes.set_ylim(0, 1.14 * top_mps)
    axes.set_ylabel("speed, m/s")
    mean_mps = folder.number("speed_mean_mps")
    axes.set_title("Speed" if mean_mps is None else f"Speed: {mean_mps:.2f} m/s on average")
    axes.legend(loc="upper left", ncols=2, borderaxespad=0.2)
    _mode_band(band, folder)
    time_axis(band, folder)
    return or_empty(figure, axes, folder)


def draw_modes(folder: ResultFolder) -> Figure:
    figure, (share_axes, count_axes) = pyplot.subplots(
        2, 1, figsize=(9, 5.4), sharex=True, constrained_layout=True
    )
    time_s, modes = folder.ticks["time_s"], folder.ticks["mode"]
    colours = mode_colours(modes)
    seconds = mode_seconds(folder)
    total_s = sum(seconds.values()) or 1.0
    shares = [
        100.0 * rolling_mean(time_s, (modes == mode).astype(float), 20.0) for mode in colours
    ]
    if shares:
        share_axes.stackplot(
            time_s,
            shares,
            colors=list(colours.values()),
            labels=[
                f"{mode.replace('_', ' ')}  {seconds[mode]:.0f} s, "
                f"{100.0 * seconds[mode] / total_s:.0f} %"
                for mode in colours
            ],
            linewidth=0,
            alpha=0.85,
        )
        share_axes.legend(
            loc="lower left", bbox_to_anchor=(0, 1.0), ncols=4, borderaxespad=0.2, handlelength=1.0
        )
    share_axes.set_ylim(0, 100)
    share_axes.set_ylabel("share of time over 20 s, %")
    share_axes.set_title("Modes", pad=26)
    for name, colour in (("clusters", BLUE), ("trails", ORANGE), ("dormant", MUTED)):
        mean = rolling_mean(time_s, folder.ticks[name], 2.0)
        count_axes.plot(time_s, mean, color=colour, linewidth=1.3, label=name)
    count_axes.set_ylim(0, 1.18 * max(5.0, float(np.max(folder.ticks["clusters"], initial=0.0))))
    count_axes.set_ylabel("open clusters")
    count_axes.legend(loc="upper right", ncols=3, borderaxespad=0.2)
    time_axis(count_axes, folder)
    return or_empty(figure, share_axes, folder)


def draw_times(folder: ResultFolder) -> Figure:
    stages = stage_rows(folder)
    figure, axes = pyplot.subplots(
        figsize=(9, 1.9 + 0.34 * max(len(stages), 1)), constrained_layout=True
    )
    axes.set_title("Time per stage")
    if not stages:
        axes.set_axis_off()
        axes.text(0.0, 0.5, "No stage was timed.", transform=axes.transAxes)
        return figure
    names = [name for name, _ in stages]
    for row, (_, stage) in enumerate(stages):
        p50, p99, largest = (max(stage[key], 1e-4) for key in ("p50_ms", "p99_ms", "max_ms"))
        axes.plot([p50, largest], [row, row], color=GRID, linewidth=5, zorder=1)
        axes.plot([p50, p99], [row, row], color=SKY, linewidth=5, zorder=2)
        axes.plot(p50, row, "o", color=BLUE, markersize=7, zorder=3)
        axes.plot(p99, row, "|", color=BLUE, markersize=12, markeredgewidth=2, zorder=3)
        axes.plot(largest, row, "x", color=RED, markersize=6, zorder=3)
    axes.set_yticks(range(len(names)), names)
    axes.set_ylim(len(names) - 0.4, -0.6)
    axes.set_xscale("log")
    axes.xaxis.set_major_formatter(FormatStrFormatter("%g"))
    axes.grid(axis="y", visible=False)
    axes.set_xlabel("wall time, ms (logarithmic)")
    marks = [("o", 7, BLUE, "median"), ("|", 12, BLUE, "p99"), ("x", 6, RED, "maximum")]
    axes.legend(
        handles=[
            Line2D([], [], linestyle="none", marker=m, markersize=s, color=c, label=label)
            for m, s, c, label in marks
        ],
        loc="lower right",
        bbox_to_anchor=(1.0, 1.0),
        ncols=3,
        borderaxespad=0.2,
    )
    return figure


def stage_rows(folder: ResultFolder) -> List[Tuple[str, dict]]:
    """Stages that were timed at all, with every key a number."""
    keys = ("count", "mean_ms", "p50_ms", "p99_ms", "max_ms")
    stages = folder.result.get("stages")
    if not isinstance(stages, dict):
        return []
    return [
        (name, stage)
        for name, stage in stages.items()
        if isinstance(stage, dict)
        and all(isinstance(stage.get(key), (int, float)) for key in keys)
        and stage["count"] > 0
    ]


def _mode_band(axes, folder: ResultFolder) -> None:
    time_s = folder.ticks["time_s"]
    colours = mode_colours(folder.ticks["mode"])
    for mode in colours:
        spans = [
            (time_s[start], time_s[end] - time_s[start])
            for name, start, end in mode_runs(folder)
            if name == mode
        ]
        axes.broken_barh(spans, (0, 1), facecolors=colours[mode], linewidth=0)
    axes.set_ylim(0, 1)
    axes.set_yticks([])
    axes.grid(False)
    axes.spines[["left", "bottom"]].set_visible(False)
    axes.set_ylabel("mode", rotation=0, ha="right", va="center")
    if colours:
        axes.legend(
            handles=[
                Patch(facecolor=colour, label=mode.replace("_", " "))
                for mode, colour in colours.items()
            ],
            loc="upper left",
            bbox_to_anchor=(0, -1.9),
            ncols=8,
            borderaxespad=0.0,
            handlelength=1.0,
        )


def _mark_completion(axes, completed_s: float) -> None:
    axes.axvline(
        completed_s, color=GREEN, linewidth=1.2, linestyle=(0, (4, 3)), clip_on=False, ymax=0.98
    )
    axes.annotate(
        f"nothing left\n{completed_s:.1f} s",
        (completed_s, 0.04),
        xycoords=("data", "axes fraction"),
        xytext=(-5, 0),
        textcoords="offset points",
        ha="right",
        color=GREEN,
        fontsize=8.5,
    )
