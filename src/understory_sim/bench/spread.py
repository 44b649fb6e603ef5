# Copyright 2026 the Understory authors
# SPDX-License-Identifier: BSD-3-Clause
"""Missions on several machines: GNU parallel runs `bench.py --only NAME` there over ssh, each of which
flies one mission and writes one line of JSON; nothing else has to be brought back.
"""

import json
import shutil
import subprocess
import sys

import numpy as np

from series import Series


def line_of(row, course):
    """What a mission was, in one line."""
    content = {"row": row}
    if course is not None:
        content["course"] = {name: list(values) for name, values in course._asdict().items()}
    return json.dumps(content)


def from_line(line):
    """(row, course); ValueError if it is no such line."""
    content = json.loads(line)
    course = content.get("course")
    if course is not None:
        course = Series(**{name: np.array(values) for name, values in course.items()})
    return content["row"], course


def fly(names, hosts, jobs, words):
    """Yields (row, course) of each mission as it ends. `words`: the command, before the name."""
    if shutil.which("parallel") is None:
        raise OSError("--hosts needs GNU parallel (package parallel)")
    command = ["parallel", "--will-cite", "--sshlogin", hosts, "--jobs", str(jobs), *words, "{}"]
    with subprocess.Popen(
        command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, encoding="utf-8"
    ) as process:
        process.stdin.write("".join(f"{name}\n" for name in names))
        process.stdin.close()
        for line in process.stdout:
            try:
                yield from_line(line)
            except (ValueError, KeyError, TypeError):
                print(f"understory bench: not from a mission: {line.strip()}", file=sys.stderr)
