# Copyright 2026 the Understory authors
# SPDX-License-Identifier: BSD-3-Clause
"""Of each message: how often, how regularly, and what its counter says about lost frames."""

from dataclasses import dataclass
from typing import Optional

import numpy as np

from decode import CHECKSUM, CODE, LENGTH, Decoded

MOST_LOST = 2  # in a row; beyond, the receivers too give up counting (can/receiver.hpp)
LONG_PERIODS = 2.5  # a gap is so many times the usual period


@dataclass(frozen=True)
class Stream:
    count: int  # all frames with the identifier, good or bad
    rate_hz: Optional[float] = None
    p50_ms: Optional[float] = None  # periods of good frames that are no repetition
    p99_ms: Optional[float] = None
    max_ms: Optional[float] = None
    jitter_ms: Optional[float] = None  # p99 - p1
    gaps: int = 0
    lost: int = 0
    repeated: int = 0
    jumps: int = 0  # of the counter, by more than MOST_LOST frames
    checksum: int = 0
    code: int = 0
    length: int = 0


def percentiles(values: np.ndarray, percents: tuple) -> list:
    """Of the nearest rank: values that did occur."""
    return [float(value) for value in np.percentile(values, percents, method="inverted_cdf")]


def fresh(decoded: Decoded) -> Decoded:
    """Good frames without those that repeat the counter before them."""
    good = decoded.good()
    steps = np.diff(good.counter, prepend=-1)
    return good.taken(steps != 0)


def stream_of(decoded: Decoded) -> Stream:
    good = decoded.good()
    steps = np.diff(good.counter) & 0xF
    is_lost = (steps > 1) & (steps <= 1 + MOST_LOST)
    bad = {kind: int(np.count_nonzero(decoded.check == kind)) for kind in (CHECKSUM, CODE, LENGTH)}
    errors = {
        "lost": int((steps[is_lost] - 1).sum()),
        "repeated": int(np.count_nonzero(steps == 0)),
        "jumps": int(np.count_nonzero(steps > 1 + MOST_LOST)),
        "checksum": bad[CHECKSUM],
        "code": bad[CODE],
        "length": bad[LENGTH],
    }
    time_ns = fresh(decoded).time_ns
    if len(time_ns) < 2 or time_ns[-1] <= time_ns[0]:
        return Stream(decoded.count, **errors)
    periods_ms = np.diff(time_ns) / 1e6
    p1_ms, p50_ms, p99_ms = percentiles(periods_ms, (1, 50, 99))
    is_gap = periods_ms > LONG_PERIODS * p50_ms
    return Stream(
        decoded.count,
        rate_hz=len(periods_ms) / ((time_ns[-1] - time_ns[0]) / 1e9),
        p50_ms=p50_ms,
        p99_ms=p99_ms,
        max_ms=float(periods_ms.max()),
        jitter_ms=p99_ms - p1_ms,
        gaps=int(np.count_nonzero(is_gap)) if decoded.message.period_ms else 0,
        **errors,
    )
