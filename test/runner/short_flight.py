# Copyright 2026 the Understory authors
# SPDX-License-Identifier: BSD-3-Clause
"""A flight of a few seconds: enough to need every library, the configuration and the report."""

import os
import shutil
import subprocess

from commands import say

SCENARIO = """\
scene:
  name: short_flight
  box: {{x_min_m: -5.0, y_min_m: -5.0, x_max_m: 5.0, y_max_m: 5.0}}
  generator:
    regions: [{{x_min_m: -5.0, y_min_m: -5.0, x_max_m: 5.0, y_max_m: 5.0, trees_per_m2: 0.1}}]
mission: {{time_limit_s: {time_limit_s}}}
"""
TIMEOUT_S = 600


def flies(program, folder, time_limit_s, env=None):
    """Whether the simulator flies until its time limit and reports; shows its output if not.

    Without any variable set for it, as from an install space, and from another directory.
    """
    scenario, results = folder / "scenario.yaml", folder / "results"
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    scenario.write_text(SCENARIO.format(time_limit_s=time_limit_s), encoding="utf-8")
    outcome = subprocess.run(
        [program, "--scenario", scenario, "--out", results, "--quiet"],
        cwd="/",
        env={"PATH": os.environ["PATH"], "HOME": str(folder), **(env or {})},
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        encoding="utf-8",
        errors="replace",
        timeout=TIMEOUT_S,
        check=False,
    )
    # Status 1: not completed within the limit, which is as it should be.
    good = outcome.returncode in (0, 1) and all(
        (results / name).is_file() for name in ("result.json", "map.ot", "report.html")
    )
    if not good:
        say(f"{outcome.stdout}\n  exit status {outcome.returncode}")
    return good
