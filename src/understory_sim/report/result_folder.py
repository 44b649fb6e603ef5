# Copyright 2026 the Understory authors
# SPDX-License-Identifier: BSD-3-Clause
"""Reads the folder that a mission leaves behind. SI units, world frame.

result.json and ticks.csv must be there; config.yaml, trunks.csv and topview.pgm may be missing, and
then the report says so. Whatever cannot be read raises FolderError with one line that names file
and line.
"""

import csv
import json
import math
import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import Dict, List, Optional

import numpy as np

NUMBER_COLUMNS = (
    "time_s x_m y_m z_m speed_mps yaw_rad yaw_rate_radps coverage explored_volume_m3 clusters "
    "trails dormant clearance_m"
).split()
WORD_COLUMNS = ["mode", "mission_state"]


class FolderError(Exception):
    pass


@dataclass
class Topview:
    pixels: np.ndarray  # first row northernmost; see write_topview
    extent_m: List[float]  # west, east, south, north

    def occupied(self) -> np.ndarray:
        return self.pixels == 0

    def unknown_share(self) -> np.ndarray:
        share = 1.0 - (self.pixels.astype(float) - 1.0) / 254.0
        return np.where(self.pixels == 0, 0.0, np.clip(share, 0.0, 1.0))


@dataclass
class ResultFolder:
    path: Path
    result: dict
    ticks: Dict[str, np.ndarray]
    config: Optional[str] = None
    trunks: Optional[np.ndarray] = None  # rows of x_m, y_m, radius_m
    topview: Optional[Topview] = None
    notes: List[str] = field(default_factory=list)  # what is missing or cut off

    @property
    def tick_count(self) -> int:
        return len(self.ticks["time_s"])

    def number(self, key: str) -> Optional[float]:
        """The value of a key of result.json when it is a finite number."""
        value = self.result.get(key)
        if isinstance(value, (int, float)) and not isinstance(value, bool) and math.isfinite(value):
            return value
        return None


def read_result_folder(path: Path) -> ResultFolder:
    if not path.is_dir():
        raise FolderError(f"{path}: not a folder")
    folder = ResultFolder(path, read_result(path / "result.json"), {})
    folder.ticks = _read_ticks(path / "ticks.csv", folder.notes)
    folder.config = _optional(folder, "config.yaml", lambda file: _read_text(file))
    folder.trunks = _optional(folder, "trunks.csv", _read_trunks)
    folder.topview = _optional(
        folder, "topview.pgm", lambda file: _read_topview(file, folder.result.get("topview"))
    )
    return folder


def _optional(folder: ResultFolder, name: str, read):
    file = folder.path / name
    if not file.exists():
        folder.notes.append(f"{name} is missing from the result folder.")
        return None
    return read(file)


def _read_text(file: Path) -> str:
    try:
        return file.read_text(encoding="utf-8", errors="replace")
    except OSError as error:
        raise FolderError(f"{file}: {error.strerror}") from error


def read_result(file: Path) -> dict:
    try:
        result = json.loads(_read_text(file))
    except json.JSONDecodeError as error:
        raise FolderError(f"{file}:{error.lineno}: not valid JSON: {error.msg}") from error
    if not isinstance(result, dict):
        raise FolderError(f"{file}: expected an object of keys")
    return result


def _number(text: str, file: Path, line: int) -> float:
    try:
        return float(text)
    except ValueError:
        raise FolderError(f"{file}:{line}: '{text}' is not a number") from None


def _read_ticks(file: Path, notes: List[str]) -> Dict[str, np.ndarray]:
    lines = _read_text(file).split("\n")
    # The writer ends every row with a newline: what stands after the last one was cut off.
    if lines.pop():
        notes.append("ticks.csv was cut off in mid-row; that row is left out.")
    rows = csv.reader(lines)
    header = next(rows, [])
    missing = [name for name in NUMBER_COLUMNS + WORD_COLUMNS if name not in header]
    if missing:
        raise FolderError(f"{file}:1: no column {missing[0]}")
    records = list(rows)
    for line, record in enumerate(records, start=2):
        if len(record) != len(header):
            raise FolderError(f"{file}:{line}: {len(record)} columns where {len(header)} belong")
    ticks: Dict[str, np.ndarray] = {}
    for name in NUMBER_COLUMNS:
        at = header.index(name)
        texts = [record[at] or "nan" for record in records]
        try:
            ticks[name] = np.array(texts, dtype=float)
        except ValueError:
            for line, text in enumerate(texts, start=2):
                _number(text, file, line)
            raise
    for name in WORD_COLUMNS:
        at = header.index(name)
        ticks[name] = np.array([record[at] for record in records], dtype=object)
    return ticks


def _read_trunks(file: Path) -> np.ndarray:
    rows = list(csv.reader(_read_text(file).splitlines()))
    trunks = []
    for line, row in enumerate(rows[1:], start=2):
        if len(row) != 3:
            raise FolderError(f"{file}:{line}: expected x_m,y_m,radius_m")
        trunks.append([_number(text, file, line) for text in row])
    return np.array(trunks, dtype=float).reshape(-1, 3)


def _read_topview(file: Path, place: Optional[dict]) -> Topview:
    try:
        content = file.read_bytes()
    except OSError as error:
        raise FolderError(f"{file}: {error.strerror}") from error
    header = re.match(rb"P5\s+(\d+)\s+(\d+)\s+255\s", content)
    if header is None:
        raise FolderError(f"{file}: not a binary PGM of 255 levels")
    width, height = int(header[1]), int(header[2])
    try:
        west_m, south_m = float(place["x0_m"]), float(place["y0_m"])
        cell_m = float(place["cell_m"])
    except (TypeError, KeyError, ValueError):
        raise FolderError(f"{file}: result.json does not say where it lies") from None
    pixels = np.frombuffer(content[header.end() :], dtype=np.uint8)
    if width <= 0 or height <= 0 or pixels.size != width * height:
        raise FolderError(f"{file}: {pixels.size} pixels where {width} x {height} belong")
    extent_m = [west_m, west_m + width * cell_m, south_m, south_m + height * cell_m]
    return Topview(pixels.reshape(height, width), extent_m)
