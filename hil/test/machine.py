#!/usr/bin/python3
# Copyright 2026 the Understory authors
# SPDX-License-Identifier: BSD-3-Clause
"""Tells a slow machine from a slow vehicle. The machine is shared: it may stand still, or have too
little time for us, and what then comes too late is not the vehicle's fault.

Run as a program it writes, for each time it was woken too late, from when to when.
"""

import contextlib
import functools
import os
import signal
import subprocess
import sys
import time
import unittest
from typing import Any, Callable, List, Tuple

HIGHEST_PRIORITY = 99  # over all that is tested: only the machine itself can make it late
NAP_S = 0.01
LATE_S = 0.004  # of a wake-up
GAP_S = 0.03  # one alone is trouble
MOST_LATE = 0.01  # of the time
LEAST_IDLE = 0.05  # of the processor's time
ATTEMPTS = 3
ATTEMPT_PATIENCE_S = 120


def watch() -> None:
    with contextlib.suppress(PermissionError):
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(HIGHEST_PRIORITY))
    before = time.time()
    while True:
        time.sleep(NAP_S)
        now = time.time()
        if now - before > NAP_S + LATE_S:
            os.write(1, f"{before} {now}\n".encode())
        before = now


class Machine:
    """Of the time since it was constructed."""

    def __init__(self) -> None:
        self._process = subprocess.Popen(
            [sys.executable, "-B", "-S", __file__],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
        )
        assert self._process.stdout is not None
        os.set_blocking(self._process.stdout.fileno(), False)
        self._text = b""
        self._begin = self._times()
        self._began_s = time.time()

    @staticmethod
    def _times() -> Tuple[int, int]:
        """Idle and all, in ticks."""
        with open("/proc/stat", encoding="ascii") as file:
            ticks = [int(word) for word in file.readline().split()[1:9]]
        return ticks[3] + ticks[4], sum(ticks)

    def close(self) -> None:
        self._process.kill()
        self._process.wait()
        assert self._process.stdout is not None
        self._process.stdout.close()

    def gaps(self) -> List[Tuple[float, float]]:
        """When it stood still."""
        assert self._process.stdout is not None
        self._text += self._process.stdout.read() or b""
        lines = self._text.decode().split("\n")[:-1]
        return [(float(line.split()[0]), float(line.split()[1])) for line in lines]

    def trouble(self) -> str:
        """Empty: it was as fast as one may ask for."""
        gaps = self.gaps()
        idle, everything = (now - then for now, then in zip(self._times(), self._begin))
        total_s, longest_s = (f([end - begin for begin, end in gaps] or [0.0]) for f in (sum, max))
        if longest_s > GAP_S or total_s > MOST_LATE * (time.time() - self._began_s):
            return f"the machine stood still {len(gaps)} times, for {1e3 * longest_s:.0f} ms at most"
        if idle < LEAST_IDLE * everything:
            return f"the machine had too little time: {100 * idle / max(1, everything):.0f} % idle"
        return ""


def tried_again(test: Callable[[Any], None]) -> Callable[[Any], None]:
    """A failure counts if the machine was fast enough meanwhile; else the test is done again, and
    in the end skipped, which is no success either."""

    @functools.wraps(test)
    def tried(self: Any) -> None:
        for attempt in range(1, ATTEMPTS + 1):
            machine = self.machine = Machine()
            signal.alarm(signal.alarm(0) and ATTEMPT_PATIENCE_S)  # the runner's, for each anew
            try:
                test(self)
                return
            except (AssertionError, LookupError, subprocess.TimeoutExpired) as error:
                trouble = machine.trouble()
                if not trouble:
                    raise
                reason = str(error).split("\n", maxsplit=1)[0]
                print(f"    attempt {attempt}: {trouble}; {reason}", flush=True)
                self.show_programs()
                if attempt == ATTEMPTS:
                    raise unittest.SkipTest(f"{trouble}; {reason}") from error
            finally:
                machine.close()
            self.doCleanups()
            self.setUp()

    return tried


if __name__ == "__main__":
    watch()
