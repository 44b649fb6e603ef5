# Copyright 2026 the Understory authors
# SPDX-License-Identifier: BSD-3-Clause
"""The test command: every check and test of the project, with a summary at the end.

Called by `understory test` once all packages are installed.
"""

import argparse
import pathlib
import subprocess
import sys
import time
import traceback

import builds
from catkin_check import built_workspace, check_catkin
from commands import ROOT, cpp_files, output_of, say
from hil_tests import run_hil_tests
from python_tests import run_python_tests
from results import SuiteResult, check_minimums, read_minimums, summary, totals
from ros_tests import run_ros_tests
from short_flight import flies
from static_checks import check_format, check_shell
from tidy import check_tidy

QUICK_SUITES = ["format", "shell", "unit", "python"]
HIL_SUITES = ["build", "hil"]
LEAKS_OF_LIBRARIES = pathlib.Path(__file__).parent / "lsan_suppressions.txt"
SANITIZER_ENV = {
    "ASAN_OPTIONS": "strict_string_checks=1:detect_stack_use_after_return=1",
    "LSAN_OPTIONS": f"suppressions={LEAKS_OF_LIBRARIES}:print_suppressions=0",
    "UBSAN_OPTIONS": "print_stacktrace=1",
}


def run_build(quick):
    """(build folder or None, result)."""
    say("\n== build: optimised, with assertions, warnings are errors")
    began = time.monotonic()
    folder = builds.build("build-test", builds.CHECKED, ["test_unit"] if quick else ["all"])
    built = SuiteResult("build", passed=1, duration_s=time.monotonic() - began)
    if folder is None:
        built.passed, built.failed = 0, ["build-test does not compile"]
    return folder, built


def run_build_and_ctest(quick):
    """(build folder or None, results)."""
    folder, built = run_build(quick)
    if folder is None:
        return None, [built]
    say("\n== ctest: " + ("unit tests" if quick else "unit, thread, noise, property, scenario tests"))
    return folder, [built] + guarded("ctest", builds.run_ctest, folder, "^unit$" if quick else "")


def check_page(result, program, page, command):
    """`page` must be what the program prints as its parameters."""
    if not program.exists():
        result.failed.append(f"{program} was not built")
        return
    printed = subprocess.run(
        [program, "--print-parameters"],
        stdin=subprocess.DEVNULL,
        capture_output=True,
        encoding="utf-8",
        timeout=60,
        check=False,
    )
    path = ROOT / page
    if printed.returncode != 0 or not printed.stdout.strip():
        result.failed.append(f"{program.name} --print-parameters failed: {printed.stderr.strip()}")
    elif not path.exists() or path.read_text(encoding="utf-8") != printed.stdout:
        result.failed.append(
            f"{page} is not current; write it anew with `{command} --print-parameters > {page}`"
        )
    else:
        result.passed += 1


def check_protocol_page(result):
    page, generator = "docs/can_protocol.md", ROOT / "firmware_bridge/can/generate.py"
    command = ["/usr/bin/python3", generator, "docs", ROOT / "firmware_bridge/can/understory.dbc"]
    if (ROOT / page).read_text(encoding="utf-8") == output_of(command):
        result.passed += 1
    else:
        result.failed.append(
            f"{page} is not current; write it anew with `firmware_bridge/can/generate.py docs"
            f" firmware_bridge/can/understory.dbc > {page}`"
        )


def check_parameters(folder):
    say("\n== parameters: the generated pages of docs/ are current")
    result = SuiteResult("parameters")
    check_protocol_page(result)
    simulate = folder / "src/understory_sim/understory_simulate"
    check_page(result, simulate, "docs/parameters.md", "./understory simulate")
    workspace = built_workspace()
    if workspace is None:
        result.failed.append("the workspace does not compile")
    else:
        onboard = workspace.parent / "devel/lib/understory_nodelets/onboard"
        check_page(
            result, onboard, "docs/onboard_parameters.md", "rosrun understory_nodelets onboard"
        )
    return result


def run_tidy(folder):
    """Of the plain build's files, and of those that only the catkin workspace compiles."""
    say("\n== build: the catkin workspace")
    workspace = built_workspace()
    return check_tidy([folder] if workspace is None else [folder, workspace])


def run_sanitized():
    say("\n== asan: unit tests, noise on the bus, a flight under address and undefined-behaviour sanitizers")
    options = builds.SANITIZED + ["-DUNDERSTORY_SANITIZE=address,undefined"]
    began = time.monotonic()
    folder = builds.build("build-asan-test", options, ["understory_sanitized_tests"])
    if folder is None:
        return [SuiteResult("unit-asan", failed=["build-asan-test does not compile"])]
    results = [builds.run_in_pieces(folder / "test/test_unit", "unit-asan", SANITIZER_ENV)]
    results += builds.run_ctest(folder, "^noise$", "-asan", SANITIZER_ENV)
    say("  a short flight")
    flight = SuiteResult("flight-asan")
    program = folder / "src/understory_sim/understory_simulate"
    if flies(program, folder / "short_flight", 10.0, SANITIZER_ENV):
        flight.passed = 1
    else:
        flight.failed.append("a flight of 10 s, see above")
    results.append(flight)
    say(f"  {time.monotonic() - began:.0f} s in all")
    return results


def run_thread_sanitized():
    say("\n== tsan: tests of what runs on threads, under the thread sanitizer")
    options = builds.SANITIZED + ["-DUNDERSTORY_SANITIZE=thread"]
    folder = builds.build("build-tsan-test", options, ["test_threads"])
    if folder is None:
        return [SuiteResult("threads-tsan", failed=["build-tsan-test does not compile"])]
    return builds.run_ctest(folder, "^threads$", "-tsan", {"TSAN_OPTIONS": "halt_on_error=1"})


def guarded(name, suite, *arguments):
    """The suite's results as a list; a suite that breaks down is a failed one, not the end."""
    try:
        found = suite(*arguments)
    except Exception:  # pylint: disable=broad-except
        traceback.print_exc()
        return [SuiteResult(name, failed=["broke down, see above"])]
    return found if isinstance(found, list) else [found]


def run_hil_alone():
    folder, built = run_build(False)
    return [built] + (guarded("hil", run_hil_tests, folder) if folder is not None else [])


def run_all(quick):
    results = guarded("format", check_format) + guarded("shell", check_shell)
    folder, built = run_build_and_ctest(quick)
    results += built
    results += guarded("python", run_python_tests)
    if quick:
        return results
    if folder is not None:
        results += guarded("parameters", check_parameters, folder)
        results += guarded("ros", run_ros_tests)
        results += guarded("clang-tidy", run_tidy, folder)
    results += guarded("hil", run_hil_tests, folder)
    results += guarded("unit-asan", run_sanitized)
    results += guarded("threads-tsan", run_thread_sanitized)
    results += guarded("catkin", check_catkin)
    return results


def main():
    parser = argparse.ArgumentParser(prog="understory test")
    choice = parser.add_mutually_exclusive_group()
    choice.add_argument("--quick", action="store_true")
    choice.add_argument("--hil", action="store_true")
    options = parser.parse_args()
    began = time.monotonic()
    minimums = read_minimums(ROOT / "test" / "expected_counts.txt")
    required = sorted(minimums)
    if options.hil:
        results, required = run_hil_alone(), HIL_SUITES
    else:
        results = run_all(options.quick)
        required = QUICK_SUITES if options.quick else required
    check_minimums(results, minimums, required)
    say(f"\n== summary ({(time.monotonic() - began) / 60:.1f} minutes)")
    say(summary(results))
    return 1 if totals(results)[1] else 0


if __name__ == "__main__":
    try:
        sys.exit(main())
    except KeyboardInterrupt:
        sys.exit(130)
