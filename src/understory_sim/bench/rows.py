# Copyright 2026 the Understory authors
# SPDX-License-Identifier: BSD-3-Clause
"""The rows of a table: one per mission flown, kept in a CSV file that grows with every mission."""

import csv
import errno
import json
import statistics

import team_rows

KEY = ["scene", "seed", "speed_cap", "strategy", "variant"]
MEASURED = [
    "completed",
    "stop_reason",
    "completion_time_s",
    "mission_time_s",
    "coverage",
    "t90_s",
    "distance_m",
    "speed_mean_mps",
    "speed_max_mps",
    "collisions",
    "min_clearance_m",
    "realtime_factor",
    "peak_rss_mb",
]
DECISION = {"decision_p50_ms": "p50_ms", "decision_p99_ms": "p99_ms"}
COLUMNS = KEY + ["title", "timed", "commit", "error"] + MEASURED + list(DECISION) + team_rows.COLUMNS


def row_of(mission, folder, error, commit):
    """The row of a mission that was flown into this folder; `error` is what it said if it failed."""
    row = dict(zip(KEY, mission.key), title=mission.title, commit=commit, error=error)
    row["timed"] = str(mission.timed)
    try:
        result = json.loads((folder / "result.json").read_text(encoding="utf-8"))
    except (OSError, ValueError):
        result = {"completed": False, "stop_reason": "no result"}
    measured = {name: result.get(name) for name in MEASURED}
    decision = result.get("stages", {}).get("decision", {})
    measured.update((name, decision.get(key)) for name, key in DECISION.items())
    measured.update(team_rows.measured(result))
    row.update((name, "" if value is None else str(value)) for name, value in measured.items())
    return row


def _without_cut_row(path):
    """The text of a file up to its last whole line; empty if there is no file."""
    text = path.read_text(encoding="utf-8") if path.exists() else ""
    return text[: text.rfind("\n") + 1]


def read_rows(path):
    """{key: row} of a file, empty if there is none. A last row cut short is left out."""
    rows = csv.DictReader(_without_cut_row(path).splitlines())
    if rows.fieldnames not in (None, COLUMNS):
        raise OSError(errno.EINVAL, "columns of another version (--fresh flies all again)")
    return {tuple(row[name] for name in KEY): row for row in rows}


def append_row(path, row):
    """Adds one row, with a header if it is the first. A last row cut short is dropped."""
    whole = _without_cut_row(path)
    is_new = not whole
    with path.open("a", encoding="utf-8", newline="") as lines:
        lines.truncate(len(whole.encode("utf-8")))
        writer = csv.DictWriter(lines, COLUMNS, lineterminator="\n")
        if is_new:
            writer.writeheader()
        writer.writerow(row)


def is_good(row):
    """Completed by itself, or flown until its time was over where that is wanted, without touching
    anything."""
    is_timed = row["timed"] == "True" and row["stop_reason"] == "time_limit"
    return (row["completed"] == "True" or is_timed) and row["collisions"] == "0"


def _mean(rows, name, digits):
    values = [float(row[name]) for row in rows if row[name]]
    if not values:
        return "-"
    spread = f" ± {statistics.stdev(values):.{digits}f}" if len(values) > 1 else ""
    return f"{statistics.fmean(values):.{digits}f}{spread}"


def _worst(rows, name, worst, digits):
    values = [float(row[name]) for row in rows if row[name]]
    return f"{worst(values):.{digits}f}" if values else "-"


def grouped(rows):
    """{(title, speed cap, strategy): rows}, in the order of first appearance."""
    groups = {}
    for row in rows:
        groups.setdefault((row["title"], row["speed_cap"], row["strategy"]), []).append(row)
    return groups


def markdown(rows):
    """A table with one line per group."""
    lines = [
        "| scene | cap | strategy | n | failed | time s | distance m | mean m/s | least coverage % "
        "| collisions | least clearance m | decision p50 ms | p99 ms |",
        "|---|---|---|---|---|---|---|---|---|---|---|---|---|",
    ]
    for (title, cap, strategy), group in grouped(rows).items():
        good = [row for row in group if is_good(row)]
        coverage = [dict(row, percent=100 * float(row["coverage"] or 0)) for row in group]
        cells = [
            title,
            cap,
            strategy,
            str(len(group)),
            str(len(group) - len(good)),
            _mean(good, "completion_time_s", 1),
            _mean(good, "distance_m", 0),
            _mean(good, "speed_mean_mps", 2),
            _worst(coverage, "percent", min, 2),
            str(sum(int(row["collisions"] or 0) for row in group)),
            _worst(group, "min_clearance_m", min, 2),
            _mean(group, "decision_p50_ms", 1),
            _worst(group, "decision_p99_ms", max, 1),
        ]
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(lines) + "\n"


def _time_ratio(rows, base):
    """Of the mean completion times of those that are good."""
    times, base_times = (
        [float(row["completion_time_s"]) for row in group if is_good(row) and row["completion_time_s"]]
        for group in (rows, base)
    )
    if not times or not base_times:
        return "-"
    return f"{statistics.fmean(times) / statistics.fmean(base_times):.2f}"


def comparison(rows):
    """Mean completion times of the strategies as parts of the last one's; empty if there is one."""
    groups = grouped(rows)
    strategies = list(dict.fromkeys(strategy for _, _, strategy in groups))
    if len(strategies) < 2:
        return ""
    base, others = strategies[-1], strategies[:-1]
    lines = ["| scene | cap |" + "".join(f" {name} / {base} |" for name in others)]
    lines.append("|---|---|" + "---|" * len(others))
    for title, cap in dict.fromkeys((title, cap) for title, cap, _ in groups):
        flown = {name: groups.get((title, cap, name), []) for name in strategies}
        cells = [_time_ratio(flown[name], flown[base]) for name in others]
        lines.append(f"| {title} | {cap} | " + " | ".join(cells) + " |")
    return "\n".join(lines) + "\n"


def cost_of_variants(rows):
    """Mean completion times as parts of the first variant's; empty if none has its own line."""
    variants = list(dict.fromkeys(r["variant"] for r in rows if r["title"] == r["variant"]))
    if len(variants) < 2:
        return ""
    lines = [f"| variant | time / {variants[0]} | least coverage % | not completed |",
             "|---|---|---|---|"]
    by_variant = {name: [row for row in rows if row["variant"] == name] for name in variants}
    for variant, members in by_variant.items():
        ratio = _time_ratio(members, by_variant[variants[0]])
        least = min(100 * float(row["coverage"] or 0) for row in members)
        failed = sum(not is_good(row) for row in members)
        lines.append(f"| {variant} | {ratio} | {least:.2f} | {failed} of {len(members)} |")
    return "\n".join(lines) + "\n"
