# Copyright 2026 the Understory authors
# SPDX-License-Identifier: BSD-3-Clause
"""Reads JUnit reports; GoogleTest, rosunit and run_hil.py write alike."""

import xml.etree.ElementTree

from commands import say


def count_report(path, name, result):
    """Adds to `result` what the program `name` reported in a file."""
    for case in xml.etree.ElementTree.parse(path).getroot().iter("testcase"):
        case_name = f"{name}: {case.get('classname', '')}.{case.get('name')}"
        skipped = case.find("skipped")
        bad = case.findall("failure") + case.findall("error")
        if bad:
            reasons = "\n".join(part.text or part.get("message", "") for part in bad)
            result.failed.append(case_name)
            result.reasons[case_name] = reasons
            say(f"\n-- FAILED: {case_name}\n{reasons}")
        elif skipped is not None or case.get("status") == "notrun":
            reason = skipped.get("message") if skipped is not None else "disabled"
            result.skipped.append((case_name, " ".join((reason or "no reason given").split())))
        else:
            result.passed += 1
