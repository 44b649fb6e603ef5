# Copyright 2026 the Understory authors
# SPDX-License-Identifier: BSD-3-Clause
"""How long frames take on the wire, bit stuffing included, and how much of the time that fills.

From SOF to the end of the CRC a bit of the other level follows five of one level (ISO 11898-1);
then come 10 bits of delimiters, ACK and EOF, and 3 before the next frame. CAN FD and error frames
are not counted: a log does not tell their length.
"""

from typing import Optional, Tuple

import numpy as np

from frame_log import ERROR, EXTENDED, FD, REMOTE, Frames

CRC15 = 0x4599
TAIL_BITS = 1 + 1 + 1 + 7 + 3  # CRC delimiter, ACK, its delimiter, EOF, intermission
SAME_BITS = 5
CHUNK = 1 << 16
WINDOW_NS = 100_000_000
MOST_WINDOWS = 3000  # more than a picture has columns; time may jump by years, too


def frame_bits(frames: Frames) -> np.ndarray:
    """On the wire; 0 for what is not counted."""
    bits = np.zeros(frames.count, dtype=np.int64)
    kinds = (frames.flags << 4) | np.minimum(frames.length, 15)
    for kind in np.unique(kinds):
        flags, length = int(kind) >> 4, min(int(kind) & 15, 8)
        if flags & (ERROR | FD):
            continue
        of_kind = np.flatnonzero(kinds == kind)
        for at in np.array_split(of_kind, len(of_kind) // CHUNK + 1):
            bits[at] = _bits_of_kind(frames.identifier[at], frames.data[at], flags, length)
    return bits


def _bits_of_kind(identifier, data, flags: int, length: int) -> np.ndarray:
    """Level by level over all frames at once."""
    count = len(identifier)
    crc, last = np.zeros(count, np.int32), np.full(count, 2, np.int8)
    run, stuffed = np.zeros(count, np.int8), np.zeros(count, np.int64)

    def put(level: np.ndarray) -> None:
        nonlocal last, run, stuffed
        run = np.where(level == last, run + 1, 1).astype(np.int8)
        is_full = run == SAME_BITS
        stuffed += is_full
        # The stuffed bit is the first of the next run.
        last = np.where(is_full, 1 - level, level).astype(np.int8)
        run[is_full] = 1

    levels = 0
    for level in _levels(identifier, data, flags, length):
        put(level)
        levels += 1
        feedback = level ^ ((crc >> 14) & 1)
        crc = ((crc << 1) & 0x7FFF) ^ (feedback * CRC15)
    for bit in range(14, -1, -1):
        put(((crc >> bit) & 1).astype(np.int8))
    return stuffed + levels + 15 + TAIL_BITS


def _levels(identifier, data, flags: int, length: int):
    """From SOF to the end of the data, dominant is 0."""

    def constant(level: int) -> np.ndarray:
        return np.full(len(identifier), level, np.int8)

    def of_identifier(high: int, low: int):
        for bit in range(high, low - 1, -1):
            yield ((identifier >> bit) & 1).astype(np.int8)

    remote = int(bool(flags & REMOTE))
    yield constant(0)
    if flags & EXTENDED:
        yield from of_identifier(28, 18)
        yield from (constant(1), constant(1))  # SRR, IDE
        yield from of_identifier(17, 0)
        yield from (constant(remote), constant(0), constant(0))
    else:
        yield from of_identifier(10, 0)
        yield from (constant(remote), constant(0), constant(0))
    yield from (constant((length >> bit) & 1) for bit in (3, 2, 1, 0))
    for byte in range(0 if remote else length):
        for bit in range(7, -1, -1):
            yield ((data >> np.uint64(8 * byte + bit)) & np.uint64(1)).astype(np.int8)


def mean_load(frames: Frames, bits: np.ndarray, bitrate: int) -> Optional[float]:
    """Part of the time, 0 to 1; nothing for a log without duration."""
    duration_ns = int(np.ptp(frames.time_ns))
    # The last frame fills time after the log's last stamp.
    return float(bits[:-1].sum()) / bitrate / (duration_ns / 1e9) if duration_ns else None


def peak_load(frames: Frames, bits: np.ndarray, bitrate: int) -> Tuple[float, int]:
    """In the fullest 100 ms that end with a frame; and when they end."""
    order = np.argsort(frames.time_ns, kind="stable")
    time_ns, sums = frames.time_ns[order], np.concatenate([[0], np.cumsum(bits[order])])
    before = np.searchsorted(time_ns, time_ns - WINDOW_NS, side="right")
    in_window = sums[1:] - sums[before]
    at = int(np.argmax(in_window))
    return float(in_window[at]) / bitrate / (WINDOW_NS / 1e9), int(time_ns[at])


def window_of(frames: Frames) -> int:
    """100 ms, or more when the log is so long that there would be too many."""
    return max(WINDOW_NS, int(np.ptp(frames.time_ns)) // MOST_WINDOWS)


def load_over_time(frames: Frames, bits: np.ndarray, at: np.ndarray, bitrate: int) -> np.ndarray:
    """Load by the frames at these positions, in each window from the log's begin on."""
    window_ns, begin_ns = window_of(frames), int(frames.time_ns.min())
    count = int(np.ptp(frames.time_ns)) // window_ns + 1
    place = (frames.time_ns[at] - begin_ns) // window_ns
    return np.bincount(place, weights=bits[at], minlength=count) / bitrate / (window_ns / 1e9)
