# Copyright 2026 the Understory authors
# SPDX-License-Identifier: BSD-3-Clause
"""The HIL suite: every hil/test/*_hil.py and the port's GoogleTest program with a bus of their own
each, and the bus provider from outside. One at a time for every two processors: a booted kernel has
one, and where system calls are slow it takes all of it, and the host a good part of another. What
failed or was skipped runs again alone, once, and counts so if it does not pass then either; the
summary names what passed in one boot only."""

import concurrent.futures
import os
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from catkin_check import built_workspace
from commands import ROOT, run_logged, say, show_log
from junit import count_report
from results import SuiteResult

FOLDER = ROOT / "hil" / "test"
RESULTS = ROOT / "build-test" / "hil"
RUNNER = FOLDER / "run_hil.py"
FROM_HOST = FOLDER / "from_host.py"
PORT_TEST = "hil_port_test"
AT_ONCE = max(1, (os.cpu_count() or 1) // 2)
# Tests have time limits of their own; this is for what hangs as a whole. The first signal lets
# the command end, the second one ends the kernel.
TIMEOUT_S, SECOND_SIGNAL_S, KILL_S = 420, 15, 15
MOST_AGAIN_S = 300.0  # after that nothing runs again
NEVER = "machine.Never: "  # in the trace of what must not happen once

sys.path.insert(0, str(FOLDER))
from run_hil import hil_options, test_modules  # noqa: E402  pylint: disable=wrong-import-position


def with_timeout(command):
    # timeout(1) is deaf to a signal that it sent itself, so the two must differ.
    outer = ["timeout", f"--kill-after={KILL_S}", str(TIMEOUT_S + SECOND_SIGNAL_S)]
    return [*outer, "timeout", "--signal=INT", str(TIMEOUT_S), *command]


def with_bus(options, command):
    return with_timeout([ROOT / "understory", "hil", *options, "--", *command])


def why_no_bus():
    """None if some provider works here."""
    outcome = subprocess.run(
        [ROOT / "understory", "hil", "--list"],
        stdin=subprocess.DEVNULL,
        capture_output=True,
        encoding="utf-8",
        check=False,
    )
    reason = "; ".join(" ".join(line.split()) for line in outcome.stdout.splitlines())
    return None if outcome.returncode == 0 else f"no bus here: {reason or outcome.stderr}"


def jobs(folder, build_folder):
    """{name: command}; each writes its JUnit report to folder/NAME/NAME.xml."""
    report = folder / FROM_HOST.stem / f"{FROM_HOST.stem}.xml"
    from_host = [sys.executable, "-B", RUNNER, "--out", report, FROM_HOST]
    found = {FROM_HOST.stem: with_timeout(from_host)}  # first, since it takes longest
    for path in test_modules():
        report = ["--out", folder / path.stem / f"{path.stem}.xml"]
        found[path.stem] = with_bus(hil_options(path), [RUNNER, *report, path])
    for program in sorted(build_folder.rglob(PORT_TEST)) if build_folder is not None else []:
        report = folder / PORT_TEST / f"{PORT_TEST}.xml"
        if program.is_file() and os.access(program, os.X_OK):
            found[PORT_TEST] = with_bus([], [program, f"--gtest_output=xml:{report}"])
    return found


def may_be_chance(found):
    """Nothing failed that no machine is slow enough for."""
    return not any(NEVER in found.reasons.get(name, "") for name in found.failed)


def passed_in(boot, test):
    """Where a boot went wrong as a whole there is a failure without a reason, and nothing passed."""
    went_well = all(name in boot.reasons for name in boot.failed)
    return went_well and test not in boot.failed and test not in names_of_skipped(boot)


def settled(first, run_again):
    """The results that count, and what passed in one boot only. Times here are those of a shared
    machine: what failed or found no time must do so again, but what must never happen may not
    happen once."""
    if not (first.failed or first.skipped) or not may_be_chance(first):
        return first, []
    say(f"  {first.name}: again, alone")
    second = run_again()
    if not may_be_chance(second):
        return second, []
    chance = {name for name in second.failed if name in second.reasons} | names_of_skipped(second)
    chance = {name for name in chance if passed_in(first, name)}
    counts = SuiteResult(
        first.name,
        second.passed + len(chance),
        [name for name in second.failed if name not in chance],
        [(name, reason) for name, reason in second.skipped if name not in chance],
    )
    recovered = (set(first.failed) | names_of_skipped(first)) - set(second.failed)
    return counts, sorted(recovered - names_of_skipped(second) | chance)


def names_of_skipped(boot):
    return {name for name, _ in boot.skipped}


def run_once(name, command, folder):
    began = time.monotonic()
    result = SuiteResult(name)
    environment = {"UNDERSTORY_BUILD": str(ROOT / "build-test"), "PYTHONDONTWRITEBYTECODE": "1"}
    status = run_logged(command, folder / name / "test.log", env=environment)
    report = folder / name / f"{name}.xml"
    if report.exists():
        count_report(report, name, result)
    if not report.exists() or result.ran + len(result.skipped) == 0:
        result.failed.append(f"{name} produced no results (status {status})")
    elif status != 0 and not result.failed:
        result.failed.append(f"{name} ended with status {status}")
    result.duration_s = time.monotonic() - began
    return result


def show_job(found, folder):
    count = found.ran + len(found.skipped)
    say(f"  {found.name}: {count} tests, {found.duration_s:.0f} s")
    if found.failed:
        show_log(folder / found.name / "test.log")


def run_hil_tests(build_folder=None):
    """One SuiteResult; `build_folder`: where the port's test program was built, if it was."""
    say("\n== hil: the bus, with a kernel that has CAN")
    began = time.monotonic()
    result = SuiteResult("hil")
    reason = why_no_bus()
    if reason is not None:
        result.is_absent = not os.environ.get("CI")
        if result.is_absent:
            result.skipped.append(("hil", reason))
        else:
            result.failed.append(reason)
        return result
    built_workspace()  # whole missions fly the onboard process; if it does not compile, they say so
    RESULTS.mkdir(parents=True, exist_ok=True)
    folder = Path(tempfile.mkdtemp(prefix="run_", dir=RESULTS))
    with concurrent.futures.ThreadPoolExecutor(AT_ONCE) as pool:
        todo = jobs(folder, build_folder).items()
        runs = {pool.submit(run_once, name, command, folder): name for name, command in todo}
        done = []
        for run in concurrent.futures.as_completed(runs):
            done.append(run.result())
            show_job(done[-1], folder)
    add_settled(done, jobs(folder / "alone", build_folder), folder / "alone", result)
    if not result.failed:
        shutil.rmtree(folder)
    result.duration_s = time.monotonic() - began
    return result


def add_settled(done, commands, folder, result):
    """`done`: the first results of each job."""
    began = time.monotonic()
    once = []
    for first in done:

        def run_again(name=first.name):
            found = run_once(name, commands[name], folder)
            show_job(found, folder)
            return found

        is_late = time.monotonic() - began > MOST_AGAIN_S
        found, recovered = (first, []) if is_late else settled(first, run_again)
        once += recovered
        result.passed += found.passed
        result.failed += found.failed
        result.skipped += found.skipped
    if once:
        result.note = f"passed in one of two boots only: {', '.join(once)}"
