# Copyright 2026 the Understory authors
# SPDX-License-Identifier: BSD-3-Clause
"""The frames between the provider on the host and the agent inside: one byte kind, length, payload.

One serial line carries all of it, so that standard output and error stay apart and binary clean,
and signals, end of input and the exit status need no line of their own.
"""

import struct
from typing import List, Tuple

READY, START, EXIT, FAILED = b"R", b"S", b"X", b"F"
INPUT, TAKEN = b"0", b"T"  # INPUT without payload: end of input; TAKEN: bytes the command took
OUTPUT, ERRORS = b"1", b"2"
RECEIVED = b"A"  # bytes that the agent read from the line
SIGNAL, SIZE = b"K", b"W"
CLOSED = b"C"  # nobody reads this output (its kind is the payload) any more

CHUNK = 16384
# So much input may be under way: a command that reads nothing must not hold up a signal.
INPUT_WINDOW = 65536
# User-Mode Linux never wakes up a serial line again once its buffer of 4096 bytes was full.
LINE_WINDOW = 2048

_HEADER = struct.Struct(">cI")
_NUMBER = struct.Struct(">i")


def encode(kind: bytes, payload: bytes = b"") -> bytes:
    return _HEADER.pack(kind, len(payload)) + payload


def encode_number(kind: bytes, number: int) -> bytes:
    return encode(kind, _NUMBER.pack(number))


def number_of(payload: bytes) -> int:
    return int(_NUMBER.unpack(payload)[0])


class Decoder:
    """Cuts a stream into frames, whatever pieces it comes in."""

    def __init__(self) -> None:
        self._bytes = bytearray()

    def feed(self, data: bytes) -> List[Tuple[bytes, bytes]]:
        self._bytes += data
        frames, at = [], 0
        while len(self._bytes) - at >= _HEADER.size:
            kind, length = _HEADER.unpack_from(self._bytes, at)
            begin, end = at + _HEADER.size, at + _HEADER.size + length
            if len(self._bytes) < end:
                break
            frames.append((kind, bytes(self._bytes[begin:end])))
            at = end
        del self._bytes[:at]
        return frames
