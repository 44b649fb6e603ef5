# Copyright 2026 the Understory authors
# SPDX-License-Identifier: BSD-3-Clause
"""The catkin builds: one workspace, and one package at a time with an install space."""

import shutil
import time

from builds import CCACHE
from commands import JOBS, ROOT, run_logged, say, show_log
from results import SuiteResult
from short_flight import flies

WORKSPACE = ROOT / "catkin_ws"
LOGS = ROOT / "build-test" / "catkin"
# The tests were built by the plain build; here the libraries and programs count.
OPTIONS = ["-DCMAKE_BUILD_TYPE=Release", "-DCATKIN_ENABLE_TESTING=OFF"]
PROGRAM = "lib/understory_sim/understory_simulate"



def _build(result, name, command, space):
    log = LOGS / f"{name}.log"
    say(f"  {name}")
    if run_logged(command + OPTIONS, log, env=CCACHE, cwd=WORKSPACE) != 0:
        show_log(log)
        result.failed.append(f"{name} failed")
    elif not (space / PROGRAM).exists() or not flies(space / PROGRAM, LOGS / name, 2.0):
        result.failed.append(f"{name}: {space / PROGRAM} does not fly")
    else:
        result.passed += 1


def check_catkin():
    say("\n== catkin: the packages build with catkin_make and catkin_make_isolated")
    began = time.monotonic()
    result = SuiteResult("catkin")
    if shutil.which("catkin_make") is None:
        result.skipped.append(("catkin", "catkin_make is not installed"))
        return result
    _build(
        result,
        "catkin_make",
        ["catkin_make", "-C", WORKSPACE, "--use-ninja", f"-j{JOBS}"],
        WORKSPACE / "devel",
    )
    _build(
        result,
        "catkin_make_isolated",
        ["catkin_make_isolated", "-C", WORKSPACE, "--install", "--use-ninja", f"-j{JOBS}"],
        WORKSPACE / "install_isolated",
    )
    result.duration_s = time.monotonic() - began
    return result
