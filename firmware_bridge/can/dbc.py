# Copyright 2026 the Understory authors
# SPDX-License-Identifier: BSD-3-Clause
"""The DBC, the single source of the bus, read and checked; and its frames, without the C++ code.

What generates from the DBC and what decodes logs both start here. Any violation of the protocol's
layout rules raises LayoutError with one line.
"""

import contextlib
import io
import re
import zlib
from pathlib import Path
from typing import Dict, Iterable, Iterator, List, Sequence, Tuple

quiet = io.StringIO()  # it talks about formats it does not know
with contextlib.redirect_stdout(quiet), contextlib.redirect_stderr(quiet):
    import canmatrix.formats

CRC_POLYNOMIAL, CRC_INITIAL, CRC_FINAL = 0x2F, 0xFF, 0xFF
UNITS = {
    "m": "m",
    "m/s": "mps",
    "m/s2": "mps2",
    "rad": "rad",
    "rad/s": "radps",
    "us": "us",
    "s": "s",
    "V": "v",
    "A": "a",
    "%": "percent",
    "rpm": "rpm",
    "degC": "celsius",
}


class LayoutError(Exception):
    pass


class Signal:
    """One signal with what the C++ code needs to know of it."""

    def __init__(self, signal: "canmatrix.Signal"):
        self.dbc_name = signal.name
        self.start, self.size, self.is_signed = signal.start_bit, signal.size, signal.is_signed
        self.factor, self.offset = float(signal.factor), float(signal.offset)
        self.low, self.high = float(signal.min), float(signal.max)
        self.unit = signal.unit
        self.values = {int(value): name for value, name in signal.values.items()}
        self.comment = signal.comment or ""
        words = re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "_", signal.name).lower()
        suffix = UNITS[signal.unit] if signal.unit else ""
        self.name = f"{words}_{suffix}" if suffix else words
        # Codes have an enumeration of the signal's name; EscErr0 to EscErr3 share one.
        self.enum = re.sub(r"\d$", "", signal.name) if signal.values else ""
        # Counts, codes and wrapping clocks are whole numbers; everything else is measured.
        self.is_whole = self.factor == 1.0 and self.offset == 0.0 and self.unit in ("", "us", "s")

    @property
    def not_available(self) -> int:
        return -(1 << (self.size - 1)) if self.is_signed else (1 << self.size) - 1

    @property
    def raw_range(self) -> Tuple[int, int]:
        """The legal codes, without the one for "not available"."""
        low = round((self.low - self.offset) / self.factor)
        high = round((self.high - self.offset) / self.factor)
        if self.is_signed:
            return max(low, self.not_available + 1), high
        return low, min(high, self.not_available - 1)

    @property
    def decimals(self) -> int:
        """After the point, so that no two codes look alike."""
        return len(f"{self.factor:.6f}".rstrip("0").split(".")[1])


class Message:
    def __init__(self, frame: "canmatrix.Frame"):
        self.dbc_name = frame.name
        self.name = camel(frame.name)
        self.id = frame.arbitration_id.id
        self.data_id = int(frame.attribute("DataId", default=0))
        self.sender = frame.transmitters[0]
        self.period_ms = frame.cycle_time
        self.comment = frame.comment or ""
        signals = sorted(frame.signals, key=lambda signal: signal.start_bit)
        check_layout(frame, signals)
        self.header = [Signal(signal) for signal in signals[:2]]  # CRC and counter
        self.signals = [Signal(signal) for signal in signals[2:]]


def camel(name: str) -> str:
    return "".join(word.capitalize() for word in name.split("_"))


def check_layout(frame: "canmatrix.Frame", signals: Sequence["canmatrix.Signal"]) -> None:
    """What decoders of the DBC rely on: see docs/can_protocol.md."""
    where = f"message {frame.name}"
    if frame.size != 8 or frame.arbitration_id.extended:
        raise LayoutError(f"{where}: must be 8 bytes with an 11-bit identifier")
    header = [(signal.name, signal.start_bit, signal.size) for signal in signals[:2]]
    if header != [(f"{frame.name}_CRC", 0, 8), (f"{frame.name}_CTR", 8, 4)]:
        raise LayoutError(f"{where}: must begin with its CRC and counter")
    bit = 0
    for signal in signals:
        if signal.start_bit != bit:
            raise LayoutError(f"{where}: gap or overlap before signal {signal.name}")
        if not signal.is_little_endian or (signal.is_signed and signal.size not in (8, 16, 32)):
            raise LayoutError(f"{where}: signal {signal.name}: big endian, or an odd signed size")
        bit += signal.size
    if bit != 64:
        raise LayoutError(f"{where}: {bit} bits are described, not 64")


def read_messages(path: Path) -> Tuple[str, List[Message]]:
    """Version and messages, in the order of the file."""
    try:
        matrix = canmatrix.formats.loadp_flat(str(path))
    except OSError as error:
        raise LayoutError(f"{path}: {error.strerror}") from error
    messages = [Message(frame) for frame in matrix.frames]
    names = [signal.dbc_name for message in messages for signal in message.signals]
    twice = sorted({name for name in names if names.count(name) > 1})
    if not messages or twice:
        raise LayoutError(f"{path}: no messages, or signals named twice: {' '.join(twice)}")
    data_ids = [message.data_id for message in messages]
    if len(set(data_ids)) < len(data_ids) or min(data_ids) < 1 or max(data_ids) > 0xFF:
        raise LayoutError(f"{path}: a message lacks a DataId (1 to 255) of its own")
    return version_of(path), messages


def version_of(path: Path) -> str:
    match = re.search(r'^VERSION "(\d+\.\d+[^"]*)"', path.read_text(encoding="utf-8"), re.M)
    if not match:
        raise LayoutError(f"{path}: no VERSION such as 1.0.0")
    return match[1]


def enums(messages: Iterable[Message]) -> Dict[str, Dict[int, str]]:
    """{name: {code: name}} of all signals with named codes."""
    found: Dict[str, Dict[int, str]] = {}
    for message in messages:
        for signal in message.signals:
            if signal.enum and found.setdefault(signal.enum, signal.values) != signal.values:
                raise LayoutError(f"signal {signal.dbc_name}: codes differ from its namesakes'")
    return found


def protocol_hash(messages: Iterable[Message]) -> int:
    """Of all that two stations must agree on."""
    agreed = [
        (message.id, message.data_id)
        + tuple(
            (signal.dbc_name, signal.start, signal.size, signal.factor, signal.offset)
            + tuple(sorted(signal.values.items()))
            for signal in message.signals
        )
        for message in messages
    ]
    return zlib.crc32(repr(agreed).encode()) & 0xFFFF


# --- frames, independently of the C++ code -------------------------------------------------------


def crc8(data: bytes) -> int:
    crc = CRC_INITIAL
    for byte in data:
        crc ^= byte
        for _ in range(8):
            crc = ((crc << 1) ^ CRC_POLYNOMIAL if crc & 0x80 else crc << 1) & 0xFF
    return crc ^ CRC_FINAL


def frame_bytes(message: Message, raws: Iterable[int], counter: int) -> bytes:
    word = counter << 8
    for signal, raw in zip(message.signals, raws):
        word |= (raw & ((1 << signal.size) - 1)) << signal.start
    data = word.to_bytes(8, "little")
    return bytes([crc8(data[1:] + bytes([message.data_id]))]) + data[1:]


def physical(signal: Signal, raw: int) -> str:
    if signal.is_whole:
        return str(raw)
    return f"{raw * signal.factor + signal.offset:.{signal.decimals}f}"


def example_raw(signal: Signal, number: int) -> int:
    """Some legal code, another one for each signal."""
    low, high = signal.raw_range
    return low + (high - low) * (7 * number % 10 + 1) // 12


def examples(messages: Iterable[Message]) -> Iterator[Tuple[Message, int, List[int], bytes]]:
    """(message, counter, raw codes, bytes) for each."""
    number = 0
    for message in messages:
        raws = []
        for signal in message.signals:
            raws.append(example_raw(signal, number))
            number += 1
        counter = message.id % 16
        yield message, counter, raws, frame_bytes(message, raws, counter)
