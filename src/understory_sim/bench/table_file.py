# Copyright 2026 the Understory authors
# SPDX-License-Identifier: BSD-3-Clause
"""Which missions a table is made of: a YAML file in config/tables, or anywhere.

    scenario: NAME            or  scenarios: [NAME, ...]   of config/scenarios
    forests: GLOB             stem maps instead of generated forests; relative to the project
    seeds: N                  seeds 1 .. N of each (default 1)
    speed_caps: [paper, strict]
    title: TEXT               of the group's line in the table (default: one line per scene)
    strategies: [NAME, ...]   of config/strategies (default: explorer_collector)
    timed: true               missions that are over when their time is; they need not be completed
    variants: {NAME: {...}}   configuration over that of all files; one line in the table per variant,
                              unless the group has a title

or `groups:` a list of such groups.
"""

import dataclasses
import glob
import itertools
import pathlib
import re

import yaml

KEYS = {"scenario", "scenarios", "forests", "seeds", "speed_caps", "strategies", "title", "timed"}
KEYS |= {"variants"}
DEFAULT_STRATEGY = "explorer_collector"
SPEED_CAPS = ("paper", "strict")


class TableError(Exception):
    """A table that cannot be flown; the message names file and key."""


def name_of(key):
    """Of a mission with these columns, for files."""
    return re.sub(r"[^\w.+-]+", "-", "_".join(word for word in key if word))


@dataclasses.dataclass(frozen=True)
class Mission:
    """One flight; what identifies its row."""

    scenario: str
    forest: str  # file, or empty: generated
    seed: int
    speed_cap: str
    strategy: str = DEFAULT_STRATEGY
    group: str = ""
    variant: str = ""
    settings: str = ""  # the variant's, as YAML
    timed: bool = False

    @property
    def title(self):
        """Of its line in the table. Forests that differ in their seed only share one."""
        return self.group or self.variant or re.sub(r"_s\d+$", "", self.scene)

    @property
    def scene(self):
        """What it is called in tables."""
        return pathlib.Path(self.forest).stem if self.forest else self.scenario

    @property
    def key(self):
        """As written in the columns of a row."""
        return (self.scene, str(self.seed), self.speed_cap, self.strategy, self.variant)

    @property
    def name(self):
        """Of its result folder."""
        return name_of(self.key)


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


def _strategies(path, content):
    names = content.get("strategies", [DEFAULT_STRATEGY])
    if not isinstance(names, list) or not names or not all(isinstance(n, str) for n in names):
        raise TableError(f"{path}: strategies: expected a list of names")
    return names


def _variants(path, content):
    """(name, settings as YAML) of each; one without a name if the table has none."""
    variants = content.get("variants", {"": {}})
    is_map = isinstance(variants, dict) and variants
    if not is_map or not all(isinstance(settings, dict) for settings in variants.values()):
        raise TableError(f"{path}: variants: expected names with configuration below them")
    return [
        (str(name), yaml.safe_dump(settings, default_flow_style=True) if settings else "")
        for name, settings in variants.items()
    ]


def _group(path, content, root):
    if not isinstance(content, dict):
        raise TableError(f"{path}: expected keys and values")
    for key in content:
        if key not in KEYS:
            known = ", ".join(sorted(KEYS | {"groups"}))
            raise TableError(f"{path}: {key}: unknown key; there are: {known}")
    caps = content.get("speed_caps", list(SPEED_CAPS))
    if not isinstance(caps, list) or not caps or not set(caps) <= set(SPEED_CAPS):
        raise TableError(f"{path}: speed_caps: expected a list of {', '.join(SPEED_CAPS)}")
    timed = content.get("timed", False)
    if not isinstance(timed, bool):
        raise TableError(f"{path}: timed: expected true or false")
    return [
        Mission(scenario, forest, seed, cap, strategy, content.get("title", ""), *variant, timed)
        for variant, scenario, forest, seed, cap, strategy in itertools.product(
            _variants(path, content),
            _scenarios(path, content),
            _forests(path, content, root),
            range(1, _seed_count(path, content) + 1),
            caps,
            _strategies(path, content),
        )
    ]


def read_table(path, root):
    """The missions of a table file, in the order in which they are flown."""
    try:
        content = yaml.safe_load(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise TableError(f"{path}: {error.strerror}") from error
    except (UnicodeDecodeError, yaml.YAMLError) as error:
        raise TableError(f"{path}: not YAML: {' '.join(str(error).split())}") from error
    groups = [content]
    if isinstance(content, dict) and set(content) == {"groups"}:
        groups = content["groups"]
        if not isinstance(groups, list) or not groups:
            raise TableError(f"{path}: groups: expected a list")
    return [mission for group in groups for mission in _group(path, group, root)]


def quick(missions):
    """A taste of a table: of every other scenario one forest and seed, as fast as allowed."""
    scenarios = list(dict.fromkeys(mission.scenario for mission in missions))[::2]
    first = {}
    for mission in missions:
        if mission.scenario in scenarios:
            first.setdefault((mission.scenario, mission.strategy, mission.variant), mission)
    return list(first.values())
