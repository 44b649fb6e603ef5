# Copyright 2026 the Understory authors
# SPDX-License-Identifier: BSD-3-Clause
"""The flown path from above, over the true trunks and the map."""

import numpy as np
from matplotlib import pyplot
from matplotlib.collections import LineCollection, PatchCollection
from matplotlib.colors import LinearSegmentedColormap, ListedColormap, to_rgb
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Circle, Patch

from look import GREEN, INK, RED, TRUNK, UNKNOWN, mode_colours, mode_runs, or_empty
from result_folder import ResultFolder


def draw_path(folder: ResultFolder) -> Figure:
    figure, axes = pyplot.subplots()
    handles = _draw_map(axes, folder)
    if folder.trunks is not None and len(folder.trunks):
        circles = [Circle((x, y), radius) for x, y, radius in folder.trunks]
        axes.add_collection(PatchCollection(circles, facecolor=TRUNK, edgecolor="none", zorder=3))
        handles.append(Patch(facecolor=TRUNK, label="true trunk"))
    handles += _draw_flown(axes, folder)
    box = folder.result.get("box_m")
    try:
        west_m, south_m, east_m, north_m = *box["min"][:2], *box["max"][:2]
        axes.plot(
            [west_m, east_m, east_m, west_m, west_m],
            [south_m, south_m, north_m, north_m, south_m],
            color=INK,
            linewidth=1.0,
            zorder=2,
        )
    except (TypeError, KeyError, ValueError):
        pass  # an older or foreign result: the picture stands without a frame
    axes.set_aspect("equal")
    axes.margins(0.01)
    axes.autoscale()
    axes.grid(False)
    axes.spines[["left", "bottom"]].set_visible(False)
    _fit_to_page(figure, axes)
    axes.set_xlabel("x, m")
    axes.set_ylabel("y, m")
    distance_m = folder.number("distance_m")
    axes.set_title("Flown path" if distance_m is None else f"Flown path: {distance_m:.0f} m")
    axes.legend(
        handles=handles, loc="upper left", bbox_to_anchor=(1.01, 1.0), borderaxespad=0.0
    )
    return or_empty(figure, axes, folder)


def _draw_map(axes, folder: ResultFolder) -> list:
    view = folder.topview
    if view is None:
        return []
    shade = LinearSegmentedColormap.from_list("unknown", [(*to_rgb(UNKNOWN), 0.0), UNKNOWN])
    place = {"extent": view.extent_m, "interpolation": "nearest"}
    axes.imshow(view.unknown_share(), cmap=shade, vmin=0.0, vmax=1.0, zorder=0, **place)
    hits = np.ma.masked_where(~view.occupied(), np.ones_like(view.pixels))
    axes.imshow(hits, cmap=ListedColormap([INK]), alpha=0.35, zorder=1, **place)
    return [
        Patch(facecolor=UNKNOWN, label="unknown in the map"),
        Patch(facecolor=INK, alpha=0.35, label="occupied in the map"),
    ]


def _draw_flown(axes, folder: ResultFolder) -> list:
    x_m, y_m = folder.ticks["x_m"], folder.ticks["y_m"]
    if not len(x_m):
        return []
    colours = mode_colours(folder.ticks["mode"])
    # Only what is drawn: stretches of one mode, thinned to about five hundredths of a metre.
    for mode, start, end in mode_runs(folder):
        points = np.column_stack([x_m[start : end + 1], y_m[start : end + 1]])
        steps_m = np.hypot(*np.diff(points, axis=0).T)
        passed = np.floor(np.concatenate([[0.0], np.cumsum(steps_m)]) / 0.05)
        keep = np.concatenate([[True], np.diff(passed) > 0])
        keep[-1] = True
        axes.add_collection(
            LineCollection([points[keep]], colors=colours[mode], linewidths=1.5, zorder=4)
        )
    axes.plot(x_m[0], y_m[0], "^", color=GREEN, markersize=9, markeredgecolor="white", zorder=6)
    axes.plot(x_m[-1], y_m[-1], "s", color=INK, markersize=7, markeredgecolor="white", zorder=5)
    handles = [
        Line2D([], [], color=colour, linewidth=2.5, label=mode.replace("_", " "))
        for mode, colour in colours.items()
    ]
    marks = [("^", GREEN, "start"), ("s", INK, "end")]
    radius_m = folder.number("vehicle_radius_m") or 0.20
    touching = folder.ticks["clearance_m"] < radius_m
    hit = touching & ~np.concatenate([[False], touching[:-1]])  # the first tick of each contact
    if hit.any():
        axes.plot(
            x_m[hit], y_m[hit], "X", color=RED, markersize=8, markeredgecolor="white", zorder=7
        )
        marks.append(("X", RED, "collision"))
    return handles + [
        Line2D([], [], linestyle="none", marker=marker, color=colour, label=label)
        for marker, colour, label in marks
    ]


def _fit_to_page(figure: Figure, axes) -> None:
    """A page as wide as the others, as high as the scene asks for, the legend beside it."""
    west_m, east_m = axes.get_xlim()
    south_m, north_m = axes.get_ylim()
    shape = (north_m - south_m) / max(east_m - west_m, 1e-3)
    left_in, below_in, above_in, legend_in = 0.8, 0.55, 0.4, 2.05
    width_in = min(9.0 - left_in - legend_in, 10.0 / shape)
    height_in = max(width_in * shape, 2.6)
    page_in = (left_in + width_in + legend_in, below_in + height_in + above_in)
    figure.set_size_inches(*page_in)
    axes.set_position(
        [
            left_in / page_in[0],
            below_in / page_in[1],
            width_in / page_in[0],
            height_in / page_in[1],
        ]
    )
