# Copyright 2026 the Understory authors
# SPDX-License-Identifier: BSD-3-Clause
"""Checks that need no build: format of the C++ files, shell scripts."""

import subprocess

from commands import ROOT, cpp_files, say, shell_files
from results import SuiteResult


def _check(name, command, files, what):
    result = SuiteResult(name, note=f"{len(files)} files")
    outcome = subprocess.run(
        command + files, cwd=ROOT, stdin=subprocess.DEVNULL, encoding="utf-8", check=False
    )
    if not files:
        result.failed.append("found no files to check")
    elif outcome.returncode != 0:
        result.failed.append(what)
    else:
        result.passed = 1
    return result


def check_format():
    say("\n== format: clang-format over all C++ files")
    command = ["clang-format", "--dry-run", "-Werror"]
    return _check("format", command, cpp_files(), "see above; `clang-format -i FILE` mends it")


def check_shell():
    say("\n== shell: shellcheck over all shell scripts")
    return _check("shell", ["shellcheck"], shell_files(), "see above")
