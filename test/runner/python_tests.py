# Copyright 2026 the Understory authors
# SPDX-License-Identifier: BSD-3-Clause
"""The Python unit tests: every *_test.py of the project, each file in a process of its own.

Run with a file as argument, this module runs that file's tests and prints the outcome as JSON.
"""

import importlib.util
import json
import pathlib
import subprocess
import sys
import time
import unittest

from commands import ROOT, our_files, say
from results import SuiteResult

TIMEOUT_S = 300


def _run_file(path):
    spec = importlib.util.spec_from_file_location(path.stem, path)
    module = importlib.util.module_from_spec(spec)
    sys.modules[path.stem] = module
    spec.loader.exec_module(module)
    tests = unittest.defaultTestLoader.loadTestsFromModule(module)
    outcome = unittest.TextTestRunner(stream=sys.stderr).run(tests)
    bad = [case.id() for case, _ in outcome.failures + outcome.errors]
    bad += [case.id() for case in outcome.unexpectedSuccesses]
    skipped = [(case.id(), reason) for case, reason in outcome.skipped]
    # Subtests may fail more than once per test.
    good = outcome.testsRun - len(set(bad)) - len(skipped)
    print(json.dumps({"passed": max(0, good), "failed": bad, "skipped": skipped}))


def run_python_tests():
    say("\n== python: unit tests")
    began = time.monotonic()
    result = SuiteResult("python")
    for name in [name for name in our_files() if name.endswith("_test.py")]:
        try:
            outcome = subprocess.run(
                [sys.executable, "-B", __file__, ROOT / name],
                cwd=ROOT,
                stdin=subprocess.DEVNULL,
                stdout=subprocess.PIPE,
                stderr=subprocess.PIPE,
                encoding="utf-8",
                timeout=TIMEOUT_S,
                check=False,
            )
            found = json.loads(outcome.stdout.splitlines()[-1])
        except subprocess.TimeoutExpired:
            result.failed.append(f"{name}: not done after {TIMEOUT_S} s")
            continue
        except (IndexError, ValueError):
            say(outcome.stdout + outcome.stderr)
            result.failed.append(f"{name}: could not be run")
            continue
        if found["failed"]:
            say(outcome.stderr)
        result.passed += found["passed"]
        result.failed += found["failed"]
        result.skipped += [tuple(entry) for entry in found["skipped"]]
    result.duration_s = time.monotonic() - began
    return result


if __name__ == "__main__":
    _run_file(pathlib.Path(sys.argv[1]))
