# Copyright 2026 the Understory authors
# SPDX-License-Identifier: BSD-3-Clause
"""All processes that descend from us, to signal them and to leave none behind."""

import ctypes
import os
import signal
import time
from typing import Dict, List

ADOPT_ORPHANS, DIE_WITH_PARENT = 36, 1  # of prctl()


def adopt_orphans() -> None:
    """What the command leaves running becomes our child, so that it stays findable."""
    ctypes.CDLL(None).prctl(ADOPT_ORPHANS, 1, 0, 0, 0)


def die_with_parent() -> None:
    """Even a command that ignores signals, since nobody is left to send it a second one."""
    ctypes.CDLL(None).prctl(DIE_WITH_PARENT, signal.SIGKILL, 0, 0, 0)


def descendants() -> List[int]:
    children: Dict[int, List[int]] = {}
    for name in filter(str.isdigit, os.listdir("/proc")):
        try:
            with open(f"/proc/{name}/stat", "rb") as file:
                # The name in brackets may hold anything; state and parent follow it.
                state, parent = file.read().rpartition(b")")[2].split()[:2]
        except OSError:
            continue  # ended meanwhile
        if state != b"Z":
            children.setdefault(int(parent), []).append(int(name))
    found, todo = [], [os.getpid()]
    while todo:
        ours = children.get(todo.pop(), [])
        found += ours
        todo += ours
    return found


def signal_all(number: int) -> None:
    for pid in descendants():
        try:
            os.kill(pid, number)
        except (ProcessLookupError, PermissionError):
            pass


def end_all(patience_s: float) -> None:
    """A moment to end by themselves, then the end."""
    signal_all(signal.SIGTERM)
    deadline = time.monotonic() + patience_s
    while descendants() and time.monotonic() < deadline:
        time.sleep(0.02)
    signal_all(signal.SIGKILL)
