# Copyright 2026 the Understory authors
# SPDX-License-Identifier: BSD-3-Clause
"""The catkin builds: one workspace, and one package at a time with an install space."""

import functools
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
OPTIONS += ["-DCMAKE_EXPORT_COMPILE_COMMANDS=ON"]  # for clang-tidy
PROGRAM = "lib/understory_sim/understory_simulate"


def _builds(name, command):
    log = LOGS / f"{name}.log"
    say(f"  {name}")
    good = run_logged(command + OPTIONS, log, env=CCACHE, cwd=WORKSPACE) == 0
    if not good:
        show_log(log)
    return good


@functools.lru_cache(maxsize=None)
def built_workspace():
    """The build folder of the workspace, built once for all suites that need it; None if not."""
    if shutil.which("catkin_make") is None:
        return None
    command = ["catkin_make", "-C", WORKSPACE, "--use-ninja", f"-j{JOBS}"]
    return WORKSPACE / "build" if _builds("catkin_make", command) else None


def _check(result, name, is_built, space):
    if not is_built:
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
    _check(result, "catkin_make", built_workspace() is not None, WORKSPACE / "devel")
    isolated = ["catkin_make_isolated", "-C", WORKSPACE, "--install", "--use-ninja", f"-j{JOBS}"]
    is_built = _builds("catkin_make_isolated", isolated)
    _check(result, "catkin_make_isolated", is_built, WORKSPACE / "install_isolated")
    result.duration_s = time.monotonic() - began
    return result
