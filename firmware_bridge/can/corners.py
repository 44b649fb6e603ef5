#!/usr/bin/python3
# Copyright 2026 the Understory authors
# SPDX-License-Identifier: BSD-3-Clause
"""Frames with which decoders are held against each other: codes at the borders, and random ones.

Of every signal: lowest and highest legal code, just outside of both, "not available", zero, lowest
and highest of all codes. The others are random meanwhile. Always the same for the same seed.

usage: corners.py DBC RANDOM_FRAMES     prints them in candump's notation
"""

import random
import sys
from pathlib import Path
from typing import Iterable, Iterator, List, NamedTuple

from dbc import Message, Signal, frame_bytes, read_messages


class Corner(NamedTuple):
    message: Message
    counter: int
    raws: List[int]  # by signal
    data: bytes

    @property
    def candump(self) -> str:
        return f"{self.message.id:03X}#{self.data.hex().upper()}"

    @property
    def is_legal(self) -> bool:
        return all(is_legal(signal, raw) for signal, raw in zip(self.message.signals, self.raws))


def all_codes(signal: Signal) -> range:
    low = signal.not_available if signal.is_signed else 0
    return range(low, low + (1 << signal.size))


def is_legal(signal: Signal, raw: int) -> bool:
    low, high = signal.raw_range
    return signal.is_whole or raw == signal.not_available or low <= raw <= high


def corner_codes(signal: Signal) -> List[int]:
    codes, (low, high) = all_codes(signal), signal.raw_range
    wanted = {low - 1, low, low + 1, high - 1, high, high + 1, 0, 1, -1, signal.not_available}
    return sorted(code for code in wanted | {codes[0], codes[-1]} if code in codes)


def physical_value(signal: Signal, raw: int) -> float:
    """NaN: not available."""
    if not signal.is_whole and raw == signal.not_available:
        return float("nan")
    return raw * signal.factor + signal.offset


def corner_frames(
    messages: Iterable[Message], random_count: int, seed: int = 20261122
) -> Iterator[Corner]:
    """For each message its corners and so many random frames, half of them legal."""
    rng = random.Random(seed)

    def some_code(signal: Signal, has_to_be_legal: bool) -> int:
        codes, (low, high) = all_codes(signal), signal.raw_range
        if has_to_be_legal and not signal.is_whole:
            return rng.randint(low, high)
        return rng.randint(codes[0], codes[-1])

    def frame(message: Message, raws: List[int]) -> Corner:
        counter = rng.randrange(16)
        return Corner(message, counter, raws, frame_bytes(message, raws, counter))

    for message in messages:
        signals = message.signals
        for at, signal in enumerate(signals):
            for code in corner_codes(signal):
                raws = [some_code(each, True) for each in signals]
                raws[at] = code
                yield frame(message, raws)
        for number in range(random_count):
            yield frame(message, [some_code(each, number % 2 == 0) for each in signals])


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    for corner in corner_frames(read_messages(Path(sys.argv[1]))[1], int(sys.argv[2])):
        print(corner.candump)
