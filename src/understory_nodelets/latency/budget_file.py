# Copyright 2026 the Understory authors
# SPDX-License-Identifier: BSD-3-Clause
"""How long what may take at most: a YAML file of rows of the latency table and limits in ms.

    exposure_to_trajectory: {p99_ms: 50}
    wakeup: {p99_ms: 1, max_ms: 20}
"""

import math
from pathlib import Path
from typing import Collection, Dict, List

import yaml

from latency_rows import MEASURES, Statistics

Budget = Dict[str, Dict[str, float]]  # row: measure: limit


class BudgetError(Exception):
    """A budget that cannot be checked; the message names file and key."""


class _StrictLoader(yaml.SafeLoader):
    """Refuses a key that is given twice: the first limit would be dropped silently."""

    def construct_mapping(self, node, deep=False):
        keys = [self.construct_object(key, deep=True) for key, _ in node.value]
        for key in keys:
            if keys.count(key) > 1:
                raise BudgetError(f"{key}: given twice")
        return super().construct_mapping(node, deep)


def read_budget(path: Path, rows: Collection[str]) -> Budget:
    """The limits of a file; `rows` are those that may have one."""
    try:
        content = yaml.load(path.read_text(encoding="utf-8"), _StrictLoader)
    except OSError as error:
        raise BudgetError(f"{path}: {error.strerror}") from error
    except BudgetError as error:
        raise BudgetError(f"{path}: {error}") from error
    except (UnicodeDecodeError, yaml.YAMLError, TypeError) as error:
        raise BudgetError(f"{path}: not YAML: {' '.join(str(error).split())}") from error
    if not isinstance(content, dict) or not content:
        raise BudgetError(f"{path}: expected stages and limits")
    for stage, limits in content.items():
        if stage not in rows:
            raise BudgetError(f"{path}: {stage}: unknown stage; there are: {', '.join(rows)}")
        if not isinstance(limits, dict) or not limits:
            raise BudgetError(f"{path}: {stage}: expected limits, such as {{p99_ms: 50}}")
        for key, limit_ms in limits.items():
            _check_limit(f"{path}: {stage}.{key}", key, limit_ms)
    return content


def _check_limit(where: str, key: object, limit_ms: object) -> None:
    if key not in MEASURES:
        raise BudgetError(f"{where}: unknown key; there are: {', '.join(MEASURES)}")
    is_number = isinstance(limit_ms, (int, float)) and not isinstance(limit_ms, bool)
    if not is_number or not math.isfinite(limit_ms) or limit_ms < 0:
        raise BudgetError(f"{where}: expected milliseconds, a number from 0")


def excesses(budget: Budget, statistics: Dict[str, Statistics]) -> List[str]:
    """A line for each limit that is exceeded and each row that has no samples."""
    found = []
    for stage, limits in budget.items():
        row = statistics.get(stage, Statistics(0))
        if row.count == 0:
            found.append(f"{stage}: no samples")
            continue
        for measure, limit_ms in limits.items():
            measured_ms = getattr(row, measure)
            if measured_ms > limit_ms:
                found.append(f"{stage}: {measure} is {measured_ms:.3f}, allowed {limit_ms:g}")
    return found
