# Copyright 2026 the Understory authors
# SPDX-License-Identifier: BSD-3-Clause
"""Reads a log of a CAN bus: candump's own format (also compressed), and ASC and BLF by python-can.

    (1700000000.123456) vcan0 104#5A0300000000FF1F

All frames are kept, in the order of the file, also those that nobody here knows. What cannot be
read raises LogError with one line that names file and line. A last line that was cut off is normal
after a SIGKILL or a power cut: it is a note.
"""

import gzip
import re
import zlib
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Callable, Dict, List, Tuple

import numpy as np

EXTENDED, REMOTE, ERROR, FD = 1, 2, 4, 8  # flags of a frame
ERROR_BIT, IDENTIFIER_MASK = 0x20000000, 0x1FFFFFFF
CHUNK_BYTES = 1 << 22
LINE = re.compile(
    rb"^\((\d{1,11})\.(\d{1,9})\) +(\S+) +([0-9A-Fa-f]{3}|[0-9A-Fa-f]{8})#(\S*)(?: [RT])? *\r?\n",
    re.M,
)
BLANK = re.compile(rb"^[ \t]*\r?\n", re.M)
REMOTE_DATA = re.compile(rb"[Rr]([0-8]?)")
FD_DATA = re.compile(rb"#[0-9A-Fa-f]((?:[0-9A-Fa-f]{2}){0,64})")
ODD_DATA = re.compile(rb"((?:[0-9A-Fa-f]{2}){0,8})(?:_[0-9A-Fa-f])?")  # _: a DLC beyond 8

Progress = Callable[[str], None]  # called with what is done so far


class LogError(Exception):
    """A log that cannot be used; the message names the file."""


@dataclass(frozen=True)
class Frames:
    time_ns: np.ndarray
    identifier: np.ndarray  # without flags
    flags: np.ndarray
    length: np.ndarray  # bytes of data
    data: np.ndarray  # its first 8 bytes as a little-endian word
    interface: np.ndarray  # index of `interfaces`
    interfaces: Tuple[str, ...]
    notes: List[str] = field(default_factory=list)  # what is odd or cut off

    @property
    def count(self) -> int:
        return len(self.time_ns)

    def taken(self, at: np.ndarray) -> "Frames":
        columns = ("time_ns", "identifier", "flags", "length", "data", "interface")
        return replace(self, **{name: getattr(self, name)[at] for name in columns})


def read_log(path: Path, interface: str = "", progress: Progress = lambda text: None) -> Frames:
    """The frames of one interface; it must be named if there are several."""
    suffix = (path.suffixes[-2:] or [""])[0] if path.suffix == ".gz" else path.suffix
    if suffix.lower() in (".asc", ".blf"):
        frames = _read_by_library(path, progress)
    else:
        frames = _read_candump(path, progress)
    if not frames.count:
        raise LogError(f"{path}: no frames in it")
    frames = _of_interface(path, frames, interface)
    backward = int(np.count_nonzero(np.diff(frames.time_ns) < 0))
    if backward:
        frames.notes.append(f"{path}: time goes back {backward} times")
    return frames


def _of_interface(path: Path, frames: Frames, interface: str) -> Frames:
    counts = np.bincount(frames.interface, minlength=len(frames.interfaces))
    present = [f"{name} ({count})" for name, count in zip(frames.interfaces, counts)]
    if interface:
        if interface not in frames.interfaces:
            raise LogError(f"{path}: no frames of {interface}; there are: {', '.join(present)}")
        return frames.taken(frames.interface == frames.interfaces.index(interface))
    if len(present) > 1:
        # Together their counters would look repeated.
        raise LogError(f"{path}: name one --interface; there are: {', '.join(present)}")
    return frames


# --- candump -------------------------------------------------------------------------------------


class _Columns:
    """What has been read so far, chunk by chunk."""

    def __init__(self) -> None:
        self.parts: List[Tuple[np.ndarray, ...]] = []
        self.interfaces: Dict[bytes, int] = {}
        self.identifiers: Dict[bytes, Tuple[int, int]] = {}

    def add(self, rows: List[Tuple[bytes, ...]]) -> None:
        """Raises ValueError for data that is none."""
        seconds, fractions, interfaces, identifiers, texts = zip(*rows)
        time_ns = np.fromiter(map(int, seconds), np.int64, len(rows)) * 1_000_000_000
        padded = (text if len(text) == 9 else text.ljust(9, b"0") for text in fractions)
        time_ns += np.fromiter(map(int, padded), np.int64, len(rows))
        for name in dict.fromkeys(interfaces):
            self.interfaces.setdefault(name, len(self.interfaces))
        for text in set(identifiers).difference(self.identifiers):
            self.identifiers[text] = _identifier(text)
        of_interface, known = self.interfaces, self.identifiers
        interface = np.fromiter((of_interface[name] for name in interfaces), np.int64, len(rows))
        pairs = np.array([known[text] for text in identifiers], dtype=np.int64)
        flags, length, data = pairs[:, 1], np.full(len(rows), 8), np.empty(len(rows), "<u8")
        whole = np.fromiter((len(text) == 16 for text in texts), bool, len(rows))
        joined = b"".join(text for text in texts if len(text) == 16).decode("ascii")
        data[whole] = np.frombuffer(bytes.fromhex(joined), "<u8")
        for at in np.flatnonzero(~whole):
            flag, length[at], data[at] = _odd_data(texts[at])
            flags[at] |= flag
        self.parts.append((time_ns, pairs[:, 0], flags, length, data, interface))

    def frames(self, notes: List[str]) -> Frames:
        columns = [np.concatenate(column) for column in zip(*self.parts)] or [np.empty(0)] * 6
        names = tuple(name.decode("ascii", "replace") for name in self.interfaces)
        return Frames(*columns, names, notes)


def _identifier(text: bytes) -> Tuple[int, int]:
    """Identifier and flags: candump writes eight digits for extended and for error frames."""
    value = int(text, 16)
    if len(text) == 3:
        if value > 0x7FF:
            raise ValueError
        return value, 0
    return value & IDENTIFIER_MASK, ERROR if value & ERROR_BIT else EXTENDED


def _odd_data(text: bytes) -> Tuple[int, int, int]:
    """Flag, length and first 8 bytes of what is not 8 bytes of data."""
    remote, fd, odd = (form.fullmatch(text) for form in (REMOTE_DATA, FD_DATA, ODD_DATA))
    if remote:
        return REMOTE, int(remote[1] or 0), 0
    if not fd and not odd:
        raise ValueError
    data = bytes.fromhex((fd or odd)[1].decode("ascii"))
    return FD if fd else 0, len(data), int.from_bytes(data[:8], "little")


def _read_candump(path: Path, progress: Progress) -> Frames:
    columns, tail, line = _Columns(), b"", 1
    try:
        size = max(path.stat().st_size, 1)
        with open(path, "rb") as file:
            source = gzip.open(file) if path.suffix == ".gz" else file
            for chunk in iter(lambda: source.read(CHUNK_BYTES), b""):
                whole, newline, rest = (tail + chunk).rpartition(b"\n")
                tail = rest
                if newline:
                    line = _add_lines(columns, whole + newline, path, line)
                if file.seekable():  # a pipe does not know how much is to come
                    progress(f"{100 * file.tell() / size:.0f} % read")
    except OSError as error:
        raise LogError(f"{path}: {error.strerror or error}") from error
    except (EOFError, zlib.error) as error:
        raise LogError(f"{path}: {error}") from error
    notes = []
    if tail:
        # Without its newline a line may lack digits, however whole it looks.
        if not columns.parts and not tail.startswith(b"("):
            raise _bad_line(path, line, tail)
        notes.append(f"{path}:{line}: the last line was cut off and is left out")
    return columns.frames(notes)


def _add_lines(columns: _Columns, text: bytes, path: Path, first_line: int) -> int:
    """Returns the number of the line after these."""
    rows = LINE.findall(text)
    count = text.count(b"\n")
    try:
        if len(rows) + len(BLANK.findall(text)) != count:
            raise ValueError
        if rows:
            columns.add(rows)
    except ValueError:
        for line, one in enumerate(text.splitlines(True), start=first_line):
            if not _is_good(one):
                raise _bad_line(path, line, one) from None
        raise
    return first_line + count


def _is_good(line: bytes) -> bool:
    try:
        row = LINE.fullmatch(line)
        if row:
            _Columns().add([row.groups()])
        return bool(row or BLANK.fullmatch(line))
    except ValueError:
        return False


def _bad_line(path: Path, line: int, text: bytes) -> LogError:
    shown = ascii(text[:60].decode("latin-1").rstrip("\r\n")) + ("..." if len(text) > 61 else "")
    return LogError(f"{path}:{line}: not a line of candump -l: {shown}")


# --- ASC and BLF ---------------------------------------------------------------------------------


def _read_by_library(path: Path, progress: Progress) -> Frames:
    import can  # takes a while, and candump's format needs it not

    rows, names, notes = [], {}, []
    try:
        for message in can.LogReader(path):
            if len(rows) % 10_000 == 0:
                progress(f"{len(rows)} frames read")
            flags = EXTENDED * message.is_extended_id | REMOTE * message.is_remote_frame
            flags |= ERROR * message.is_error_frame | FD * message.is_fd
            name = "can" if message.channel is None else str(message.channel)
            data = int.from_bytes(bytes(message.data[:8]), "little")
            rows.append(
                (
                    round(message.timestamp * 1e6) * 1000,
                    message.arbitration_id,
                    flags,
                    message.dlc if message.is_remote_frame else len(message.data),
                    data,
                    names.setdefault(name, len(names)),
                )
            )
    except OSError as error:
        raise LogError(f"{path}: {error.strerror or error}") from error
    except Exception as error:  # whatever a reader raises that meets what it does not expect
        if not rows:
            kind = path.name.rsplit(".", 1)[-1]
            raise LogError(f"{path}: not a readable {kind} file: {error or repr(error)}") from error
        notes.append(f"{path}: unreadable after {len(rows)} frames: {error or repr(error)}")
    columns = zip(*rows) if rows else [[]] * 6
    kinds = (np.int64, np.int64, np.int64, np.int64, "<u8", np.int64)
    arrays = [np.array(column, dtype=kind) for column, kind in zip(columns, kinds)]
    return Frames(*arrays, tuple(names), notes)
