# Copyright 2026 the Understory authors
# SPDX-License-Identifier: BSD-3-Clause
"""Which setpoints and odometries were complete, by the receivers' rules (can/set_assembly.hpp)."""

from dataclasses import dataclass
from typing import List, Sequence

import numpy as np

from decode import Log
from streams import fresh

SETPOINT = ("SP_POS_XY", "SP_POS_Z", "SP_VEL", "SP_ACC", "SP_COMMIT")
ODOMETRY = ("ODO_POS_XY", "ODO_POS_Z", "ODO_VEL", "ODO_ATT", "ODO_RATE")
WINDOW_NS = 20_000_000
NEWEST = 8  # counters so far ahead are newer, the others lag behind


@dataclass(frozen=True)
class Sets:
    complete: int
    torn: int
    torn_ns: List[int]  # when each torn one began


def sets_of(log: Log, names: Sequence[str]) -> Sets:
    """A set that was under way when the log began or ended is neither complete nor torn."""
    parts = [fresh(log[name]) for name in names]
    time_ns = np.concatenate([part.time_ns for part in parts])
    index = np.concatenate([part.index for part in parts])
    counters = np.concatenate([part.counter for part in parts])
    bits = np.concatenate([np.full(part.count, 1 << at) for at, part in enumerate(parts)])
    order = np.argsort(index)
    rows = zip(time_ns[order].tolist(), counters[order].tolist(), bits[order].tolist())
    complete, torn_ns = _assemble(rows, (1 << len(names)) - 1)
    if torn_ns and torn_ns[0] == int(time_ns.min()) and _begins_late(log, names):
        torn_ns = torn_ns[1:]
    return Sets(complete, len(torn_ns), torn_ns)


def _assemble(rows, everything: int):
    complete, torn_ns = 0, []
    current, begun_ns, have = -1, 0, 0  # have is everything: done
    for now_ns, counter, bit in rows:
        is_over = now_ns - begun_ns > WINDOW_NS
        if current >= 0 and (counter != current or is_over):
            if counter != current and (counter - current) % 16 > NEWEST and not is_over:
                continue  # of a set that was given up
            if have != everything:
                torn_ns.append(begun_ns)
            current = -1
        if current < 0:
            current, begun_ns, have = counter, now_ns, 0
        if have != everything:
            have |= bit
            complete += have == everything
    return complete, torn_ns


def _begins_late(log: Log, names: Sequence[str]) -> bool:
    """Whether a set's earlier parts may have passed before the log began."""
    first = min(int(log[name].time_ns[0]) for name in names if log[name].count)
    return first - int(log.frames.time_ns.min()) < WINDOW_NS
