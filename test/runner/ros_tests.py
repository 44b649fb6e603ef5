# Copyright 2026 the Understory authors
# SPDX-License-Identifier: BSD-3-Clause
"""The tests of the onboard host: every .test file of test/ros, each with its own ROS master."""

import shutil
import sys
import time
import unittest

from catkin_check import WORKSPACE, built_workspace
from commands import ROOT, run_logged, say, show_log
from junit import count_report
from results import SuiteResult

sys.path.append(str(ROOT / "test" / "support"))
from machine import attempted  # noqa: E402  pylint: disable=wrong-import-position

FOLDER = ROOT / "test" / "ros"
RESULTS = ROOT / "build-test" / "ros"
# Tests have time limits of their own; this is for a rostest that hangs itself.
TIMEOUT_S = 960
# Whose programs themselves try again what a machine that stood still spoiled. The others are
# short: they run again as a whole.
PATIENT = ("robustness", "sameness", "services")


def count_results(folder, name, result):
    """Adds the results of one .test file; returns how many tests they tell of."""
    before = result.ran + len(result.skipped)
    for path in sorted(folder.rglob("rosunit-*.xml")):
        count_report(path, name, result)
    counted = result.ran + len(result.skipped) - before
    # rostest's own report has a case per program: failed if it hung, died or reported nothing.
    own = SuiteResult(name)
    for path in folder.rglob("rostest-*.xml"):
        count_report(path, name, own)
    result.failed += own.failed
    return counted


def _run_once(test):
    """Its results, and how many tests they tell of."""
    folder = RESULTS / test.stem
    shutil.rmtree(folder, ignore_errors=True)
    result = SuiteResult(test.stem)
    status = run_logged(
        ["timeout", "--kill-after=30", str(TIMEOUT_S), WORKSPACE / "devel" / "env.sh"]
        + ["rostest", "--results-base-dir", folder, test],
        folder / "rostest.log",
        env={"ROS_HOME": str(folder / "home"), "ROS_HOSTNAME": "localhost"},
    )
    counted = count_results(folder, test.stem, result)
    if counted == 0:
        result.failed.append(f"{test.name} produced no results")
    elif status != 0 and not result.failed:
        result.failed.append(f"{test.name}: rostest ended with status {status}")
    if result.failed:
        show_log(folder / "rostest.log")
    return result, counted


def outcome_of(test, run_once, attempts=attempted):
    """Where the machine stood still, what failed runs again; was it hopeless, that is skipped."""
    if test.stem in PATIENT:
        return run_once(test)
    found = []

    def run(_):
        found[:] = run_once(test)
        if found[0].failed:
            raise AssertionError(found[0].failed[0])

    try:
        attempts(run)
    except unittest.SkipTest as reason:
        result = found[0]
        result.skipped += [(name, str(reason)) for name in result.failed]
        result.failed.clear()
    except AssertionError:
        pass  # it is among the results
    return tuple(found)


def _run(test, result):
    began = time.monotonic()
    found, counted = outcome_of(test, _run_once)
    result.passed += found.passed
    result.failed += found.failed
    result.skipped += found.skipped
    say(f"  {test.stem}: {counted} tests, {time.monotonic() - began:.0f} s")


def run_ros_tests():
    say("\n== ros: the onboard host, as a process and in one, with rostest")
    began = time.monotonic()
    result = SuiteResult("ros")
    if shutil.which("rostest") is None:
        result.skipped.append(("ros", "rostest is not installed"))
        return result
    if built_workspace() is None:
        result.failed.append("the workspace does not compile")
        return result
    for test in sorted(FOLDER.glob("*.test")):
        _run(test, result)
    result.duration_s = time.monotonic() - began
    return result
