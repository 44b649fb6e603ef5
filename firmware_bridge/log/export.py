# Copyright 2026 the Understory authors
# SPDX-License-Identifier: BSD-3-Clause
"""Every frame of a log with its signals: as text, CSV and JSON lines, in the order of the log.

Names with units are those of the C++ structures (SpX is sp_x_m); codes have a second column with
their name. Not available is nan, in JSON null. Frames whose check is not good are there as well;
what a frame is too short to hold is empty. Frames of no message have identifier and bytes.
"""

from pathlib import Path
from typing import Callable, Dict, Iterator, List, TextIO, Tuple

import numpy as np

from decode import CHECKS, LENGTH, Decoded, Log, Signal
from frame_log import ERROR, EXTENDED, FD, REMOTE, Frames

PART = 20000  # frames at once: enough to be quick, few enough to begin soon
Cells = Dict[str, List[str]]
Rows = List[Tuple[int, str]]


def data_text(frames: Frames, at: int) -> str:
    """As candump writes it, but of CAN FD the first 8 bytes."""
    identifier, flags, length = (
        int(column[at]) for column in (frames.identifier, frames.flags, frames.length)
    )
    if flags & REMOTE:
        data = f"R{length or ''}"
    else:
        data = int(frames.data[at]).to_bytes(8, "little")[:length].hex().upper()
        data += "..." if length > 8 else ""
    if flags & (EXTENDED | ERROR):
        identifier |= 0x20000000 if flags & ERROR else 0
        return f"{identifier:08X}#{data}"
    return f"{identifier:03X}#{'#' if flags & FD else ''}{data}"


def number_texts(decoded: Decoded, signal: Signal, missing: str) -> List[str]:
    values = decoded.physical(signal.dbc_name)
    decimals = 0 if signal.is_whole else signal.decimals
    form = f"%.{decimals}f"
    texts = [form % value for value in values.tolist()]
    for at in np.flatnonzero(np.isnan(values)):
        texts[at] = missing if decoded.check[at] != LENGTH else ""
    return texts


def name_texts(decoded: Decoded, signal: Signal) -> List[str]:
    codes = decoded.codes[signal.dbc_name].tolist()
    names = [signal.values.get(code, "") for code in codes]
    for at in np.flatnonzero(decoded.check == LENGTH):
        names[at] = ""
    return names


def columns_of(decoded: Decoded, missing: str) -> Cells:
    """By column name; the name of a code follows its number."""
    cells: Cells = {}
    for signal in decoded.message.signals:
        cells[signal.name] = number_texts(decoded, signal, missing)
        if signal.values:
            cells[signal.name + "_name"] = name_texts(decoded, signal)
    return cells


def time_texts(log: Log, time_ns: np.ndarray) -> List[str]:
    return [f"{time_s:.6f}" for time_s in log.seconds(time_ns).tolist()]


def _in_order(
    log: Log, rows_of: Callable[[Decoded], List[str]], others: List[str]
) -> Iterator[str]:
    """Row by row in the order of the log, decoding a part of it at a time."""
    other_at = np.flatnonzero(log.is_other)
    for begin in range(0, log.frames.count, PART):
        rows: Rows = []
        for decoded in log.messages.values():
            first, end = np.searchsorted(decoded.index, [begin, begin + PART])
            if first < end:
                part = decoded.taken(slice(first, end))
                rows += zip(part.index.tolist(), rows_of(part))
        first, end = np.searchsorted(other_at, [begin, begin + PART])
        rows += zip(other_at[first:end].tolist(), others[first:end])
        rows.sort(key=lambda row: row[0])
        for _, text in rows:
            yield text


def _other_rows(log: Log, form: str) -> List[str]:
    """form: of time and data."""
    at = np.flatnonzero(log.is_other)
    times = time_texts(log, log.frames.time_ns[at])
    return [form.format(time, data_text(log.frames, index)) for time, index in zip(times, at)]


# --- text ----------------------------------------------------------------------------------------


def text_lines(log: Log) -> Iterator[str]:
    def rows_of(part: Decoded) -> List[str]:
        words = []
        for signal in part.message.signals:
            unit = f" {signal.unit}" if signal.unit else ""
            texts = number_texts(part, signal, "nan")
            if signal.values:
                texts = [name or text for name, text in zip(name_texts(part, signal), texts)]
            words.append([f"{signal.dbc_name}={text}{unit}" for text in texts])
        marks = ["" if check == 0 else f" !{CHECKS[check]}" for check in part.check.tolist()]
        times = time_texts(log, part.time_ns)
        heads = zip(times, part.counter.tolist(), marks)
        name = part.message.dbc_name
        lines = [f"{time:>12} {name:<10} {counter:2d}{mark}" for time, counter, mark in heads]
        for at in np.flatnonzero(part.check == LENGTH):
            lines[at] += f" {data_text(log.frames, part.index[at])}"
        is_whole = (part.check != LENGTH).tolist()
        joined = map("  ".join, zip(*words))
        return [f"{line}  {text}" if w else line for line, text, w in zip(lines, joined, is_whole)]

    return _in_order(log, rows_of, _other_rows(log, "{:>12} other          {}"))


# --- JSON ----------------------------------------------------------------------------------------


def json_lines(log: Log) -> Iterator[str]:
    """One object a line. Numbers are written as the text has them, without a detour over floats."""

    def rows_of(part: Decoded) -> List[str]:
        pairs = []
        for name, texts in columns_of(part, "null").items():
            form = f'"{name}":"%s"' if name.endswith("_name") else f'"{name}":%s'
            pairs.append([form % text if text else f'"{name}":null' for text in texts])
        heads = zip(
            time_texts(log, part.time_ns), part.counter.tolist(), part.check.tolist(), part.index
        )
        lines = []
        for (time, counter, check, at), signals in zip(heads, map(",".join, zip(*pairs))):
            mark = "" if check == 0 else f',"frame":"{data_text(log.frames, at)}"'
            lines.append(
                f'{{"time_s":{time},"message":"{part.message.dbc_name}","counter":{counter},'
                f'"check":"{CHECKS[check]}"{mark},"signals":{{{signals}}}}}'
            )
        return lines

    return _in_order(log, rows_of, _other_rows(log, '{{"time_s":{},"message":null,"frame":"{}"}}'))


# --- CSV -----------------------------------------------------------------------------------------

HEAD = ("time_s", "message", "counter", "check", "frame")


def _csv_columns(log: Log) -> Dict[str, List[str]]:
    """By message."""
    return {
        name: list(columns_of(decoded.taken(slice(0)), "nan"))
        for name, decoded in log.messages.items()
    }


def csv_table(log: Log) -> Iterator[str]:
    """All frames in one table with the columns of all messages."""
    columns = _csv_columns(log)
    total = sum(len(names) for names in columns.values())
    yield ",".join([*HEAD, *(name for names in columns.values() for name in names)])
    before, places = 0, {}
    for name, names in columns.items():
        places[name] = ("," * before, "," * (total - before - len(names)))
        before += len(names)

    def rows_of(part: Decoded) -> List[str]:
        left, right = places[part.message.dbc_name]
        return [f"{head},{left}{cells}{right}" for head, cells in _csv_rows(log, part)]

    yield from _in_order(log, rows_of, _other_rows(log, "{},,,,{}," + "," * (total - 1)))


def _csv_rows(log: Log, part: Decoded) -> Iterator[Tuple[str, str]]:
    """First columns and signals; bad frames with their bytes."""
    times, name = time_texts(log, part.time_ns), part.message.dbc_name
    frames = [
        data_text(log.frames, at) if check else ""
        for at, check in zip(part.index.tolist(), part.check.tolist())
    ]
    heads = zip(times, part.counter.tolist(), part.check.tolist(), frames)
    cells = map(",".join, zip(*columns_of(part, "nan").values()))
    for (time, counter, check, frame), text in zip(heads, cells):
        yield f"{time},{name},{counter},{CHECKS[check]},{frame}", text


def csv_files(log: Log) -> Iterator[Tuple[str, Iterator[str]]]:
    """File name and lines: one table for each message that occurs, one for all other frames."""
    for name, columns in _csv_columns(log).items():
        if log[name].count:
            yield f"{name}.csv", _message_table(log, log[name], columns)
    if log.is_other.any():
        rows = _other_rows(log, "{},{}")
        yield "other.csv", iter(["time_s,frame", *rows])


def _message_table(log: Log, decoded: Decoded, columns: List[str]) -> Iterator[str]:
    yield ",".join([*HEAD, *columns])
    for begin in range(0, decoded.count, PART):
        for head, cells in _csv_rows(log, decoded.taken(slice(begin, begin + PART))):
            yield f"{head},{cells}"


def write_lines(lines: Iterator[str], file: TextIO, progress: Callable[[int], None]) -> None:
    """progress: called with how many lines are written."""
    for number, line in enumerate(lines, start=1):
        file.write(line + "\n")
        if number % PART == 0:
            progress(number)


def is_single_file(path: Path) -> bool:
    return path.suffix.lower() == ".csv"
