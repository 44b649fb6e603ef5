# Copyright 2026 the Understory authors
# SPDX-License-Identifier: BSD-3-Clause
"""All of a log on one page, as a table for reading and as one dictionary for programs."""

import datetime
import math
from dataclasses import asdict
from typing import Any, Dict, List

import numpy as np

import bus_load
from decode import Log, other_kinds
from log_latency import samples_of, statistics_of, table_text, unanswered
from log_latency import Statistics
from sets import ODOMETRY, SETPOINT, sets_of
from states import flag_spans, foreign_protocols, host_spans, link_counts, results_of
from states import HARMLESS_FLAGS, vehicle_spans
from streams import stream_of

MOST_LINES = 40  # of each timeline
BAD_RESULTS = ("STALE", "SEQUENCE", "LIMITS", "UNSUPPORTED")
BAD_STATES = ("KILLED", "FAULT")
FAILSAFE_STATES = ("HOLD", "LAND")  # but for these reasons:
WANTED = ("NONE", "HOST_REQUEST")
FLYING = ("ARMED", "HOLD")
LINK_ERRORS = {
    "CrcErr": "wrong checksums",
    "Lost": "lost",
    "Torn": "torn sets",
    "BusErr": "bus errors",
}
STREAM_ERRORS = {
    "checksum": "frames with a wrong checksum",
    "code": "frames with a forbidden code",
    "length": "frames that are not 8 bytes of data",
    "lost": "frames lost",
    "jumps": "jumps of the counter: more than two frames lost, or a new start",
    "repeated": "frames repeated",
}
# Title and width of a stream's columns.
COLUMNS = (
    ("rate_hz", "rate Hz", 9),
    ("p50_ms", "p50 ms", 10),
    ("p99_ms", "p99 ms", 10),
    ("max_ms", "max ms", 10),
    ("jitter_ms", "jitter ms", 10),
    ("gaps", "gaps", 6),
    ("lost", "lost", 6),
    ("repeated", "repeated", 9),
    ("jumps", "jumps", 6),
    ("checksum", "checksum", 9),
    ("code", "code", 5),
    ("length", "length", 7),
)


def summary_of(log: Log, bitrate: int) -> Dict[str, Any]:
    """Everything that the page says; of plain types, so that it becomes JSON as it is."""
    frames = log.frames
    bits = bus_load.frame_bits(frames)
    peak, peak_ns = bus_load.peak_load(frames, bits, bitrate)
    streams = {name: stream_of(decoded) for name, decoded in log.messages.items()}
    rows = statistics_of(samples_of(log))
    sets = {"setpoint": sets_of(log, SETPOINT), "odometry": sets_of(log, ODOMETRY)}
    summary: Dict[str, Any] = {
        "frames": frames.count,
        "interface": frames.interfaces[int(frames.interface[0])],
        "begin_s": log.zero_ns / 1e9,
        "duration_s": int(np.ptp(frames.time_ns)) / 1e9,
        "protocol": {"version": log.protocol.version, "hash": log.protocol.hash},
        "messages": {name: asdict(stream) for name, stream in streams.items() if stream.count},
        "not_seen": [name for name, stream in streams.items() if not stream.count],
        "other": other_kinds(log),
        "other_identifiers": sorted({int(each) for each in frames.identifier[log.is_other]}),
        "load": {
            "bitrate": bitrate,
            "mean": bus_load.mean_load(frames, bits, bitrate),
            "peak": peak,
            "peak_s": (peak_ns - log.zero_ns) / 1e9,
        },
        "sets": {
            name: {
                "complete": each.complete,
                "torn": each.torn,
                "torn_s": log.seconds(np.array(each.torn_ns, dtype=np.int64)).tolist(),
            }
            for name, each in sets.items()
        },
        "answers": results_of(log),
        "unanswered": unanswered(log),
        "vehicle": [asdict(span) for span in vehicle_spans(log)],
        "host": [asdict(span) for span in host_spans(log)],
        "flags": {name: spans for name, spans in flag_spans(log).items() if spans},
        "link": link_counts(log),
        "foreign": foreign_protocols(log),
        "latency": {name: asdict(row) for name, row in rows.items()},
        "notes": frames.notes,
    }
    summary["errors"] = errors_of(summary)
    return summary


def errors_of(summary: Dict[str, Any]) -> List[str]:
    """What should not be in the log of a good flight over a good bus."""
    found = list(summary["foreign"])
    for name, stream in summary["messages"].items():
        counts = {what: stream[key] for key, what in STREAM_ERRORS.items()}
        found += [f"{name}: {count} {what}" for what, count in counts.items() if count]
    if summary["other"].get("error frames"):
        found.append(f"bus: {summary['other']['error frames']} error frames")
    for name, sets in summary["sets"].items():
        found += [f"{name}: {sets['torn']} sets torn"] if sets["torn"] else []
    for name, count in summary["answers"].items():
        found += [f"SP_ACK: {count} {name}"] if name in BAD_RESULTS else []
    if summary["unanswered"]:
        found.append(f"SP_COMMIT: {summary['unanswered']} without an answer")
    for name, count in summary["link"].items():
        station, kind = ("host" if name.startswith("Hl") else "vehicle"), name[2:]
        if count:
            found.append(f"{station}: counted {count} {LINK_ERRORS[kind]} ({name})")
    for span in summary["vehicle"]:
        is_failsafe = span["state"] in FAILSAFE_STATES and span["reason"] not in WANTED
        if span["state"] in BAD_STATES or is_failsafe:
            found.append(f"vehicle: {span['state']} ({span['reason']}) at {span['begin_s']:.3f} s")
    for name, spans in summary["flags"].items():
        if name == "FlagLate":  # nothing is late before the host has begun
            spans = [each for each in spans if _in_flight(each, summary["vehicle"])]
        if spans and name not in HARMLESS_FLAGS:
            found.append(f"vehicle: {name} at {spans[0][0]:.3f} s")
    return found


def _in_flight(span: Any, states: List[Dict[str, Any]]) -> bool:
    begin_s, end_s = span
    return any(
        begin_s < each["end_s"] and end_s > each["begin_s"]
        for each in states
        if each["state"] in FLYING
    )


# --- for reading ---------------------------------------------------------------------------------


def _number(value: Any, digits: int = 3) -> str:
    if isinstance(value, float):
        return f"{value:.{digits}f}"
    return "-" if value is None else str(value)


def _head(name: str, summary: Dict[str, Any]) -> List[str]:
    begin = ""
    if summary["begin_s"] > 86400 * 365:  # else the log has no date
        stamp = datetime.datetime.fromtimestamp(summary["begin_s"], datetime.timezone.utc)
        begin = f", from {stamp:%Y-%m-%d %H:%M:%S} UTC"
    protocol = summary["protocol"]
    return [
        f"{name}: {summary['frames']} frames of {summary['interface']} in "
        f"{summary['duration_s']:.3f} s{begin}",
        f"protocol {protocol['version']}, hash 0x{protocol['hash']:04X}",
        "",
    ]


def _streams(summary: Dict[str, Any]) -> List[str]:
    titles = "".join(f"{title:>{width}}" for _, title, width in COLUMNS)
    lines = [f"{'message':<11}{'frames':>8}{titles}"]
    for name, stream in summary["messages"].items():
        cells = "".join(f"{_number(stream[key]):>{width}}" for key, _, width in COLUMNS)
        lines.append(f"{name:<11}{stream['count']:>8}{cells}")
    if summary["not_seen"]:
        lines.append(f"not seen: {', '.join(summary['not_seen'])}")
    kinds = [f"{count} {kind}" for kind, count in summary["other"].items()]
    if kinds:
        identifiers = [f"{each:X}" for each in summary["other_identifiers"]]
        shown = " ".join(identifiers[:8]) + (" ..." if len(identifiers) > 8 else "")
        lines.append(f"of no message: {', '.join(kinds)} (identifiers {shown})")
    return lines + [""]


def _traffic(summary: Dict[str, Any]) -> List[str]:
    load, sets = summary["load"], summary["sets"]
    mean = "-" if load["mean"] is None else f"{100 * load['mean']:.1f} %"
    answers = [f"{count} {name}" for name, count in summary["answers"].items()]
    setpoint, odometry = (f"{s['complete']} complete, {s['torn']} torn" for s in sets.values())
    return [
        f"bus load at {load['bitrate'] / 1e6:g} Mbit/s: mean {mean}, "
        f"peak {100 * load['peak']:.1f} % in 100 ms (until {load['peak_s']:.3f} s)",
        f"setpoints: {setpoint}; answers: {', '.join(answers) or 'none'}; "
        f"{summary['unanswered']} unanswered",
        f"odometry: {odometry}",
        "",
    ]


def _timeline(title: str, spans: List[Dict[str, Any]]) -> List[str]:
    if not spans:
        return []
    lines = [f"{title:<9}{'at s':>10}{'for s':>10}  state"]
    for span in spans[:MOST_LINES]:
        reason = span["reason"] if span["reason"] not in ("", "NONE") else ""
        duration_s = span["end_s"] - span["begin_s"]
        text = f"{'':<9}{span['begin_s']:>10.3f}{duration_s:>10.3f}  {span['state']:<9} {reason}"
        lines.append(text.rstrip())
    if len(spans) > MOST_LINES:
        lines.append(f"{'':<9}... and {len(spans) - MOST_LINES} more")
    return lines + [""]


def _flags(flags: Dict[str, List[Any]]) -> List[str]:
    lines = []
    for name, spans in flags.items():
        total_s = math.fsum(end_s - begin_s for begin_s, end_s in spans)
        first_s = spans[0][0]
        lines.append(f"{name:<14}{len(spans):>6} times{total_s:>10.3f} s  first at {first_s:.3f} s")
    return [*lines, ""] if lines else []


def page(name: str, summary: Dict[str, Any]) -> str:
    lines = _head(name, summary) + _streams(summary) + _traffic(summary)
    lines += _timeline("vehicle", summary["vehicle"]) + _flags(summary["flags"])
    lines += _timeline("host", summary["host"])
    rows = {key: Statistics(**row) for key, row in summary["latency"].items()}
    lines += [table_text(rows)]
    lines += [f"error: {error}" for error in summary["errors"]] or ["no errors"]
    return "\n".join(lines) + "\n"
