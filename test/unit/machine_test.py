#!/usr/bin/python3
# Copyright 2026 the Understory authors
# SPDX-License-Identifier: BSD-3-Clause
"""What a machine that stood still excuses and what it does not."""

import contextlib
import io
import pathlib
import sys
import traceback
import unittest
import unittest.mock

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "test" / "support"), str(ROOT / "test" / "runner")]

import hil_tests  # noqa: E402
import machine  # noqa: E402
import ros_tests  # noqa: E402
from results import SuiteResult  # noqa: E402


class FakeMachine:
    def __init__(self, trouble="", is_hopeless=False):
        self._trouble = trouble
        self._is_hopeless = is_hopeless
        self.is_closed = False

    def trouble(self):
        return self._trouble

    def is_hopeless(self):
        return self._is_hopeless

    def close(self):
        self.is_closed = True


def calm():
    return FakeMachine()


def stalled():
    return FakeMachine("it stood still")


def hopeless():
    return FakeMachine("it stood still", True)


class Attempts:
    """What is done fails at all attempts but those in `good`; the machines are of this order."""

    def __init__(self, *machines, good=(), error=AssertionError("late"), patience=None):
        self._machines = iter(machines)
        self._good = good
        self._error = error
        self._patience = patience or machine.Patience()
        self.made = []
        self.count = 0
        self.pauses = 0

    def _next_machine(self):
        self.made.append(next(self._machines)())
        return self.made[-1]

    def _act(self, now):
        assert now is self.made[-1]
        self.count += 1
        if self.count in self._good:
            return self.count
        raise self._error

    def _pause(self):
        self.pauses += 1

    def run(self):
        with contextlib.redirect_stdout(io.StringIO()):
            return machine.attempted(
                self._act,
                machine_of_now=self._next_machine,
                before_another=self._pause,
                patience=self._patience,
            )


class WhatCounts(unittest.TestCase):
    def test_success_counts_on_any_machine(self):
        attempts = Attempts(hopeless, good=(1,))

        self.assertEqual(attempts.run(), 1)
        self.assertEqual((attempts.count, attempts.pauses), (1, 0))

    def test_a_failure_on_a_calm_machine_counts_at_once(self):
        attempts = Attempts(calm, good=(2,))

        with self.assertRaisesRegex(AssertionError, "late"):
            attempts.run()
        self.assertEqual(attempts.count, 1)

    def test_a_failure_on_a_stalled_machine_is_tried_again_after_a_pause(self):
        attempts = Attempts(stalled, calm, good=(2,))

        self.assertEqual(attempts.run(), 2)
        self.assertEqual(attempts.pauses, 1)

    def test_each_attempt_is_judged_by_its_own_machine(self):
        attempts = Attempts(hopeless, calm, good=(3,))

        with self.assertRaises(AssertionError):
            attempts.run()
        self.assertEqual(attempts.count, 2)

    def test_the_last_failure_counts_if_the_machine_was_merely_slow(self):
        attempts = Attempts(hopeless, hopeless, stalled)

        with self.assertRaisesRegex(AssertionError, "late"):
            attempts.run()
        self.assertEqual(attempts.count, machine.ATTEMPTS)

    def test_where_the_last_machine_was_hopeless_it_is_skipped_with_both_reasons(self):
        attempts = Attempts(stalled, stalled, hopeless)

        with self.assertRaisesRegex(unittest.SkipTest, "it stood still; late"):
            attempts.run()

    def test_what_must_never_happen_counts_on_a_hopeless_machine(self):
        attempts = Attempts(hopeless, good=(2,), error=machine.Never("a collision"))

        with self.assertRaisesRegex(machine.Never, "a collision"):
            attempts.run()
        self.assertEqual(attempts.count, 1)

    def test_errors_of_another_kind_count_at_once(self):
        attempts = Attempts(hopeless, good=(2,), error=KeyError("wrong"))

        with self.assertRaises(KeyError):
            attempts.run()

    def test_every_machine_is_let_go(self):
        attempts = Attempts(stalled, stalled, hopeless)

        with self.assertRaises(unittest.SkipTest):
            attempts.run()
        self.assertEqual([one.is_closed for one in attempts.made], [True] * 3)

    def test_without_time_left_the_first_failure_is_the_last(self):
        for kind, verdict in ((stalled, AssertionError), (hopeless, unittest.SkipTest)):
            attempts = Attempts(kind, good=(2,), patience=machine.Patience(0.0))

            with self.assertRaises(verdict):
                attempts.run()


class Tests(unittest.TestCase):
    """A test of a PatientTest."""

    def outcome_of(self, body, *machines):
        """What unittest says, and in which order things were done."""
        done = []

        class Inner(machine.PatientTest):
            def setUp(self):
                done.append("set up")
                self.addCleanup(done.append, "cleaned up")

            def show_programs(self):
                done.append("shown")

            def test_it(self):
                done.append("tested")
                body(self, done.count("tested"))

        made = iter(machines)
        result = unittest.TestResult()
        with unittest.mock.patch.object(machine, "Machine", lambda: next(made)()):
            with unittest.mock.patch.object(machine, "wait_for_calm", lambda: done.append("calm")):
                with contextlib.redirect_stdout(io.StringIO()):
                    Inner("test_it").run(result)
        return result, done

    def test_another_attempt_begins_after_cleanups_a_pause_and_set_up(self):
        result, done = self.outcome_of(
            lambda test, attempt: test.assertEqual(attempt, 2), stalled, calm
        )

        self.assertTrue(result.wasSuccessful())
        first = ["set up", "tested", "shown", "cleaned up", "calm"]
        self.assertEqual(done, first + ["set up", "tested", "cleaned up"])

    def test_a_hopeless_machine_is_a_skip_that_is_counted(self):
        result, done = self.outcome_of(
            lambda test, _: test.fail("late"), hopeless, hopeless, hopeless
        )

        self.assertEqual(len(result.skipped), 1)
        self.assertEqual(result.skipped[0][1], "it stood still; late")
        self.assertEqual(done.count("cleaned up"), 3)

    def test_what_must_never_happen_is_a_failure(self):
        result, _ = self.outcome_of(
            lambda test, _: test.assert_never([1, 2], "collisions"), hopeless
        )

        self.assertEqual(len(result.failures), 1)
        self.assertIn("collisions: [1, 2]", result.failures[0][1])


class TestFiles(unittest.TestCase):
    """A .test file of ROS as a whole."""

    def outcome_of(self, name, *machines, good=()):
        runs = []
        made = iter(machines)

        def run_once(_):
            runs.append(name)
            failed = [] if len(runs) in good else [f"{name}: it fails"]
            return SuiteResult(name, passed=2, failed=failed), 3

        def attempts(act):
            return machine.attempted(
                act, machine_of_now=lambda: next(made)(), before_another=lambda: None
            )

        with contextlib.redirect_stdout(io.StringIO()):
            result, count = ros_tests.outcome_of(pathlib.Path(f"{name}.test"), run_once, attempts)
        self.assertEqual(count, 3)
        return result, len(runs)

    def test_it_runs_again_after_a_stall_and_only_the_last_run_counts(self):
        result, runs = self.outcome_of("topics", stalled, calm, good=(2,))

        self.assertEqual((result.passed, result.failed, result.skipped), (2, [], []))
        self.assertEqual(runs, 2)

    def test_a_failure_on_a_calm_machine_is_one(self):
        result, runs = self.outcome_of("topics", calm)

        self.assertEqual((result.failed, result.skipped), (["topics: it fails"], []))
        self.assertEqual(runs, 1)

    def test_on_a_hopeless_machine_what_failed_is_skipped(self):
        result, _ = self.outcome_of("topics", hopeless, hopeless, hopeless)

        self.assertEqual(result.failed, [])
        self.assertEqual(result.passed, 2)
        self.assertEqual(
            result.skipped, [("topics: it fails", "it stood still; topics: it fails")]
        )

    def test_one_whose_tests_try_again_themselves_runs_once(self):
        result, runs = self.outcome_of("robustness")

        self.assertEqual(result.failed, ["robustness: it fails"])
        self.assertEqual(runs, 1)

    def test_those_are_files_that_exist(self):
        for name in ros_tests.PATIENT:
            self.assertTrue((ros_tests.FOLDER / f"{name}.test").exists(), name)


class HilJobs(unittest.TestCase):
    """A boot's results, and those of another if it is wanted."""

    @staticmethod
    def settled(first, *again):
        runs = iter(again)
        with contextlib.redirect_stdout(io.StringIO()):
            found = hil_tests.settled(first, lambda: next(runs))
        assert next(runs, None) is None, "it did not run again"
        return found

    @staticmethod
    def one_of_two(failed):
        reasons = {name: "AssertionError: late" for name in failed}
        return SuiteResult("wire_hil", passed=2 - len(failed), failed=failed, reasons=reasons)

    def test_a_test_counts_as_failed_if_it_fails_in_both_boots_and_else_is_named(self):
        first, other = self.one_of_two(["wire_hil: a"]), self.one_of_two(["wire_hil: b"])

        found, named = self.settled(first, self.one_of_two([]))
        self.assertEqual((found.passed, found.failed, named), (2, [], ["wire_hil: a"]))
        found, named = self.settled(first, self.one_of_two(["wire_hil: a"]))
        self.assertEqual((found.passed, found.failed, named), (1, ["wire_hil: a"], []))
        found, named = self.settled(first, other)
        self.assertEqual((found.passed, found.failed), (2, []))
        self.assertEqual(named, ["wire_hil: a", "wire_hil: b"])

    def test_a_second_boot_that_goes_wrong_is_a_failure(self):
        nothing = SuiteResult("wire_hil", failed=["wire_hil produced no results (status 1)"])

        found, _ = self.settled(self.one_of_two(["wire_hil: a"]), nothing)

        self.assertEqual(found.failed, nothing.failed)

    def test_what_did_not_pass_the_first_time_either_is_a_failure(self):
        second = self.one_of_two(["wire_hil: b"])
        nothing = SuiteResult("wire_hil", failed=["wire_hil produced no results (status 1)"])
        skipping = self.one_of_two(["wire_hil: a"])
        skipping.skipped = [("wire_hil: b", "hopeless")]

        for first in (nothing, skipping):
            found, _ = self.settled(first, second)
            self.assertEqual(found.failed, ["wire_hil: b"])

    def test_a_test_is_skipped_if_neither_boot_had_time_for_it(self):
        skipping = SuiteResult("wire_hil", passed=1, skipped=[("wire_hil: a", "hopeless")])

        found, named = self.settled(skipping, self.one_of_two([]))
        self.assertEqual((found.passed, found.skipped, named), (2, [], ["wire_hil: a"]))
        found, named = self.settled(self.one_of_two(["wire_hil: b"]), skipping)
        self.assertEqual((found.passed, found.skipped), (2, []))
        self.assertEqual(named, ["wire_hil: a", "wire_hil: b"])
        found, named = self.settled(skipping, skipping)
        self.assertEqual((found.passed, found.skipped, named), (1, skipping.skipped, []))

    def test_what_must_never_happen_counts_at_once(self):
        reasons = {"wire_hil: armed": self.trace_of_never()}
        first = SuiteResult("wire_hil", failed=["wire_hil: armed"], reasons=reasons)

        self.assertEqual(self.settled(first), (first, []))

    @staticmethod
    def trace_of_never():
        try:
            machine.PatientTest.assert_never(True, "armed all the same")
        except machine.Never:
            return traceback.format_exc()
        return ""

    def test_what_passed_does_not_run_again(self):
        first = SuiteResult("wire_hil", passed=2)

        self.assertEqual(self.settled(first), (first, []))


if __name__ == "__main__":
    unittest.main()
