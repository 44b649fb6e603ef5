# Copyright 2026 the Understory authors
# SPDX-License-Identifier: BSD-3-Clause
"""The test command's own rules: what counts as passed, failed, skipped and vanished."""

import json
import pathlib
import sys
import tempfile
import unittest
import unittest.mock
import xml.etree.ElementTree

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "runner"))

import builds  # noqa: E402
import hil_tests  # noqa: E402
import junit  # noqa: E402
import results  # noqa: E402
import ros_tests  # noqa: E402
import tidy  # noqa: E402
from results import SuiteResult  # noqa: E402


def counted(xml_text):
    """The SuiteResult after one ctest entry."""
    result = SuiteResult("unit")
    builds.count_case(xml.etree.ElementTree.fromstring(xml_text), result)
    return result


class CountTest(unittest.TestCase):
    def test_a_test_that_ran_is_passed(self):
        self.assertEqual(counted('<testcase name="A.B" status="run"/>').passed, 1)

    def test_a_failing_test_is_named(self):
        self.assertEqual(counted('<testcase name="A.B" status="fail"/>').failed, ["A.B"])

    def test_a_skipped_test_carries_its_reason(self):
        result = counted(
            '<testcase name="A.B" status="notrun">'
            '<skipped message="SKIP_REGULAR_EXPRESSION_MATCHED"/>'
            "<system-out>[ RUN      ] A.B\n/x/a_test.cpp:9: Skipped\nno forests\nbeside us\n\n"
            "[  SKIPPED ] A.B (0 ms)\n</system-out></testcase>"
        )

        self.assertEqual(result.skipped, [("A.B", "no forests beside us")])
        self.assertEqual(result.ran, 0)

    def test_a_test_that_failed_before_it_was_skipped_is_failed(self):
        result = counted(
            '<testcase name="A.B" status="notrun">'
            '<skipped message="SKIP_REGULAR_EXPRESSION_MATCHED"/>'
            "<system-out>[  SKIPPED ] A.B\n[  FAILED  ] A.B</system-out></testcase>"
        )

        self.assertEqual(result.failed, ["A.B"])

    def test_a_program_that_is_not_there_is_failed(self):
        result = counted(
            '<testcase name="test_unit_NOT_BUILT" status="notrun">'
            '<skipped message="Unable to find executable"/></testcase>'
        )

        self.assertEqual(result.failed, ["test_unit_NOT_BUILT"])


def counted_file(xml_text):
    """The SuiteResult after the report of one program of a .test file."""
    result = SuiteResult("ros")
    with tempfile.TemporaryDirectory() as folder:
        path = pathlib.Path(folder) / "report.xml"
        path.write_text(xml_text)
        junit.count_report(path, "topics", result)
    return result


class RosCountTest(unittest.TestCase):
    def test_failures_and_errors_are_named_once(self):
        result = counted_file(
            '<testsuites><testsuite><testcase classname="A" name="b" status="run"/>'
            '<testcase classname="A" name="c"><failure message="1"/><failure message="2"/>'
            '</testcase><testcase classname="A" name="d"><error>no</error></testcase>'
            "</testsuite></testsuites>"
        )

        self.assertEqual(result.passed, 1)
        self.assertEqual(result.failed, ["topics: A.c", "topics: A.d"])

    def test_a_skipped_test_carries_its_reason(self):
        result = counted_file(
            '<testsuite><testcase classname="A" name="b" status="run" result="skipped">'
            '<skipped message="no&#x0A;camera"/></testcase></testsuite>'
        )

        self.assertEqual(result.skipped, [("topics: A.b", "no camera")])
        self.assertEqual(result.ran, 0)

    def test_a_program_that_reported_nothing_is_failed(self):
        with tempfile.TemporaryDirectory() as folder:
            (pathlib.Path(folder) / "rostest-topics.xml").write_text(
                '<testsuite><testcase classname="rostest" name="testtopics">'
                "<failure>time limit exceeded</failure></testcase></testsuite>"
            )
            result = SuiteResult("ros")

            self.assertEqual(ros_tests.count_results(pathlib.Path(folder), "topics", result), 0)
            self.assertEqual(result.failed, ["topics: rostest.testtopics"])


# As a GoogleTest program: piece 1 fails, piece 2 dies, piece 3 leaks after it has reported.
PIECES_PROGRAM = """#!/bin/sh
[ "$GTEST_SHARD_INDEX" = 2 ] && exit 9
[ "$GTEST_SHARD_INDEX" = 1 ] && bad='<failure message="wrong"/>'
mkdir -p "$(dirname "${1#--gtest_output=xml:}")"
echo "<testsuite><testcase classname='A' name='b$GTEST_SHARD_INDEX'>$bad</testcase></testsuite>" \\
  > "${1#--gtest_output=xml:}"
[ "$GTEST_SHARD_INDEX" = 3 ] && exit 1
[ -z "$bad" ]
"""


class PiecesTest(unittest.TestCase):
    def test_each_piece_counts_and_none_ends_badly_unnoticed(self):
        with tempfile.TemporaryDirectory() as folder:
            program = pathlib.Path(folder) / "test_x"
            program.write_text(PIECES_PROGRAM)
            program.chmod(0o755)
            result = builds.run_in_pieces(program, "x-asan", {})

        self.assertEqual(result.passed, builds.PIECES - 2)
        expected = ["test_x, piece 2, ended with status 9", "test_x, piece 3, ended with status 1"]
        self.assertEqual(result.failed, ["test_x: A.b1", *expected])


class HilTest(unittest.TestCase):
    def found_without_a_bus(self, environment):
        with unittest.mock.patch.object(hil_tests, "why_no_bus", return_value="no bus"):
            with unittest.mock.patch.dict(hil_tests.os.environ, environment, clear=True):
                found = [hil_tests.run_hil_tests()]
        results.check_minimums(found, {"hil": 10}, ["hil"])
        return found

    def test_without_a_bus_the_suite_is_one_skipped_test(self):
        found = self.found_without_a_bus({})

        self.assertEqual(results.totals(found), (0, 0, 1))
        self.assertEqual(found[0].skipped, [("hil", "no bus")])

    def test_without_a_bus_the_suite_fails_in_continuous_integration(self):
        self.assertGreater(results.totals(self.found_without_a_bus({"CI": "true"}))[1], 0)

    def test_every_module_gets_the_bus_it_wants(self):
        found = hil_tests.jobs(pathlib.Path("/results"), None)

        self.assertIn("--wire", found["wire_hil"])
        self.assertNotIn("--wire", found["provider_hil"])
        self.assertNotIn("run_hil", found)


class TidyEntriesTest(unittest.TestCase):
    def test_files_behind_links_are_listed_once_by_their_real_paths(self):
        with tempfile.TemporaryDirectory() as name:
            root = pathlib.Path(name).resolve()
            (root / "package").mkdir()
            (root / "link").symlink_to("package")
            listed = {"plain": [root / "package/a.cpp"]}
            listed["catkin"] = [root / "link/a.cpp", root / "link/b.cpp", "/usr/src/c.cpp"]
            for folder, files in listed.items():
                (root / folder).mkdir()
                entries = [{"directory": "/", "file": f"{f}", "command": f"c++ {f}"} for f in files]
                (root / folder / "compile_commands.json").write_text(json.dumps(entries))

            with unittest.mock.patch.object(tidy, "ROOT", root):
                found = tidy.entries_of([root / "plain", root / "catkin"])

            path = root / "package"
            self.assertEqual(sorted(found), [f"{path}/a.cpp", f"{path}/b.cpp"])
            self.assertEqual(found[f"{path}/a.cpp"]["folder"], root / "plain")
            self.assertEqual(found[f"{path}/b.cpp"]["command"], f"c++ {path}/b.cpp")


class MinimumTest(unittest.TestCase):
    def test_fewer_tests_than_expected_are_a_failure(self):
        found = [SuiteResult("unit", passed=9)]

        results.check_minimums(found, {"unit": 10}, ["unit"])

        self.assertEqual(results.totals(found)[1], 1)

    def test_skipped_tests_do_not_count_as_run(self):
        found = [SuiteResult("unit", passed=9, skipped=[("A.B", "why")])]

        results.check_minimums(found, {"unit": 10}, ["unit"])

        self.assertEqual(results.totals(found), (9, 1, 1))

    def test_a_suite_that_did_not_report_is_a_failure(self):
        found = [SuiteResult("unit", passed=10)]

        results.check_minimums(found, {"unit": 10, "scenario": 3}, ["scenario", "unit"])

        self.assertEqual(results.totals(found), (10, 1, 0))

    def test_a_broken_list_of_minimums_names_file_and_line(self):
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "counts.txt"
            path.write_text("unit 3\nscenario many\n", encoding="utf-8")

            with self.assertRaisesRegex(ValueError, "counts.txt:2"):
                results.read_minimums(path)


class SummaryTest(unittest.TestCase):
    def test_last_line_counts_alone_and_skips_and_failures_are_named(self):
        text = results.summary(
            [
                SuiteResult("unit", passed=3, skipped=[("A.B", "no forests")]),
                SuiteResult("shell", failed=["see above"]),
            ]
        )

        self.assertEqual(text.splitlines()[-1], "3 passed, 1 failed, 1 skipped")
        self.assertIn("skipped: unit: A.B: no forests", text)
        self.assertIn("FAILED: shell: see above", text)


if __name__ == "__main__":
    unittest.main()
