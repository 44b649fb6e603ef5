#!/usr/bin/python3
# Copyright 2026 the Understory authors
# SPDX-License-Identifier: BSD-3-Clause
"""Runs HIL tests where a CAN bus is: unittest modules named *_hil.py.

usage: understory hil -- hil/test/run_hil.py [--out FILE] [-k PATTERN] [MODULE]...
Without MODULE all of this folder. Prints a line per test; --out writes a JUnit report besides. A
module may want options of the provider, see hil_options(); those must be given to it by hand.
Exit status: 0 if none failed.
"""

import argparse
import ast
import faulthandler
import importlib.util
import signal
import sys
import time
import unittest
from pathlib import Path
from typing import Any, List, Optional, Tuple
from xml.etree import ElementTree

HERE = Path(__file__).resolve().parent
TEST_PATIENCE_S = 120


def hil_options(path: Path) -> List[str]:
    """What the module wants of the provider: its constant HIL_OPTIONS, read without running it."""
    for node in ast.parse(path.read_text(encoding="utf-8")).body:
        if isinstance(node, ast.Assign) and isinstance(node.targets[0], ast.Name):
            if node.targets[0].id == "HIL_OPTIONS":
                return list(ast.literal_eval(node.value))
    return []


def test_modules() -> List[Path]:
    return sorted(path for path in HERE.glob("*_hil.py") if path != Path(__file__).resolve())


class TooLong(Exception):
    pass


def _on_alarm(*_: Any) -> None:
    raise TooLong(f"not done after {TEST_PATIENCE_S} s")


class Outcome(unittest.TestResult):
    """Prints a line per test and keeps what the report needs."""

    def __init__(self, total: int) -> None:
        super().__init__()
        self.cases: List[Tuple[str, float, str, str]] = []  # name, duration, kind, text
        self._total = total
        self._began = 0.0
        self._kind, self._text = "", ""

    def startTest(self, test: unittest.TestCase) -> None:
        super().startTest(test)
        self._began, self._kind, self._text = time.monotonic(), "", ""
        signal.alarm(TEST_PATIENCE_S)

    def stopTest(self, test: unittest.TestCase) -> None:
        signal.alarm(0)
        super().stopTest(test)
        self._keep(test.id(), time.monotonic() - self._began)

    def _keep(self, name: str, duration_s: float) -> None:
        self.cases.append((name, duration_s, self._kind, self._text))
        verdict = {"": "ok", "failure": "FAILED", "skipped": "skipped"}[self._kind]
        number = f"{len(self.cases)} of {self._total}"
        print(f"{number}: {name} {verdict} {duration_s:.1f} s", flush=True)
        if self._text:
            print(self._text, flush=True)

    def _fail(self, test: unittest.TestCase, text: str) -> None:
        self._kind, self._text = "failure", f"{self._text}{text}"
        if not isinstance(test, unittest.TestCase):  # setUpClass, setUpModule
            self._keep(str(test), 0.0)

    def addError(self, test: Any, err: Any) -> None:
        super().addError(test, err)
        self._fail(test, self.errors[-1][1])

    def addFailure(self, test: Any, err: Any) -> None:
        super().addFailure(test, err)
        self._fail(test, self.failures[-1][1])

    def addSubTest(self, test: Any, subtest: Any, err: Any) -> None:
        super().addSubTest(test, subtest, err)
        if err is not None:
            self._fail(test, f"{subtest}: {(self.failures + self.errors)[-1][1]}")

    def addUnexpectedSuccess(self, test: Any) -> None:
        super().addUnexpectedSuccess(test)
        self._fail(test, "passed, but was expected to fail")

    def addSkip(self, test: Any, reason: str) -> None:
        super().addSkip(test, reason)
        self._kind, self._text = "skipped", reason
        if not isinstance(test, unittest.TestCase):
            self._keep(str(test), 0.0)


def load(paths: List[Path], pattern: Optional[str]) -> unittest.TestSuite:
    suite = unittest.TestSuite()
    loader = unittest.TestLoader()
    loader.testNamePatterns = [f"*{pattern}*"] if pattern else None
    sys.path.insert(0, str(HERE))  # what test modules share
    for path in paths:
        spec = importlib.util.spec_from_file_location(path.stem, path)
        assert spec is not None and spec.loader is not None
        module = importlib.util.module_from_spec(spec)
        sys.modules[path.stem] = module
        spec.loader.exec_module(module)
        suite.addTests(loader.loadTestsFromModule(module))
    return suite


def write_report(path: Path, cases: List[Tuple[str, float, str, str]]) -> None:
    root = ElementTree.Element("testsuite", name="hil", tests=str(len(cases)))
    for name, duration_s, kind, text in cases:
        group, _, short = name.rpartition(".")
        entry = ElementTree.SubElement(
            root, "testcase", classname=group, name=short, time=f"{duration_s:.3f}"
        )
        if kind:
            ElementTree.SubElement(entry, kind, message=text.strip().split("\n")[-1]).text = text
    path.parent.mkdir(parents=True, exist_ok=True)
    ElementTree.ElementTree(root).write(path, encoding="utf-8")


def main() -> int:
    parser = argparse.ArgumentParser(prog="run_hil.py", description="Runs HIL tests.")
    parser.add_argument("--out", type=Path, help="JUnit report")
    parser.add_argument("-k", dest="pattern", help="only tests with this in their names")
    parser.add_argument("modules", nargs="*", type=Path)
    options = parser.parse_args()
    faulthandler.enable()
    signal.signal(signal.SIGALRM, _on_alarm)
    suite = load(options.modules or test_modules(), options.pattern)
    outcome = Outcome(suite.countTestCases())
    suite.run(outcome)
    if options.out is not None:
        write_report(options.out, outcome.cases)
    return 0 if outcome.wasSuccessful() else 1


if __name__ == "__main__":
    sys.exit(main())
