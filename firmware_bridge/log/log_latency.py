# Copyright 2026 the Understory authors
# SPDX-License-Identifier: BSD-3-Clause
"""How long things took on the bus, from the log's stamps and the clocks inside the frames.

    commit_to_ack     SP_COMMIT -> SP_ACK of its SpSeq
    ack_delay         SpTime -> setpoint flown, by the vehicle's clock: AckDelay
    setpoint_period   SP_COMMIT -> the next one
    odometry_period   ODO_RATE -> the next one
    ping_to_pong      PING -> PONG of its PingSeq
    pong_delay        PING arrived -> PONG sent, by the vehicle's clock: PongDt
    setpoint_age      SpTime -> its frame
    odometry_age      OdoTime -> its frame

SpTime and OdoTime are of the vehicle's clock. What that is in the log's time is known from PONG, as
if there and back took equally long; of 16 neighbours the quickest counts. The error of an age is at
most half of what that one took.
"""

import csv
import io
from dataclasses import astuple, dataclass, fields
from typing import Dict, List, Optional, Tuple

import numpy as np

from decode import Decoded, Log
from streams import fresh, percentiles

WRAP_US = 1 << 24  # clocks in frames
ANSWER_NS = 500_000_000  # an answer that is later belongs to another question of the same number
NEIGHBOURS = 16
FLOWN = 0


@dataclass(frozen=True)
class Samples:
    time_ns: np.ndarray  # when each ended, by the log's stamps
    value_ms: np.ndarray


@dataclass(frozen=True)
class Statistics:
    """Percentiles are of the nearest rank: durations that did occur."""

    count: int
    p1_ms: Optional[float] = None
    p50_ms: Optional[float] = None
    p90_ms: Optional[float] = None
    p99_ms: Optional[float] = None
    max_ms: Optional[float] = None


MEASURES = tuple(column.name for column in fields(Statistics) if column.name != "count")


def answers_of(
    questions: Decoded, question_key: str, answers: Decoded, answer_key: str
) -> Tuple[np.ndarray, np.ndarray]:
    """Positions of questions and of the first answer to each, within ANSWER_NS."""
    time_ns = np.concatenate([questions.time_ns, answers.time_ns])
    index = np.concatenate([questions.index, answers.index])
    keys = np.concatenate([questions.codes[question_key], answers.codes[answer_key]])
    is_answer = np.arange(len(time_ns)) >= questions.count
    order = np.lexsort((index, keys))
    before, after = order[:-1], order[1:]
    match = is_answer[after] & ~is_answer[before] & (keys[after] == keys[before])
    match &= time_ns[after] - time_ns[before] <= ANSWER_NS
    of_question, of_answer = before[match], after[match] - questions.count
    by_time = np.argsort(of_question)
    return of_question[by_time], of_answer[by_time]


def _round_trip(log: Log, names: Tuple[str, str], keys: Tuple[str, str]) -> Samples:
    questions, answers = fresh(log[names[0]]), fresh(log[names[1]])
    asked, answered = answers_of(questions, keys[0], answers, keys[1])
    end_ns = answers.time_ns[answered]
    return Samples(end_ns, (end_ns - questions.time_ns[asked]) / 1e6)


def _periods(log: Log, name: str) -> Samples:
    time_ns = fresh(log[name]).time_ns
    return Samples(time_ns[1:], np.diff(time_ns) / 1e6)


def _of_signal(decoded: Decoded, name: str) -> Samples:
    return Samples(decoded.time_ns, decoded.codes[name] / 1e3)


class VehicleClock:
    """The vehicle's clock over the log's time, in microseconds, as frames have it: wrapped."""

    def __init__(self, log: Log):
        pings, pongs = fresh(log["PING"]), fresh(log["PONG"])
        asked, answered = answers_of(pings, "PingSeq", pongs, "PongSeq")
        self.time_us = pings.time_ns[asked] / 1e3
        pongs = pongs.taken(answered)
        way_us = (pongs.time_ns / 1e3 - self.time_us - pongs.codes["PongDt"]) / 2
        ahead_us = pongs.codes["PongT2"] - self.time_us - way_us
        if len(ahead_us):
            # Unwrapped about the first, so that neighbours can be compared.
            ahead_us = ahead_us[0] + _wrapped(ahead_us - ahead_us[0])
            ahead_us = ahead_us[_quickest(way_us)]
        self.ahead_us = ahead_us

    def age_ms(self, time_ns: np.ndarray, clock_us: np.ndarray) -> np.ndarray:
        """What has passed since the vehicle's clock was so, at the log's times."""
        now_us = time_ns / 1e3 + np.interp(time_ns / 1e3, self.time_us, self.ahead_us)
        return _wrapped(now_us - clock_us) / 1e3


def _quickest(way_us: np.ndarray) -> np.ndarray:
    """For each position that of the smallest among its NEIGHBOURS."""
    half = NEIGHBOURS // 2
    padded = np.pad(way_us, (half, half - 1), constant_values=np.inf)
    windows = np.lib.stride_tricks.sliding_window_view(padded, NEIGHBOURS)
    return np.arange(len(way_us)) - half + windows.argmin(axis=1)


def _wrapped(difference_us: np.ndarray) -> np.ndarray:
    return (difference_us + WRAP_US / 2) % WRAP_US - WRAP_US / 2


def _ages(log: Log, clock: VehicleClock, message: str, signal: str) -> Samples:
    decoded = fresh(log[message])
    if not len(clock.time_us):
        return Samples(np.empty(0, np.int64), np.empty(0))
    return Samples(decoded.time_ns, clock.age_ms(decoded.time_ns, decoded.codes[signal]))


def samples_of(log: Log) -> Dict[str, Samples]:
    """By row, in the order of the table; also rows without samples."""
    acks, pongs, clock = fresh(log["SP_ACK"]), fresh(log["PONG"]), VehicleClock(log)
    flown = acks.taken(acks.codes["AckResult"] == FLOWN)
    return {
        "commit_to_ack": _round_trip(log, ("SP_COMMIT", "SP_ACK"), ("SpSeq", "AckSeq")),
        "ack_delay": _of_signal(flown, "AckDelay"),
        "setpoint_period": _periods(log, "SP_COMMIT"),
        "odometry_period": _periods(log, "ODO_RATE"),
        "ping_to_pong": _round_trip(log, ("PING", "PONG"), ("PingSeq", "PongSeq")),
        "pong_delay": _of_signal(pongs, "PongDt"),
        "setpoint_age": _ages(log, clock, "SP_POS_Z", "SpTime"),
        "odometry_age": _ages(log, clock, "ODO_POS_Z", "OdoTime"),
    }


def statistics_of(samples: Dict[str, Samples]) -> Dict[str, Statistics]:
    return {name: _statistics(row.value_ms) for name, row in samples.items()}


def _statistics(value_ms: np.ndarray) -> Statistics:
    if not len(value_ms):
        return Statistics(0)
    return Statistics(len(value_ms), *percentiles(value_ms, (1, 50, 90, 99, 100)))


def unanswered(log: Log) -> int:
    """Setpoints without an answer, but for those before the vehicle is there or the log's end."""
    commits, acks = fresh(log["SP_COMMIT"]), fresh(log["SP_ACK"])
    asked, _ = answers_of(commits, "SpSeq", acks, "AckSeq")
    has_answer = np.zeros(commits.count, dtype=bool)
    has_answer[asked] = True
    is_early = commits.time_ns < log.frames.time_ns.max() - ANSWER_NS
    is_heard = commits.time_ns > (acks.time_ns[0] if acks.count else 0)
    return int(np.count_nonzero(is_early & is_heard & ~has_answer))


def table_text(statistics: Dict[str, Statistics]) -> str:
    width = max(len(name) for name in statistics)
    titles = "".join(f"{name[:-3] + ' ms':>11}" for name in MEASURES)
    lines = [f"{'latency':<{width}}{'count':>9}{titles}"]
    for name, row in statistics.items():
        count, *values_ms = astuple(row)
        cells = "".join(f"{'-' if ms is None else format(ms, '.3f'):>11}" for ms in values_ms)
        lines.append(f"{name:<{width}}{count:>9}{cells}")
    return "\n".join(lines) + "\n"


def table_csv(statistics: Dict[str, Statistics]) -> str:
    """What a row without samples has no value for is empty."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(["latency", "count", *MEASURES])
    for name, row in statistics.items():
        count, *values_ms = astuple(row)
        writer.writerow([name, count, *("" if ms is None else f"{ms:.6f}" for ms in values_ms)])
    return text.getvalue()


def samples_csv(log: Log, samples: Dict[str, Samples]) -> str:
    lines: List[str] = ["latency,time_s,value_ms"]
    for name, row in samples.items():
        times_s = log.seconds(row.time_ns)
        lines += [
            f"{name},{time_s:.6f},{value_ms:.6f}"
            for time_s, value_ms in zip(times_s.tolist(), row.value_ms.tolist())
        ]
    return "\n".join(lines) + "\n"
