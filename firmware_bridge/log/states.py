# Copyright 2026 the Understory authors
# SPDX-License-Identifier: BSD-3-Clause
"""What both stations said of themselves over time: states with reasons, flags, link counters."""

from dataclasses import dataclass
from typing import Dict, List, Tuple

import numpy as np

from decode import Decoded, Log, Signal, code_name, flag_signals

HARMLESS_FLAGS = ("FlagSetpoints", "FlagHost", "FlagOnGround", "FlagDirect")


@dataclass(frozen=True)
class Span:
    """One state, from the first frame that says so to the first that says another."""

    begin_s: float
    end_s: float
    state: str
    reason: str = ""

    @property
    def duration_s(self) -> float:
        return self.end_s - self.begin_s


def _signal(decoded: Decoded, name: str) -> Signal:
    return next(signal for signal in decoded.message.signals if signal.dbc_name == name)


def name_of(signal: Signal, code: int) -> str:
    return code_name(signal, code) or f"code {code}"


def spans_of(log: Log, message: str, state: str, reason: str = "") -> List[Span]:
    decoded = log[message].good()
    if not decoded.count:
        return []
    times_s = log.seconds(decoded.time_ns)
    keys = decoded.codes[state] * 1000 + (decoded.codes[reason] if reason else 0)
    starts = np.flatnonzero(np.diff(keys, prepend=-1))
    ends_s = [*times_s[starts[1:]], times_s[-1]]
    return [
        Span(
            float(times_s[start]),
            float(end_s),
            name_of(_signal(decoded, state), decoded.codes[state][start]),
            name_of(_signal(decoded, reason), decoded.codes[reason][start]) if reason else "",
        )
        for start, end_s in zip(starts, ends_s)
    ]


def vehicle_spans(log: Log) -> List[Span]:
    return spans_of(log, "VEH_STATE", "State", "StateReason")


def host_spans(log: Log) -> List[Span]:
    return spans_of(log, "HOST_HB", "HostState")


def flag_spans(log: Log) -> Dict[str, List[Tuple[float, float]]]:
    """When each flag was set: from, to; flags that never were have none."""
    decoded = log["VEH_STATE"].good()
    times_s = log.seconds(decoded.time_ns)
    found = {}
    for signal in flag_signals(decoded.message):
        edges = np.diff(decoded.codes[signal.dbc_name], prepend=0)
        begins_s = times_s[edges == 1].tolist()
        ends_s = times_s[edges == -1].tolist()
        if len(ends_s) < len(begins_s):
            ends_s.append(float(times_s[-1]))
        found[signal.dbc_name] = list(zip(begins_s, ends_s))
    return found


def link_counts(log: Log) -> Dict[str, int]:
    """By how much the stations' own counters of errors grew; they wrap at 256."""
    found = {}
    for message in ("HOST_LINK", "VEH_LINK"):
        decoded = log[message].good()
        for signal in decoded.message.signals:
            if signal.size == 8 and decoded.count:
                codes = decoded.codes[signal.dbc_name]
                found[signal.dbc_name] = int((np.diff(codes) & 0xFF).sum())
    return found


def foreign_protocols(log: Log) -> List[str]:
    """Stations whose heartbeat names another protocol than the DBC that decodes the log."""
    major = int(log.protocol.version.split(".", maxsplit=1)[0])
    found = []
    for message, prefix in (("HOST_HB", "Host"), ("VEH_HB", "Veh")):
        codes = log[message].good().codes
        pairs = {*zip(codes[f"{prefix}ProtoMajor"].tolist(), codes[f"{prefix}DbcHash"].tolist())}
        for other, other_hash in sorted(pairs - {(major, log.protocol.hash)}):
            found.append(
                f"{message} says protocol {other}, hash 0x{other_hash:04X}: this DBC is protocol "
                f"{major}, hash 0x{log.protocol.hash:04X}"
            )
    return found


def results_of(log: Log) -> Dict[str, int]:
    """How often the vehicle answered what to a setpoint."""
    decoded = log["SP_ACK"].good()
    signal = _signal(decoded, "AckResult")
    codes, counts = np.unique(decoded.codes["AckResult"], return_counts=True)
    return {name_of(signal, code): int(count) for code, count in zip(codes.tolist(), counts)}
