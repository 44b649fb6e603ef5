# Copyright 2026 the Understory authors
# SPDX-License-Identifier: BSD-3-Clause
"""What a suite found, the minimum that must have run, and the closing summary."""

import dataclasses


@dataclasses.dataclass
class SuiteResult:
    """Outcome of one suite: how many passed, which failed, which were skipped and why."""

    name: str
    passed: int = 0
    failed: list = dataclasses.field(default_factory=list)  # of names
    skipped: list = dataclasses.field(default_factory=list)  # of (name, reason)
    reasons: dict = dataclasses.field(default_factory=dict)  # of what failed, as far as known
    note: str = ""
    duration_s: float = 0.0
    is_absent: bool = False  # this machine cannot run it, and need not

    @property
    def ran(self):
        return self.passed + len(self.failed)


def read_minimums(path):
    """{suite: least number of tests that must run}, from lines `suite number`."""
    minimums = {}
    with open(path, encoding="utf-8") as file:
        for number, line in enumerate(file, 1):
            words = line.split("#")[0].split()
            if not words:
                continue
            if len(words) != 2 or not words[1].isdigit():
                raise ValueError(f"{path}:{number}: expected a suite and a number")
            minimums[words[0]] = int(words[1])
    return minimums


def check_minimums(results, minimums, required):
    """Adds a failure to each suite with fewer tests than it must have.

    `required`: the suites that this kind of run must contain; one that did not report at all is
    added as failed, so that nothing vanishes silently.
    """
    by_name = {result.name: result for result in results}
    for name in required:
        if name not in by_name:
            by_name[name] = SuiteResult(name)
            results.append(by_name[name])
    for result in results:
        least = minimums.get(result.name, 1)
        if result.ran < least and not result.is_absent:
            result.failed.append(
                f"{result.name}: only {result.ran} tests ran, at least {least} must"
                " (test/expected_counts.txt)"
            )


def totals(results):
    """(passed, failed, skipped) over all suites."""
    return (
        sum(result.passed for result in results),
        sum(len(result.failed) for result in results),
        sum(len(result.skipped) for result in results),
    )


def summary(results):
    """The closing text; its last line is `N passed, N failed, N skipped`."""
    lines = [f"{'suite':<14}{'ran':>6}{'passed':>8}{'failed':>8}{'skipped':>9}{'time':>9}"]
    for result in results:
        lines.append(
            f"{result.name:<14}{result.ran:>6}{result.passed:>8}{len(result.failed):>8}"
            f"{len(result.skipped):>9}{result.duration_s:>7.0f} s"
            + (f"  {result.note}" if result.note else "")
        )
    for result in results:
        lines += [f"skipped: {result.name}: {name}: {why}" for name, why in result.skipped]
    for result in results:
        lines += [f"FAILED: {result.name}: {name}" for name in result.failed]
    lines.append("")
    lines.append("{} passed, {} failed, {} skipped".format(*totals(results)))
    return "\n".join(lines)
