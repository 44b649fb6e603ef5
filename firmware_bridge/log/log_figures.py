# Copyright 2026 the Understory authors
# SPDX-License-Identifier: BSD-3-Clause
"""Pictures of a log: what was wanted and what was flown, states, latency, load, power."""

import sys
from pathlib import Path
from typing import Callable, Dict, Iterator, List, Tuple

import numpy as np

# The look of all our figures; in the sources below src, else beside us as catkin installs packages.
for parent in ("src", "."):
    folder = Path(__file__).resolve().parents[2] / parent / "understory_sim" / "report"
    sys.path.append(str(folder))
from look import BLUE, GREEN, GRID, INK, MUTED, ORANGE, PINK, RED, SKY, STYLE  # noqa: E402
from matplotlib import pyplot  # noqa: E402
from matplotlib.figure import Figure  # noqa: E402
from matplotlib.patches import Patch  # noqa: E402

import bus_load  # noqa: E402
from decode import Log  # noqa: E402
from log_latency import samples_of, statistics_of  # noqa: E402
from sets import ODOMETRY, SETPOINT  # noqa: E402
from states import HARMLESS_FLAGS, Span, flag_spans, host_spans, vehicle_spans  # noqa: E402

GREY = "#9aa1a9"
VEHICLE_COLOURS = {
    "INIT": GRID, "DISARMED": GREY, "ARMING": SKY, "ARMED": GREEN, "HOLD": ORANGE, "LAND": BLUE,
    "KILLED": RED, "FAULT": RED,
}
HOST_COLOURS = {
    "WAITING": GREY, "READY": SKY, "ARMING": SKY, "FLYING": GREEN, "HOLDING": ORANGE,
    "LANDING": BLUE, "FAULT": RED,
}
GROUPS = {"setpoints": SETPOINT + ("SP_ACK",), "odometry": ODOMETRY, "ESCs": ("ESC_CMD", "ESC_RPM")}
GROUP_COLOURS = {"setpoints": BLUE, "odometry": GREEN, "ESCs": ORANGE, "other messages": PINK,
                 "not ours": GREY}
ESC_COLOURS = (BLUE, ORANGE, GREEN, PINK)
HISTOGRAMS = (
    ("commit_to_ack", "SP_COMMIT to SP_ACK", BLUE),
    ("ack_delay", "SpTime to setpoint flown (AckDelay)", GREEN),
    ("setpoint_period", "period of setpoints", ORANGE),
    ("ping_to_pong", "PING to PONG", PINK),
)


def _series(log: Log, message: str, signal: str) -> Tuple[np.ndarray, np.ndarray]:
    """Good frames; a gap in the data is a gap in the line."""
    decoded = log[message].good()
    times_s, values = log.seconds(decoded.time_ns), decoded.physical(signal)
    if len(times_s) < 2:
        return times_s, values
    periods_s = np.diff(times_s)
    at = np.flatnonzero(periods_s > max(10 * float(np.median(periods_s)), 0.1)) + 1
    return np.insert(times_s, at, times_s[at - 1]), np.insert(values, at, np.nan)


def _speed(log: Log, message: str, names: Tuple[str, ...]) -> Tuple[np.ndarray, np.ndarray]:
    parts = [_series(log, message, name) for name in names]
    return parts[0][0], np.sqrt(sum(values**2 for _, values in parts))


def _shade(axes, spans: List[Span]) -> None:
    for span in spans:
        colour = VEHICLE_COLOURS.get(span.state, GREY)
        axes.axvspan(span.begin_s, span.end_s, color=colour, alpha=0.12, linewidth=0)


def _state_legend(spans: List[Span]) -> List[Patch]:
    states = dict.fromkeys(span.state for span in spans)
    return [Patch(color=VEHICLE_COLOURS.get(s, GREY), alpha=0.3, label=s.lower()) for s in states]


def _finish(figure: Figure, axes, log: Log) -> Figure:
    axes.set_xlabel("time since the log's begin, s")
    axes.set_xlim(0, max(float(np.ptp(log.frames.time_ns)) / 1e9, 0.001))
    return figure


def _or_nothing(axes, text: str) -> None:
    if not axes.lines and not axes.patches and not axes.collections:
        axes.text(0.5, 0.5, text, transform=axes.transAxes, ha="center", va="center", color=MUTED)


def draw_tracking(log: Log) -> Figure:
    figure, rows = pyplot.subplots(4, 1, figsize=(9, 8.4), sharex=True, layout="constrained")
    spans = vehicle_spans(log)
    pairs = [
        ("x, m", _series(log, "SP_POS_XY", "SpX"), _series(log, "ODO_POS_XY", "OdoX")),
        ("y, m", _series(log, "SP_POS_XY", "SpY"), _series(log, "ODO_POS_XY", "OdoY")),
        ("z, m", _series(log, "SP_POS_Z", "SpZ"), _series(log, "ODO_POS_Z", "OdoZ")),
        (
            "speed, m/s",
            _speed(log, "SP_VEL", ("SpVx", "SpVy", "SpVz")),
            _speed(log, "ODO_VEL", ("OdoVx", "OdoVy", "OdoVz")),
        ),
    ]
    for axes, (title, setpoint, odometry) in zip(rows, pairs):
        axes.plot(*odometry, color=BLUE, linewidth=1.6, label="odometry")
        axes.plot(*setpoint, color=RED, linewidth=1.2, linestyle=(0, (4, 2)), label="setpoint")
        _shade(axes, spans)
        axes.set_ylabel(title)
    handles = [*rows[0].lines[::-1], *_state_legend(spans)]
    rows[0].set_title("Setpoints and odometry")
    rows[0].legend(
        handles=handles, loc="lower right", bbox_to_anchor=(1, 1), ncols=6, borderaxespad=0.2
    )
    return _finish(figure, rows[-1], log)


def draw_states(log: Log) -> Figure:
    vehicle, host = vehicle_spans(log), host_spans(log)
    flags = {name: spans for name, spans in flag_spans(log).items() if spans}
    height = 2 + len(flags)
    figure, axes = pyplot.subplots(figsize=(9, 1.4 + 0.36 * height), layout="constrained")
    duration_s = max(float(np.ptp(log.frames.time_ns)) / 1e9, 0.001)
    for row, spans, colours in ((0, vehicle, VEHICLE_COLOURS), (1, host, HOST_COLOURS)):
        for span in spans:
            width_s = max(span.duration_s, 0.002 * duration_s)
            axes.barh(row, width_s, left=span.begin_s, color=colours.get(span.state, GREY))
            if width_s > 0.09 * duration_s:
                reason = span.reason if span.reason not in ("", "NONE") else ""
                is_wide = reason and width_s > 0.2 * duration_s
                text = f"{span.state}\n{reason}" if is_wide else span.state
                axes.text(
                    span.begin_s + width_s / 2, row, text.lower(), ha="center", va="center",
                    fontsize=7, color=INK,
                )
    for row, (name, spans) in enumerate(flags.items(), start=2):
        colour = SKY if name in HARMLESS_FLAGS else RED
        for begin_s, end_s in spans:
            width_s = max(end_s - begin_s, 0.002 * duration_s)
            axes.barh(row, width_s, left=begin_s, height=0.5, color=colour)
    axes.set_yticks(range(height), ["vehicle", "host", *flags])
    axes.set_ylim(height - 0.5, -0.5)
    axes.grid(axis="y", visible=False)
    axes.set_title("States and flags")
    _or_nothing(axes, "no VEH_STATE in the log")
    return _finish(figure, axes, log)


def draw_latency(log: Log) -> Figure:
    figure, grid = pyplot.subplots(2, 2, figsize=(9, 5.6), layout="constrained")
    samples = samples_of(log)
    statistics = statistics_of(samples)
    for axes, (name, title, colour) in zip(grid.flat, HISTOGRAMS):
        values_ms, row = samples[name].value_ms, statistics[name]
        axes.set_title(title, fontsize=10, pad=17)
        axes.set_xlabel("ms")
        if not row.count:
            _or_nothing(axes, "none in the log")
            continue
        # The few that are far out are counted in the title of the axis, not drawn.
        low_ms, high_ms = np.percentile(values_ms, [0.1, 99.5])
        margin_ms = 0.1 * (high_ms - low_ms) + 0.01
        edges = np.linspace(max(low_ms - margin_ms, 0), high_ms + margin_ms, 60)
        axes.hist(values_ms, edges, color=colour)
        outside = int(np.count_nonzero((values_ms < edges[0]) | (values_ms > edges[-1])))
        axes.set_xlabel(f"ms; {outside} of {row.count} are outside" if outside else "ms")
        text = f"p50 {row.p50_ms:.3f}, p99 {row.p99_ms:.3f}, max {row.max_ms:.3f} ms"
        axes.text(0, 1.02, text, transform=axes.transAxes, fontsize=8.5, color=INK)
        for value_ms, style in ((row.p50_ms, "-"), (row.p99_ms, "--")):
            axes.axvline(value_ms, color=INK, linewidth=0.9, linestyle=style)
    figure.suptitle("Latency on the bus", x=0.01, ha="left", fontweight="bold", fontsize=11)
    return figure


def draw_load(log: Log, bitrate: int) -> Figure:
    frames = log.frames
    bits = bus_load.frame_bits(frames)
    grouped = {name for names in GROUPS.values() for name in names}
    members = {
        **{group: [log[name].index for name in names] for group, names in GROUPS.items()},
        "other messages": [d.index for name, d in log.messages.items() if name not in grouped],
        "not ours": [np.flatnonzero(log.is_other)],
    }
    layers = {}
    for group, parts in members.items():
        index = np.concatenate(parts)
        layers[group] = 100 * bus_load.load_over_time(frames, bits, index, bitrate)
    layers = {group: values for group, values in layers.items() if values.any()}
    figure, axes = pyplot.subplots(figsize=(9, 3.6), layout="constrained")
    window_s = bus_load.window_of(frames) / 1e9
    edges_s = np.arange(len(next(iter(layers.values()), [])) + 1) * window_s
    below = np.zeros(max(len(edges_s) - 1, 0))
    for group, values in layers.items():
        axes.stairs(below + values, edges_s, baseline=below, fill=True, label=group,
                    color=GROUP_COLOURS[group])
        below = below + values
    mean = bus_load.mean_load(frames, bits, bitrate)
    peak, _ = bus_load.peak_load(frames, bits, bitrate)
    shown = "" if mean is None else f": mean {100 * mean:.1f} %, peak {100 * peak:.1f} %"
    axes.set_title(f"Load of the bus at {bitrate / 1e6:g} Mbit/s{shown}")
    axes.set_ylabel(f"% of {1000 * window_s:.0f} ms")
    axes.set_ylim(0, max(1.25 * float(below.max(initial=0.0)), 1.0))
    axes.legend(loc="upper right", ncols=5)
    return _finish(figure, axes, log)


def _panel(axes, title: str, lines: List[Tuple[str, Tuple[np.ndarray, np.ndarray], str]]) -> None:
    for label, (times_s, values), colour in lines:
        if len(times_s):
            axes.plot(times_s, values, color=colour, linewidth=1.4, label=label)
    axes.set_ylabel(title)
    _or_nothing(axes, "none in the log")


def draw_power(log: Log) -> Figure:
    figure, rows = pyplot.subplots(5, 1, figsize=(9, 9), sharex=True, layout="constrained")

    def of_escs(message: str, signal: str) -> List[Tuple[str, Tuple[np.ndarray, np.ndarray], str]]:
        return [
            (f"ESC {esc}", _series(log, message.format(esc), signal.format(esc)), colour)
            for esc, colour in enumerate(ESC_COLOURS)
        ]

    rows[0].set_title("Battery and ESCs")
    _panel(rows[0], "battery, V", [("V", _series(log, "BATTERY", "BattVolt"), BLUE)])
    charge = [("%", _series(log, "BATTERY", "BattSoc"), GREEN)]
    _panel(rows[1], "charge, %", charge)
    current = [("battery", _series(log, "BATTERY", "BattCurr"), INK)]
    _panel(rows[2], "current, A", current + of_escs("ESC_STAT{}", "EscCurr{}"))
    if rows[2].lines:  # the colours are the same below
        rows[2].legend(loc="lower right", bbox_to_anchor=(1, 1), ncols=5, borderaxespad=0.2)
    _panel(rows[3], "rpm", of_escs("ESC_RPM", "EscRpm{}"))
    _panel(rows[4], "ESC, °C", of_escs("ESC_STAT{}", "EscTemp{}"))
    return _finish(figure, rows[-1], log)


def figures(log: Log, bitrate: int) -> Iterator[Tuple[str, Callable[[], Figure]]]:
    """File names and what draws them."""
    drawers: Dict[str, Callable[[], Figure]] = {
        "setpoints.png": lambda: draw_tracking(log),
        "states.png": lambda: draw_states(log),
        "latency.png": lambda: draw_latency(log),
        "bus_load.png": lambda: draw_load(log, bitrate),
        "power.png": lambda: draw_power(log),
    }
    yield from drawers.items()


def save(draw: Callable[[], Figure], path: Path) -> None:
    with pyplot.rc_context(STYLE):
        figure = draw()
        # Without the version note, the same log gives the same bytes.
        figure.savefig(path, format="png", metadata={"Software": None})
        pyplot.close(figure)
