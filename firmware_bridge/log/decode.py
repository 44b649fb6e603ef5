# Copyright 2026 the Understory authors
# SPDX-License-Identifier: BSD-3-Clause
"""Frames to signals, for all frames of a message at once.

A frame with a wrong length, checksum or a forbidden code is kept and marked: what it says must not
be believed, but that it was there may explain much.
"""

import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Dict, List, Sequence

import numpy as np

# Beside us in the sources as where catkin installs the package.
CAN_FOLDER = Path(__file__).resolve().parents[1] / "can"
sys.path.append(str(CAN_FOLDER))
from dbc import CRC_FINAL, CRC_INITIAL, CRC_POLYNOMIAL, Message, Signal  # noqa: E402
from dbc import LayoutError, protocol_hash, read_messages  # noqa: E402, F401

from frame_log import ERROR, EXTENDED, FD, REMOTE, Frames  # noqa: E402

DBC = CAN_FOLDER / "understory.dbc"
GOOD, LENGTH, CHECKSUM, CODE = range(4)
CHECKS = ("good", "length", "checksum", "code")  # as they are written


class Protocol:
    def __init__(self, path: Path = DBC):
        self.version, self.messages = read_messages(path)
        self.hash = protocol_hash(self.messages)
        self.of_identifier = {message.id: message for message in self.messages}


@dataclass(frozen=True)
class Decoded:
    """All frames of one message, in the order of the log."""

    message: Message
    index: np.ndarray  # in the log's frames
    time_ns: np.ndarray
    counter: np.ndarray
    check: np.ndarray
    codes: Dict[str, np.ndarray]  # raw, by the signal's name in the DBC

    @property
    def count(self) -> int:
        return len(self.index)

    @property
    def is_good(self) -> np.ndarray:
        return self.check == GOOD

    def good(self) -> "Decoded":
        return self.taken(self.is_good)

    def taken(self, at: np.ndarray) -> "Decoded":
        codes = {name: values[at] for name, values in self.codes.items()}
        columns = (self.index, self.time_ns, self.counter, self.check)
        return Decoded(self.message, *(column[at] for column in columns), codes)

    def physical(self, name: str) -> np.ndarray:
        """In the signal's unit; NaN is "not available" or a frame too short to have it."""
        signal = next(each for each in self.message.signals if each.dbc_name == name)
        codes = self.codes[name]
        missing = self.check == LENGTH
        if not signal.is_whole:
            missing = missing | (codes == signal.not_available)
        return np.where(missing, np.nan, codes * signal.factor + signal.offset)


@dataclass(frozen=True)
class Log:
    protocol: Protocol
    frames: Frames
    messages: Dict[str, Decoded]  # by name, in the order of the DBC; also those without frames
    is_other: np.ndarray  # which frames are of no message
    zero_ns: int  # when seconds are 0: the log's begin, or the epoch

    def __getitem__(self, name: str) -> Decoded:
        return self.messages[name]

    def seconds(self, time_ns: np.ndarray) -> np.ndarray:
        return (time_ns - self.zero_ns) / 1e9


def _crc_table() -> np.ndarray:
    table = np.arange(256, dtype=np.uint16)
    for _ in range(8):
        table = np.where(table & 0x80, (table << 1) ^ CRC_POLYNOMIAL, table << 1) & 0xFF
    return table.astype(np.uint8)


CRC_TABLE = _crc_table()


def crc8_of(words: np.ndarray, data_id: int) -> np.ndarray:
    """Of bytes 1 to 7 and the data identifier, as dbc.crc8 but of many frames."""
    columns = np.ascontiguousarray(words, dtype="<u8").view(np.uint8).reshape(-1, 8)
    crc = np.full(len(columns), CRC_INITIAL, dtype=np.uint8)
    for byte in range(1, 8):
        crc = CRC_TABLE[crc ^ columns[:, byte]]
    return CRC_TABLE[crc ^ np.uint8(data_id)] ^ np.uint8(CRC_FINAL)


def codes_of(words: np.ndarray, signal: Signal) -> np.ndarray:
    codes = (words >> np.uint64(signal.start)) & np.uint64((1 << signal.size) - 1)
    codes = codes.astype(np.int64)
    if signal.is_signed:
        codes[codes >= 1 << (signal.size - 1)] -= 1 << signal.size
    return codes


def _forbidden(codes: Dict[str, np.ndarray], signals: Sequence[Signal]) -> np.ndarray:
    """As the C++ receiver: whole numbers may have any code."""
    found = np.zeros(1, dtype=bool)
    for signal in signals:
        if not signal.is_whole:
            values, (low, high) = codes[signal.dbc_name], signal.raw_range
            found = found | (
                ((values < low) | (values > high)) & (values != signal.not_available)
            )
    return found


def decode_message(message: Message, frames: Frames, index: np.ndarray) -> Decoded:
    words = frames.data[index]
    codes = {signal.dbc_name: codes_of(words, signal) for signal in message.signals}
    counter = ((words >> np.uint64(8)) & np.uint64(0xF)).astype(np.int64)
    check = np.where(_forbidden(codes, message.signals), CODE, GOOD)
    check = np.where((words & np.uint64(0xFF)) != crc8_of(words, message.data_id), CHECKSUM, check)
    is_odd = (frames.length[index] != 8) | (frames.flags[index] != 0)
    check = np.where(is_odd, LENGTH, check)
    return Decoded(message, index, frames.time_ns[index], counter, check, codes)


def decode(frames: Frames, protocol: Protocol) -> Log:
    # Another protocol may have extended identifiers, CAN FD and error frames on the same bus.
    is_ours = (frames.flags & (EXTENDED | ERROR | FD)) == 0
    order = np.argsort(frames.identifier, kind="stable")
    order = order[is_ours[order]]
    identifiers = frames.identifier[order]
    messages: Dict[str, Decoded] = {}
    is_other = np.ones(frames.count, dtype=bool)
    for message in protocol.messages:
        first, end = np.searchsorted(identifiers, [message.id, message.id + 1])
        index = order[first:end]
        is_other[index] = False
        messages[message.dbc_name] = decode_message(message, frames, index)
    return Log(protocol, frames, messages, is_other, int(frames.time_ns.min()))


def code_name(signal: Signal, code: int) -> str:
    """Empty for a code without a name."""
    return signal.values.get(int(code), "")


def flag_signals(message: Message) -> List[Signal]:
    return [signal for signal in message.signals if signal.size == 1]


def other_kinds(log: Log) -> Dict[str, int]:
    """How many frames of no message there are of each kind; kinds that occur."""
    flags = log.frames.flags[log.is_other]
    kinds = {
        "error frames": (flags & ERROR) != 0,
        "CAN FD": (flags & FD) != 0,
        "extended": ((flags & EXTENDED) != 0) & ((flags & (FD | ERROR)) == 0),
        "unknown identifiers": (flags & ~REMOTE) == 0,
    }
    return {kind: int(which.sum()) for kind, which in kinds.items() if which.any()}
