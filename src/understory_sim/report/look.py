# Copyright 2026 the Understory authors
# SPDX-License-Identifier: BSD-3-Clause
"""What all figures of a mission share: colours, style and small helpers.

The colours are Okabe and Ito's, which people with any colour vision can tell apart.
"""

from typing import Dict, List, Tuple

import matplotlib

matplotlib.use("Agg")
import numpy as np
from matplotlib.figure import Figure

from result_folder import ResultFolder

INK = "#22282f"
MUTED = "#7b838c"
GRID = "#e6e8eb"
UNKNOWN = "#a79fb3"
TRUNK = "#6b4f3a"
BLUE, ORANGE, GREEN, RED, SKY, PINK = (
    "#0072B2",
    "#E69F00",
    "#009E73",
    "#D55E00",
    "#56B4E9",
    "#CC79A7",
)
MODE_COLOURS = {"explorer": BLUE, "collector": ORANGE, "transit": "#9aa1a9", "brake": RED}
SPARE_COLOURS = [GREEN, PINK, SKY, INK]

STYLE = {
    "figure.facecolor": "white",
    "figure.dpi": 130,
    "font.size": 9.5,
    "text.color": INK,
    "axes.edgecolor": MUTED,
    "axes.labelcolor": INK,
    "axes.linewidth": 0.8,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.titlesize": 11,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "grid.color": GRID,
    "grid.linewidth": 0.8,
    "xtick.color": MUTED,
    "ytick.color": MUTED,
    "xtick.labelcolor": INK,
    "ytick.labelcolor": INK,
    "legend.frameon": False,
    "legend.fontsize": 9,
    "lines.solid_capstyle": "round",
}


def mode_colours(modes: np.ndarray) -> Dict[str, str]:
    """A colour for each mode that occurs; the known ones first, each always the same."""
    present = sorted(set(modes))
    colours = {mode: colour for mode, colour in MODE_COLOURS.items() if mode in present}
    others = [mode for mode in present if mode not in colours]
    for index, mode in enumerate(others):
        colours[mode] = SPARE_COLOURS[index % len(SPARE_COLOURS)]
    return colours


def mode_runs(folder: ResultFolder) -> List[Tuple[str, int, int]]:
    """Mode, first tick and last tick of each unbroken stretch; stretches share their ends."""
    modes = folder.ticks["mode"]
    if len(modes) < 2:
        return []
    starts = [0, *(np.flatnonzero(modes[1:] != modes[:-1]) + 1)]
    ends = [*starts[1:], len(modes) - 1]
    return [(modes[start], start, end) for start, end in zip(starts, ends) if end > start]


def rolling_mean(time_s: np.ndarray, values: np.ndarray, window_s: float) -> np.ndarray:
    """Centred, over the ticks within half a window on either side."""
    sums = np.concatenate([[0.0], np.cumsum(values)])
    first = np.searchsorted(time_s, time_s - 0.5 * window_s, side="left")
    end = np.searchsorted(time_s, time_s + 0.5 * window_s, side="right")
    return (sums[end] - sums[first]) / np.maximum(end - first, 1)


def time_axis(axes, folder: ResultFolder) -> None:
    axes.set_xlabel("mission time, s")
    axes.set_xlim(0, max(float(np.max(folder.ticks["time_s"], initial=0.0)), 1.0))


def or_empty(figure: Figure, axes, folder: ResultFolder) -> Figure:
    if folder.tick_count < 2:
        axes.text(
            0.5,
            0.9,
            "nothing flown" if folder.tick_count == 0 else "a single tick",
            transform=axes.transAxes,
            ha="center",
            fontsize=12,
            bbox={"facecolor": "white", "edgecolor": GRID, "boxstyle": "round"},
            zorder=9,
        )
    return figure
