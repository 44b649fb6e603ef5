#!/usr/bin/python3
# Copyright 2026 the Understory authors
# SPDX-License-Identifier: BSD-3-Clause
"""How late a periodic loop wakes up: prints the lateness of each period's absolute deadline.

usage: understory hil -- hil/provider/wakeups.py [--rate HZ] [--seconds S] [--fifo]
"""

import argparse
import ctypes
import os
import time

MONOTONIC, ABSOLUTE = 1, 1
LOCK_ALL = 3  # now and in future
PRIORITY = 50


class Timespec(ctypes.Structure):
    _fields_ = [("seconds", ctypes.c_long), ("nanoseconds", ctypes.c_long)]


def become_real_time() -> None:
    os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(PRIORITY))
    libc = ctypes.CDLL(None, use_errno=True)
    if libc.mlockall(LOCK_ALL) != 0:
        raise OSError(ctypes.get_errno(), "mlockall")


def lateness_us(rate_hz: float, seconds: float) -> list:
    sleep = ctypes.CDLL(None).clock_nanosleep
    period_ns = round(1e9 / rate_hz)
    deadline_ns = time.monotonic_ns()
    found = []
    for _ in range(round(rate_hz * seconds)):
        deadline_ns += period_ns
        until = Timespec(*divmod(deadline_ns, 1_000_000_000))
        sleep(MONOTONIC, ABSOLUTE, ctypes.byref(until), None)
        found.append((time.monotonic_ns() - deadline_ns) / 1000.0)
    return sorted(found)


def main() -> None:
    parser = argparse.ArgumentParser(description="How late a periodic loop wakes up.")
    parser.add_argument("--rate", type=float, default=100.0, help="Hz (default: 100)")
    parser.add_argument("--seconds", type=float, default=10.0)
    parser.add_argument("--fifo", action="store_true", help="SCHED_FIFO and locked memory")
    options = parser.parse_args()
    if options.fifo:
        become_real_time()
    late = lateness_us(options.rate, options.seconds)
    median, most = late[len(late) // 2], late[len(late) * 99 // 100]
    print(f"{len(late)} wake-ups, late by us: p50 {median:.0f}, p99 {most:.0f}, max {late[-1]:.0f}")


if __name__ == "__main__":
    main()
