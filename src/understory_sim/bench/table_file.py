# Copyright 2026 the Understory authors
# SPDX-License-Identifier: BSD-3-Clause
"""Which missions a table is made of: a YAML file in config/tables, or anywhere.

    scenario: NAME            or  scenarios: [NAME, ...]   of config/scenarios
    forests: GLOB             stem maps instead of generated forests; relative to the project
    seeds: N                  seeds 1 .. N of each (default 1)
    speed_caps: [paper, strict]
"""

import dataclasses
import glob
import itertools
import pathlib

import yaml

KEYS = {"scenario", "scenarios", "forests", "seeds", "speed_caps"}
SPEED_CAPS = ("paper", "strict")


class TableError(Exception):
    """A table that cannot be flown; the message names file and key."""


@dataclasses.dataclass(frozen=True)
class Mission:
    """One flight; what identifies its row."""

    scenario: str
    forest: str  # file, or empty: generated
    seed: int
    speed_cap: str

    @property
    def scene(self):
        """What it is called in tables."""
        return pathlib.Path(self.forest).stem if self.forest else self.scenario

    @property
    def key(self):
        """As written in the columns of a row."""
        return (self.scene, str(self.seed), self.speed_cap)

    @property
    def name(self):
        """Of its result folder."""
        return f"{self.scene}_{self.seed}_{self.speed_cap}"


def _scenarios(path, content):
    given = content.get("scenarios", content.get("scenario"))
    names = given if isinstance(given, list) else [given]
    if not given or not all(isinstance(name, str) for name in names):
        raise TableError(f"{path}: scenario: expected a name, or scenarios: a list of names")
    return names


def _forests(path, content, root):
    pattern = content.get("forests", "")
    if not pattern:
        return [""]
    forests = sorted(glob.glob(str(root / pattern)))
    if not forests:
        raise TableError(f"{path}: forests: no file matches {pattern}")
    return [str(pathlib.Path(forest).resolve()) for forest in forests]


def _seed_count(path, content):
    count = content.get("seeds", 1)
    if not isinstance(count, int) or isinstance(count, bool) or count < 1:
        raise TableError(f"{path}: seeds: expected a whole number from 1")
    return count


def read_table(path, root):
    """The missions of a table file, in the order in which they are flown."""
    try:
        content = yaml.safe_load(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise TableError(f"{path}: {error.strerror}") from error
    except (UnicodeDecodeError, yaml.YAMLError) as error:
        raise TableError(f"{path}: not YAML: {' '.join(str(error).split())}") from error
    if not isinstance(content, dict):
        raise TableError(f"{path}: expected keys and values")
    for key in content:
        if key not in KEYS:
            raise TableError(f"{path}: {key}: unknown key; there are: {', '.join(sorted(KEYS))}")
    caps = content.get("speed_caps", list(SPEED_CAPS))
    if not isinstance(caps, list) or not caps or not set(caps) <= set(SPEED_CAPS):
        raise TableError(f"{path}: speed_caps: expected a list of {', '.join(SPEED_CAPS)}")
    return [
        Mission(scenario, forest, seed, cap)
        for scenario, forest, seed, cap in itertools.product(
            _scenarios(path, content),
            _forests(path, content, root),
            range(1, _seed_count(path, content) + 1),
            caps,
        )
    ]
