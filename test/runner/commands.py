# Copyright 2026 the Understory authors
# SPDX-License-Identifier: BSD-3-Clause
"""Runs other programs, keeps their whole output in a log and shows how far they are."""

import os
import pathlib
import re
import subprocess
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]
JOBS = os.environ.get("UNDERSTORY_JOBS", str(os.cpu_count() or 1))

# "[12/340] Building" (Ninja), " 12/340 Test  #7: ..." (ctest)
PROGRESS = re.compile(r"^\s*\[?(\d+)/(\d+)[\]\s](?!\s*Re-)")
QUIET_S = 60.0  # say at least this often that we are alive


def say(text):
    print(text, flush=True)


def run_logged(command, log_path, env=None, cwd=ROOT):
    """Runs a command; returns its exit status. Output goes to the log, progress to the screen."""
    log_path.parent.mkdir(parents=True, exist_ok=True)
    shown_tenth, shown_at = -1, time.monotonic()
    with open(log_path, "w", encoding="utf-8", errors="replace") as log, subprocess.Popen(
        [str(word) for word in command],
        cwd=cwd,
        env={**os.environ, **(env or {})},
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        encoding="utf-8",
        errors="replace",
    ) as process:
        for line in process.stdout:
            log.write(line)
            match = PROGRESS.match(line)
            if match:
                done, of = int(match[1]), max(1, int(match[2]))
                tenth = 10 * done // of
                if tenth > shown_tenth or time.monotonic() - shown_at > QUIET_S:
                    say(f"  {done} of {of}")
                    shown_tenth, shown_at = tenth, time.monotonic()
    return process.returncode


def show_log(log_path, most_lines=200):
    """Prints the end of a log, where the errors are, without the progress lines."""
    lines = log_path.read_text(encoding="utf-8", errors="replace").splitlines()
    lines = [line for line in lines if not PROGRESS.match(line)]
    say("\n".join(lines[-most_lines:]))
    say(f"  (whole log: {log_path})")


def output_of(command, cwd=ROOT):
    """Standard output of a command that must succeed."""
    return subprocess.run(
        [str(word) for word in command],
        cwd=cwd,
        check=True,
        stdin=subprocess.DEVNULL,
        capture_output=True,
        encoding="utf-8",
    ).stdout


def our_files():
    """Paths of the project's files that exist, relative to its root, sorted."""
    listed = output_of(
        # Whoever owns the clone: only names are read.
        ["git", "-c", "safe.directory=*", "ls-files", "-z"]
        + ["--cached", "--others", "--exclude-standard"]
    )
    return sorted(name for name in set(listed.split("\0")) if name and (ROOT / name).is_file())


def cpp_files():
    return [name for name in our_files() if name.endswith((".cpp", ".hpp"))]


def shell_files():
    """Scripts, by their first line."""
    found = []
    for name in our_files():
        with open(ROOT / name, "rb") as file:
            first = file.readline(64)
        if first.startswith(b"#!") and first.rstrip().endswith((b"bash", b"/sh", b" sh")):
            found.append(name)
    return found
