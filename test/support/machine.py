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
from typing import Any, Callable, List, Tuple, Type, TypeVar

T = TypeVar("T")

HIGHEST_PRIORITY = 99  # over all that is tested: only the machine itself can make it late
NAP_S = 0.01
LATE_S = 0.004  # of a wake-up
GAP_S = 0.03  # one alone is trouble
HOPELESS_S = 0.2
MOST_LATE = 0.01  # of the time
HOPELESSLY_LATE = 0.1
LEAST_IDLE = 0.05  # of the processor's time
ATTEMPTS = 3
ATTEMPT_PATIENCE_S = 120
CALM_S = 3
CALM_TRIES = 10  # before another attempt
LEFT_S = 300.0  # for other attempts, of one program


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

    def _idle(self) -> float:
        """Part of the time, 0 to 1."""
        idle, everything = (now - then for now, then in zip(self._times(), self._begin))
        return idle / max(1, everything)

    def part_late(self) -> float:
        """Of the time, 0 to 1."""
        late_s = sum(end - begin for begin, end in self.gaps())
        return late_s / max(NAP_S, time.time() - self._began_s)

    def _longest_s(self) -> float:
        return max((end - begin for begin, end in self.gaps()), default=0.0)

    def is_hopeless(self) -> bool:
        """It stood still for longer than a vehicle waits or for much of the time, or had nothing
        left to give."""
        if self._longest_s() > HOPELESS_S or self.part_late() > HOPELESSLY_LATE:
            return True
        return self._idle() < LEAST_IDLE

    def trouble(self) -> str:
        """Empty: it was as fast as one may ask for."""
        if self._longest_s() > GAP_S or self.part_late() > MOST_LATE:
            often = f"{len(self.gaps())} times, {100 * self.part_late():.0f} % of the time"
            return f"the machine stood still {often}, for {1e3 * self._longest_s():.0f} ms at most"
        if self._idle() < LEAST_IDLE:
            return f"the machine had too little time: {100 * self._idle():.0f} % idle"
        return ""


class Never(AssertionError):
    """What no machine is slow enough for: too early, armed, flown, killed without a reason."""


def wait_for_calm() -> None:
    """A machine that was too slow often stays so for a while."""
    for _ in range(CALM_TRIES):
        machine = Machine()
        time.sleep(CALM_S)
        trouble = machine.trouble()
        machine.close()
        if not trouble:
            return
        print(f"    waiting for a calm machine: {trouble}", flush=True)


class Patience:
    """How much time this program has left for what did not go well at first: programs have time
    limits, and a machine may be bad all day."""

    def __init__(self, left_s: float = LEFT_S) -> None:
        self._left_s = left_s

    def is_over(self) -> bool:
        return self._left_s <= 0.0

    def spend(self, seconds: float) -> None:
        self._left_s -= seconds


PATIENCE = Patience()


def attempted(
    act: Callable[[Machine], T],
    failures: Tuple[Type[BaseException], ...] = (AssertionError,),
    machine_of_now: Callable[[], Machine] = Machine,
    before_another: Callable[[], None] = wait_for_calm,
    patience: Patience = PATIENCE,
) -> T:
    """What `act` returns. A failure counts if the machine was fast enough meanwhile; else `act` is
    called again. The last one counts too, but where nothing could have been tested: that is
    skipped."""
    attempt = 0
    while True:
        attempt += 1
        began_s = time.monotonic()
        if attempt > 1:
            before_another()
        machine = machine_of_now()
        try:
            return act(machine)
        except (Never, unittest.SkipTest):
            raise
        except failures as error:
            trouble = machine.trouble()
            reason = str(error).split("\n", maxsplit=1)[0]
            print(f"    attempt {attempt}: {trouble or 'a calm machine'}; {reason}", flush=True)
            is_last = attempt == ATTEMPTS or patience.is_over()
            if is_last and machine.is_hopeless():
                raise unittest.SkipTest(f"{trouble}; {reason}") from error
            if not trouble or is_last:
                raise
        finally:
            machine.close()
            if attempt > 1:
                patience.spend(time.monotonic() - began_s)


def tried_again(test: Callable[[Any], None]) -> Callable[[Any], None]:
    """A test of a PatientTest that is attempted so."""

    @functools.wraps(test)
    def tried(self: "PatientTest") -> None:
        # The runner's alarm, if it set one, is for each attempt anew and not for the pauses.
        has_alarm = signal.alarm(0) > 0

        def prepare_another() -> None:
            signal.alarm(0)
            self.show_programs()
            self.doCleanups()
            wait_for_calm()

        def attempt(machine: Machine) -> None:
            is_another = hasattr(self, "machine")
            self.machine = machine
            signal.alarm(has_alarm and ATTEMPT_PATIENCE_S)
            if is_another:
                self.setUp()
            test(self)

        attempted(attempt, self.failures, Machine, prepare_another)

    return tried


class PatientTest(unittest.TestCase):
    """All its tests are attempted so: with setUp and the cleanups, but not tearDown, in between."""

    failures: Tuple[Type[BaseException], ...] = (
        AssertionError,
        LookupError,
        subprocess.TimeoutExpired,
    )
    machine: Machine  # since this attempt began

    def __init_subclass__(cls, **words: Any) -> None:
        super().__init_subclass__(**words)
        for name, method in list(vars(cls).items()):
            if name.startswith("test"):
                setattr(cls, name, tried_again(method))

    @staticmethod
    def assert_never(is_so: Any, what: str) -> None:
        """However slow the machine is."""
        if is_so:
            raise Never(f"{what}: {is_so}")

    def show_programs(self) -> None:
        """Called after an attempt that failed and before the next: what tells most about it."""


if __name__ == "__main__":
    watch()
