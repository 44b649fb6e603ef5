#!/usr/bin/python3
# Copyright 2026 the Understory authors
# SPDX-License-Identifier: BSD-3-Clause
"""Turns the result folder of one mission into figures (PNG) and one self-contained report.html."""

import argparse
import base64
import html
import io
import os
import sys
from pathlib import Path
from typing import List, Optional, Tuple

import figures
import team_report
from matplotlib import pyplot
from result_folder import FolderError, ResultFolder, read_result, read_result_folder

CAPTIONS = {
    "path": "The flown path, coloured by mode, over the true trunks. Shaded: columns of the map, "
    "or parts of them, that stayed unknown.",
    "coverage": "Share of the truly visible free space that the map knows to be free.",
    "speed": "True speed of the vehicle, with the limits in force.",
    "modes": "Share of time in each mode, and the frontier clusters that were open.",
    "times": "Wall time of the stages on the machine that flew the mission.",
}
STYLE_SHEET = """
:root { --ink: #22282f; --muted: #68717b; --line: #e1e4e8; --good: #00784f; --bad: #b3261e;
  --warn: #8a5a00; }
* { box-sizing: border-box; }
body { margin: 0; background: #f5f6f7; color: var(--ink);
  font: 15px/1.5 system-ui, "DejaVu Sans", sans-serif; }
main { max-width: 1000px; margin: 0 auto; padding: 28px 20px 60px; }
h1 { font-size: 26px; margin: 0 0 4px; }
h2 { font-size: 18px; margin: 36px 0 10px; }
.scene { color: var(--muted); margin: 0 0 16px; }
.verdict { display: inline-block; padding: 3px 12px; border-radius: 12px; color: white;
  font-weight: 600; }
.good { background: var(--good); } .bad { background: var(--bad); }
.warnings { margin: 16px 0; padding: 10px 16px 10px 34px; background: #fdecea; color: var(--bad);
  border-left: 4px solid var(--bad); }
.notes { margin: 16px 0; padding: 10px 16px 10px 34px; background: #fff6e0; color: var(--warn);
  border-left: 4px solid #d9a200; }
.cards { display: grid; grid-template-columns: repeat(auto-fill, minmax(150px, 1fr)); gap: 10px; }
.card { background: white; border: 1px solid var(--line); border-radius: 6px; padding: 10px 14px; }
.card b { display: block; font-size: 20px; font-variant-numeric: tabular-nums; }
.card span { color: var(--muted); font-size: 13px; }
.card.alarm b { color: var(--bad); }
figure { margin: 0 0 22px; background: white; border: 1px solid var(--line); border-radius: 6px;
  padding: 12px; }
figure img { display: block; max-width: 100%; height: auto; margin: 0 auto; }
figcaption { color: var(--muted); font-size: 13px; margin-top: 8px; }
table { border-collapse: collapse; background: white; width: 100%; }
th, td { border-bottom: 1px solid var(--line); padding: 5px 12px; text-align: right;
  font-variant-numeric: tabular-nums; }
th:first-child, td:first-child { text-align: left; }
th { color: var(--muted); font-weight: 600; font-size: 13px; }
details { margin-top: 18px; background: white; border: 1px solid var(--line); border-radius: 6px;
  padding: 10px 14px; }
summary { cursor: pointer; font-weight: 600; }
pre { overflow-x: auto; font-size: 13px; margin: 10px 0 0; }
"""


def write_whole(path: Path, content: bytes) -> None:
    """Replaces the file as a whole or leaves it as it was."""
    draft = path.with_name(path.name + ".part")
    try:
        draft.write_bytes(content)
        os.replace(draft, path)
    except OSError as error:
        draft.unlink(missing_ok=True)
        raise FolderError(f"{path}: cannot write: {error.strerror}") from error


def figure_png(figure) -> bytes:
    buffer = io.BytesIO()
    # Without the version note, the same mission gives the same bytes.
    figure.savefig(buffer, format="png", metadata={"Software": None})
    pyplot.close(figure)
    return buffer.getvalue()


def text_of(value: Optional[float], digits: int, unit: str = "", absent: str = "–") -> str:
    return absent if value is None else f"{value:.{digits}f}{unit}"


def warnings_of(folder: ResultFolder) -> List[str]:
    result, found = folder.result, []
    collisions = folder.number("collisions") or 0
    if collisions > 0:
        found.append(f"{collisions:.0f} collision{'s' if collisions > 1 else ''} with a trunk.")
    if result.get("completed") is not True:
        reason = str(result.get("stop_reason") or "no reason was recorded")
        found.append(f"The mission did not complete: {reason}.")
    coverage = folder.number("coverage")
    if result.get("completed") is True and coverage is not None and coverage < 0.99:
        found.append(f"It declared itself complete at {100 * coverage:.2f} % coverage.")
    caps_mps = [folder.number("explorer_speed_mps"), folder.number("collector_speed_mps")]
    known_caps = [cap for cap in caps_mps if cap is not None]
    fastest = folder.number("speed_max_mps")
    # The limit binds the trajectory; the vehicle's own overshoot stays within 2 %.
    if known_caps and fastest is not None and fastest > 1.02 * max(known_caps):
        found.append(f"Flew {fastest:.2f} m/s where {max(known_caps):g} m/s is the limit.")
    return found


def cards_of(folder: ResultFolder) -> List[Tuple[str, str, bool]]:
    """Figure, meaning, and whether it is alarming."""
    number = folder.number
    coverage = number("coverage")
    radius_m = number("vehicle_radius_m") or 0.20
    clearance_m = number("min_clearance_m")
    collisions = number("collisions")
    return [
        (text_of(number("completion_time_s"), 1, " s", "never"), "completion time", False),
        (text_of(None if coverage is None else 100 * coverage, 2, " %"), "coverage", False),
        (text_of(number("t95_s"), 1, " s", "never"), "95 % coverage", False),
        (text_of(number("distance_m"), 0, " m"), "distance", False),
        (text_of(number("speed_mean_mps"), 2, " m/s"), "mean speed", False),
        (text_of(number("speed_max_mps"), 2, " m/s"), "largest speed", False),
        (text_of(collisions, 0), "collisions", bool(collisions)),
        (
            "no trunk" if clearance_m is None else f"{clearance_m:.2f} m",
            "smallest clearance",
            clearance_m is not None and clearance_m < radius_m,
        ),
        (text_of(number("explored_volume_m3"), 0, " m³"), "explored volume", False),
        (text_of(number("replans"), 0), "trajectories planned", False),
        (text_of(number("realtime_factor"), 1, " ×"), "real time", False),
        (text_of(number("peak_rss_mb"), 0, " MB"), "peak memory", False),
    ]


def table(header: List[str], rows: List[List[str]]) -> str:
    head = "".join(f"<th>{html.escape(cell)}</th>" for cell in header)
    body = "".join(
        "<tr>" + "".join(f"<td>{html.escape(cell)}</td>" for cell in row) + "</tr>" for row in rows
    )
    return f"<table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"


def tables(folder: ResultFolder) -> str:
    parts = []
    stages = figures.stage_rows(folder)
    if stages:
        keys = ["mean_ms", "p50_ms", "p99_ms", "max_ms"]
        rows = [[name, str(s["count"]), *(f"{s[key]:.3f}" for key in keys)] for name, s in stages]
        header = ["stage", "count", "mean ms", "p50 ms", "p99 ms", "max ms"]
        parts.append("<h2>Time per stage</h2>" + table(header, rows))
    levels = [
        [f"{level} %", text_of(folder.number(f"t{level}_s"), 1, absent="never")]
        for level in (50, 90, 95, 99)
    ]
    parts.append("<h2>Coverage reached</h2>" + table(["coverage", "after, s"], levels))
    counters = {
        "dormant clusters at the end": folder.result.get("dormant_clusters"),
        "targets set aside at the end": folder.result.get("set_aside_targets"),
    }
    if isinstance(folder.result.get("counters"), dict):
        counters.update(folder.result["counters"])
    rows = [[str(name), str(count)] for name, count in counters.items() if count is not None]
    if rows:
        parts.append("<h2>Counters</h2>" + table(["what", "count"], rows))
    return "".join(parts)


def bullets(style: str, items: List[str]) -> str:
    if not items:
        return ""
    return f'<ul class="{style}">' + "".join(f"<li>{html.escape(i)}</li>" for i in items) + "</ul>"


def render(folder: ResultFolder, images: List[Tuple[str, bytes]]) -> str:
    result = folder.result
    if folder.number("collisions"):
        verdict, colour = "collided", "bad"
    elif result.get("completed") is True:
        verdict, colour = "completed", "good"
    else:
        verdict, colour = "not completed", "bad"
    scenario = html.escape(str(result.get("scenario") or "unnamed"))
    scene = [
        f"{label} {result[key]}"
        for key, label in (
            ("strategy", "strategy"),
            ("speed_cap", "speed cap"),
            ("seed", "seed"),
            ("commit", "commit"),
        )
        if result.get(key) not in (None, "")
    ]
    cards = "".join(
        f'<div class="card{" alarm" if alarm else ""}"><b>{html.escape(text)}</b>'
        f"<span>{html.escape(meaning)}</span></div>"
        for text, meaning, alarm in cards_of(folder)
    )
    pictures = "".join(
        f'<figure id="{name}"><img alt="{html.escape(CAPTIONS[name])}" '
        f'src="data:image/png;base64,{base64.b64encode(png).decode()}">'
        f"<figcaption>{html.escape(CAPTIONS[name])}</figcaption></figure>"
        for name, png in images
    )
    config = ""
    if folder.config is not None:
        config = (
            "<details><summary>Effective configuration</summary>"
            f"<pre>{html.escape(folder.config)}</pre></details>"
        )
    reason = html.escape(str(result.get("stop_reason") or "unknown"))
    return f"""<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>Understory mission: {scenario}</title><style>{STYLE_SHEET}</style></head><body><main>
<h1>Mission in {scenario}</h1>
<p class="scene">{html.escape(" · ".join(scene))}</p>
<p><span class="verdict {colour}">{verdict}</span> &nbsp;Stopped because: {reason}</p>
{bullets("warnings", warnings_of(folder))}{bullets("notes", folder.notes)}
<div class="cards">{cards}</div>
<h2>Figures</h2>{pictures}
{tables(folder)}
{config}
</main></body></html>
"""


def make_team_report(path: Path) -> Path:
    """One of each vehicle, and one of all."""
    members = team_report.members_of(path)
    for name, _ in members:
        make_report(path / name)
    images = [(n, figure_png(figure)) for n, figure in team_report.all_figures(members).items()]
    for name, png in images:
        write_whole(path / f"{name}.png", png)
    result = read_result(path / "result.json")
    page = team_report.render(result, images, [name for name, _ in members], sys.modules[__name__])
    write_whole(path / "report.html", page.encode("utf-8"))
    return path / "report.html"


def make_report(path: Path) -> Path:
    if not (path / "ticks.csv").exists() and team_report.members_of(path):
        return make_team_report(path)
    folder = read_result_folder(path)
    images = [(name, figure_png(figure)) for name, figure in figures.all_figures(folder).items()]
    for name, png in images:
        write_whole(path / f"{name}.png", png)
    report = path / "report.html"
    write_whole(report, render(folder, images).encode("utf-8"))
    return report


def main(arguments: List[str]) -> int:
    parser = argparse.ArgumentParser(prog="report.py", description=__doc__)
    parser.add_argument("folder", type=Path, metavar="RESULT_DIR", help="folder of one mission")
    options = parser.parse_args(arguments)
    try:
        print(make_report(options.folder))
    except FolderError as error:
        print(f"report: {error}", file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
