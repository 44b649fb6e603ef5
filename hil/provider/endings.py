# Copyright 2026 the Understory authors
# SPDX-License-Identifier: BSD-3-Clause
"""Signals that ask to end: the first one is for the command, the second one kills it."""

import signal
import time
from typing import Callable, Optional

ENDING = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT)
# timeout(1) sends its signal to its child and then to the whole group: twice for the same reason.
SAME_S = 0.4


class EndingSignals:
    def __init__(self, now: Callable[[], float] = time.monotonic) -> None:
        self._now = now
        self._first_at: Optional[float] = None

    def is_second(self, number: int) -> bool:
        """Whether whoever sends it has run out of patience."""
        if number not in ENDING:
            return False
        if self._first_at is None:
            self._first_at = self._now()
        return self._now() - self._first_at > SAME_S
