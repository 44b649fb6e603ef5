# Copyright 2026 the Understory authors
# SPDX-License-Identifier: BSD-3-Clause
"""Builds for the tests and runs of their ctest entries."""

import collections
import concurrent.futures
import json
import os
import re
import shutil
import time
import xml.etree.ElementTree

from commands import JOBS, ROOT, output_of, run_logged, say, show_log
from junit import count_report
from results import SuiteResult

CHECKED = ["-DCMAKE_BUILD_TYPE=Release", "-DUNDERSTORY_ASSERTS=ON", "-DUNDERSTORY_WERROR=ON"]
SANITIZED = [
    "-DCMAKE_BUILD_TYPE=RelWithDebInfo",
    "-DCMAKE_CXX_FLAGS_RELWITHDEBINFO=-O1 -g1",
    "-DUNDERSTORY_ASSERTS=ON",
]
PIECES, PIECE_TIMEOUT_S = 16, 600  # of a test program under a sanitizer
# Clones and build folders share what is compiled alike.
CCACHE = {
    "CCACHE_BASEDIR": str(ROOT),
    "CCACHE_NOHASHDIR": "1",
    "CCACHE_SLOPPINESS": "pch_defines,time_macros",
}


def build(folder_name, options, targets):
    """Configures and builds; returns the folder, or None after showing why it failed."""
    folder = ROOT / folder_name
    log = folder / "test_build.log"
    began = time.monotonic()
    cache = folder / "CMakeCache.txt"
    if cache.exists() and f"CMAKE_HOME_DIRECTORY:INTERNAL={ROOT}\n" not in cache.read_text():
        shutil.rmtree(folder)  # made when the clone was elsewhere
    configure = ["cmake", "-S", ROOT, "-B", folder, "-G", "Ninja", *options]
    steps = [configure, ["ninja", "-C", folder, "-j", JOBS, *targets]]
    for step in steps:
        if run_logged(step, log, env={**CCACHE, "NINJA_STATUS": "[%f/%t] "}) != 0:
            show_log(log)
            say(f"{folder_name}: the build failed")
            return None
    say(f"  built in {time.monotonic() - began:.0f} s")
    return folder


def _labels(folder):
    """{test name: label}; a test without one belongs to `other`."""
    listed = json.loads(output_of(["ctest", "--test-dir", folder, "--show-only=json-v1"]))
    labels = {}
    for test in listed["tests"]:
        properties = {entry["name"]: entry["value"] for entry in test.get("properties", [])}
        labels[test["name"]] = (properties.get("LABELS") or ["other"])[0]
    return labels


def _skip_reason(output, status):
    """Why GoogleTest skipped: the lines after `file:line: Skipped`."""
    match = re.search(r": Skipped\n(.*?)\n*\[  SKIPPED", output, re.DOTALL)
    reason = " ".join(match[1].split()) if match else ""
    return reason or (status if status == "disabled" else "no reason given")


def run_ctest(folder, label_pattern="", suffix="", env=None):
    """Runs the tests whose label matches; returns one SuiteResult per label."""
    report = folder / "ctest.xml"
    report.unlink(missing_ok=True)
    labels = _labels(folder)
    command = ["ctest", "--test-dir", folder, "-j", str(os.cpu_count() or 1)]
    command += ["--output-on-failure", "--no-tests=error", "--output-junit", report]
    command += ["-L", label_pattern] if label_pattern else []
    began = time.monotonic()
    status = run_logged(command, folder / "test_run.log", env=env)
    if not report.exists():
        show_log(folder / "test_run.log")
        return [SuiteResult("ctest" + suffix, failed=["ctest did not run"])]
    results = collections.defaultdict(SuiteResult)
    for case in xml.etree.ElementTree.parse(report).getroot().iter("testcase"):
        label = labels.get(case.get("name"), "other") + suffix
        result = results.setdefault(label, SuiteResult(label))
        result.duration_s += float(case.get("time") or 0.0)
        count_case(case, result)
    failures = sum(len(result.failed) for result in results.values())
    if status != 0 and failures == 0:
        show_log(folder / "test_run.log")
        results["ctest"] = SuiteResult("ctest", failed=[f"ctest ended with status {status}"])
    say(f"  ran in {time.monotonic() - began:.0f} s")
    return list(results.values())


def run_in_pieces(program, name, env):
    """A GoogleTest program's tests in PIECES processes, as SuiteResult `name`. One process for each
    test, as ctest has it, takes longer to start with a sanitizer than most tests take."""
    result = SuiteResult(name)
    began = time.monotonic()
    folder = program.parent / name
    shutil.rmtree(folder, ignore_errors=True)

    def run(piece):
        report = folder / f"{piece}.xml"
        shard = {"GTEST_TOTAL_SHARDS": str(PIECES), "GTEST_SHARD_INDEX": str(piece)}
        command = ["timeout", str(PIECE_TIMEOUT_S), program, f"--gtest_output=xml:{report}"]
        status = run_logged(command, folder / f"{piece}.log", env={**env, **shard})
        return piece, status, report

    with concurrent.futures.ThreadPoolExecutor(os.cpu_count() or 1) as pool:
        for piece, status, report in pool.map(run, range(PIECES)):
            failed_before = len(result.failed)
            if report.exists():
                count_report(report, program.name, result)
            if status != 0 and len(result.failed) == failed_before:
                result.failed.append(f"{program.name}, piece {piece}, ended with status {status}")
            if status != 0:
                show_log(folder / f"{piece}.log")
            say(f"  {piece + 1} of {PIECES}")
    result.duration_s = time.monotonic() - began
    return result


def count_case(case, result):
    """Adds one entry of the ctest report to the result of its suite."""
    name, status = case.get("name"), case.get("status")
    output = case.findtext("system-out") or ""
    skipped = case.find("skipped")
    # ctest calls "not run" what GoogleTest skipped, but also a program that is not there.
    by_choice = status == "disabled" or (
        skipped is not None and skipped.get("message", "").startswith("SKIP_")
    )
    if status == "run":
        result.passed += 1
    elif by_choice and "[  FAILED  ]" not in output:
        result.skipped.append((name, _skip_reason(output, status)))
    else:
        result.failed.append(name)
        say(f"\n-- FAILED: {name}\n{output}")
