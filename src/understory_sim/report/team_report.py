# Copyright 2026 the Understory authors
# SPDX-License-Identifier: BSD-3-Clause
"""The page of a team's mission: what all did together, with a report of each vehicle linked to."""

import base64
import html
from pathlib import Path
from typing import List, Tuple

import numpy as np
from matplotlib import pyplot
from matplotlib.collections import PatchCollection
from matplotlib.figure import Figure
from matplotlib.patches import Circle

from look import BLUE, GREEN, INK, ORANGE, PINK, RED, SKY, STYLE, TRUNK
from result_folder import ResultFolder, read_result_folder
from team_time import draw_times

COLOURS = [BLUE, ORANGE, GREEN, PINK, SKY, RED]
CAPTIONS = {
    "team_path": "The flown paths over the true trunks; triangles: starts, squares: ends.",
    "team_volume": "What each vehicle knows of the team's map (solid) over time.",
    "team_time": "Where the time of each vehicle went, until the last one was down.",
}


def members_of(path: Path) -> List[Tuple[str, ResultFolder]]:
    """Of a team's result folder, in the order of their ids; none: it is no team's."""
    found = sorted(path.glob("vehicle_*/ticks.csv"), key=lambda file: int(file.parent.name[8:]))
    return [(file.parent.name, read_result_folder(file.parent)) for file in found]


def _colour(index: int) -> str:
    return COLOURS[index % len(COLOURS)]


def draw_paths(members: List[Tuple[str, ResultFolder]]) -> Figure:
    figure, axes = pyplot.subplots(figsize=(9.0, 5.4), constrained_layout=True)
    trunks = members[0][1].trunks
    if trunks is not None and len(trunks):
        circles = [Circle((x, y), radius) for x, y, radius in trunks]
        axes.add_collection(PatchCollection(circles, facecolor=TRUNK, edgecolor="none", zorder=3))
    for index, (name, folder) in enumerate(members):
        x_m, y_m = folder.ticks["x_m"], folder.ticks["y_m"]
        axes.plot(x_m, y_m, color=_colour(index), linewidth=1.3, label=name.replace("_", " "), zorder=4)
        if len(x_m):
            axes.plot(x_m[0], y_m[0], "^", color=_colour(index), markeredgecolor=INK, zorder=6)
            axes.plot(x_m[-1], y_m[-1], "s", color=_colour(index), markeredgecolor=INK, zorder=5)
    axes.set_aspect("equal")
    axes.margins(0.01)
    axes.grid(False)
    axes.set_xlabel("x, m")
    axes.set_ylabel("y, m")
    axes.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0))
    return figure


def draw_volumes(members: List[Tuple[str, ResultFolder]]) -> Figure:
    figure, axes = pyplot.subplots(figsize=(9.0, 3.4), constrained_layout=True)
    for index, (name, folder) in enumerate(members):
        known = np.array(folder.ticks["explored_volume_m3"])
        axes.plot(folder.ticks["time_s"], known, color=_colour(index), label=name.replace("_", " "))
    axes.set_xlabel("mission time, s")
    axes.set_ylabel("known volume, m³")
    axes.set_xlim(left=0)
    axes.set_ylim(bottom=0)
    axes.legend(loc="lower right")
    return figure


def all_figures(members: List[Tuple[str, ResultFolder]]):
    names = [name.replace("_", " ") for name, _ in members]
    with pyplot.rc_context(STYLE):
        return {
            "team_path": draw_paths(members),
            "team_volume": draw_volumes(members),
            "team_time": draw_times(names, [folder for _, folder in members]),
        }


def _cell(mate: dict, key: str, digits: int) -> str:
    value = mate.get(key)
    return "–" if value is None else f"{value:.{digits}f}"


def rows_of(result: dict) -> List[List[str]]:
    return [
        [
            f"vehicle {mate.get('id')}" + (" (lost)" if mate.get("is_lost") else ""),
            _cell(mate, "completion_time_s", 1),
            _cell(mate, "distance_m", 0),
            _cell(mate, "speed_mean_mps", 2),
            _cell(mate, "seen_volume_m3", 0),
            _cell(mate, "bytes_per_s", 0),
            _cell(mate, "peak_bytes_per_s", 0),
            _cell(mate, "steady_peak_bytes_per_s", 0),
        ]
        for mate in result.get("team", [])
        if isinstance(mate, dict)
    ]


HEADER = ["vehicle", "nothing left after, s", "distance, m", "mean, m/s", "seen itself, m³"]
HEADER += ["sent, B/s", "most in 1 s, B", "the same in contact"]


def render(result: dict, images: List[Tuple[str, bytes]], names: List[str], page) -> str:
    """`page`: the module report.py, whose look this page shares."""
    is_good = result.get("completed") is True and not result.get("collisions")
    verdict = "completed" if is_good else "not completed" if not result.get("collisions") else "collided"
    separation_m = result.get("least_separation_m")
    facts = [
        (f"{_cell(result, 'completion_time_s', 1)} s", "until nobody had anything left"),
        (page.text_of(100 * (result.get("coverage") or 0.0), 2, " %"), "coverage, all together"),
        (str(result.get("collisions")), "collisions"),
        (page.text_of(separation_m, 2, " m"), "least separation of two vehicles"),
    ]
    cards = "".join(
        f'<div class="card"><b>{html.escape(value)}</b><span>{html.escape(what)}</span></div>'
        for value, what in facts
    )
    pictures = "".join(
        f'<figure><img alt="{html.escape(CAPTIONS[name])}" src="data:image/png;base64,'
        f'{base64.b64encode(png).decode()}"><figcaption>{html.escape(CAPTIONS[name])}</figcaption></figure>'
        for name, png in images
    )
    links = " · ".join(f'<a href="{name}/report.html">{name.replace("_", " ")}</a>' for name in names)
    scenario = html.escape(str(result.get("scenario") or "unnamed"))
    return f"""<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8">
<title>Understory team mission: {scenario}</title><style>{page.STYLE_SHEET}</style></head><body><main>
<h1>A team in {scenario}</h1>
<p><span class="verdict {"good" if is_good else "bad"}">{verdict}</span> &nbsp;Stopped because:
{html.escape(str(result.get("stop_reason")))}</p>
<div class="cards">{cards}</div>
<h2>Vehicles</h2>{page.table(HEADER, rows_of(result))}
<p>Reports of each: {links}</p>
<h2>Figures</h2>{pictures}
</main></body></html>
"""
