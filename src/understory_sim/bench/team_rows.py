# Copyright 2026 the Understory authors
# SPDX-License-Identifier: BSD-3-Clause
"""What the rows of a table say of a team: how the work was shared, what was sent, what was seen when."""

import statistics

VOLUME_TIMES_S = (300, 600, 900, 1200, 1500)
VOLUMES = [f"volume_{time_s}_s" for time_s in VOLUME_TIMES_S]
MEASURED = ["team_size", "least_separation_m", "balance", "overlap"]
MEASURED += ["sent_bytes_per_s", "sent_peak_bytes", "sent_steady_peak_bytes"]
COLUMNS = MEASURED + VOLUMES


def _volume_at(result, time_s):
    """Of all together; after the end what there was at the end."""
    found = [at["volume_m3"] for at in result.get("volume_at", []) if at["time_s"] == time_s]
    if found:
        return found[0]
    has_ended = result.get("mission_time_s") is not None and result["mission_time_s"] <= time_s
    return result.get("explored_volume_m3") if has_ended else None


def measured(result):
    """{column: value or None} of a result.json."""
    mates = result.get("team", [])
    values = {"team_size": max(1, len(mates)), "least_separation_m": result.get("least_separation_m")}
    values.update((f"volume_{time_s}_s", _volume_at(result, time_s)) for time_s in VOLUME_TIMES_S)
    if mates:
        seen = [mate["seen_volume_m3"] for mate in mates]
        # 1: all have seen as much.
        values["balance"] = min(seen) / max(seen) if max(seen) > 0 else None
        # 0: nobody has seen what another one has seen; 1: two have seen everything.
        united = result.get("explored_volume_m3")
        values["overlap"] = sum(seen) / united - 1.0 if united else None
        values["sent_bytes_per_s"] = max(mate["bytes_per_s"] for mate in mates)
        values["sent_peak_bytes"] = max(mate["peak_bytes_per_s"] for mate in mates)
        # Without what is sent when a contact begins.
        values["sent_steady_peak_bytes"] = max(mate["steady_peak_bytes_per_s"] for mate in mates)
    return {name: values.get(name) for name in COLUMNS}


def _numbers(rows, name):
    return [float(row[name]) for row in rows if row[name]]


def _mean(rows, name, digits):
    values = _numbers(rows, name)
    return f"{statistics.fmean(values):.{digits}f}" if values else "-"


def _worst(rows, name, worst, digits):
    values = _numbers(rows, name)
    return f"{worst(values):.{digits}f}" if values else "-"


def markdown(groups):
    """groups: {(title, cap, strategy): rows}; empty if nobody flew in a team."""
    groups = {name: rows for name, rows in groups.items() if rows[0]["team_size"] not in ("", "1")}
    if not groups:
        return ""
    times = " | ".join(f"m3 at {time_s} s" for time_s in VOLUME_TIMES_S)
    lines = [
        f"| scene | strategy | vehicles | balance, mean / least | overlap | least separation m "
        f"| sent B/s | peak B in 1 s, in contact | {times} |",
        "|" + "---|" * (8 + len(VOLUMES)),
    ]
    for (title, _, strategy), rows in groups.items():
        balance = f"{_mean(rows, 'balance', 2)} / {_worst(rows, 'balance', min, 2)}"
        cells = [title, strategy, rows[0]["team_size"], balance]
        cells += [_mean(rows, "overlap", 2), _worst(rows, "least_separation_m", min, 2)]
        peaks = [_worst(rows, f"sent_{kind}peak_bytes", max, 0) for kind in ("", "steady_")]
        cells += [_mean(rows, "sent_bytes_per_s", 0), ", ".join(peaks)]
        cells += [_mean(rows, name, 0) for name in VOLUMES]
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(lines) + "\n"
