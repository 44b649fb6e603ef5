# Copyright 2026 the Understory authors
# SPDX-License-Identifier: BSD-3-Clause
"""An Ethernet between kernels that run as processes of one machine: a socket for each, and a hub."""

import contextlib
import os
import selectors
import signal
import socket
import threading
from pathlib import Path
from typing import List, Tuple

CARD = "vec0"  # its name in those kernels
LONGEST_FRAME = 65536


def kill_children(pid: int) -> None:
    """Of this process, each with its whole group."""
    children = Path(f"/proc/{pid}/task/{pid}/children").read_text(encoding="ascii").split()
    for child in map(int, children):
        with contextlib.suppress(ProcessLookupError):  # it has just ended
            os.killpg(child, signal.SIGKILL)


class Ethernet:
    """What comes from one goes to all others; what one does not take is lost, as on a wire."""

    def __init__(self, size: int) -> None:
        pairs = [socket.socketpair(socket.AF_UNIX, socket.SOCK_DGRAM) for _ in range(size)]
        self._ours: List[socket.socket] = [ours for ours, _ in pairs]
        self._theirs: List[socket.socket] = [theirs for _, theirs in pairs]
        self._stop: Tuple[socket.socket, socket.socket] = socket.socketpair()
        self._thread = threading.Thread(target=self._run, daemon=True)

    @staticmethod
    def address_of(number: int) -> str:
        return f"10.77.0.{number + 1}/24"

    def file_of(self, number: int) -> int:
        return self._theirs[number].fileno()

    def start(self) -> None:
        """Once all have got their files."""
        for theirs in self._theirs:
            theirs.close()
        self._thread.start()

    def close(self) -> None:
        if self._thread.is_alive():
            self._stop[0].send(b"end")
            self._thread.join()
        for end in [*self._ours, *self._theirs, *self._stop]:
            end.close()

    def _run(self) -> None:
        with selectors.DefaultSelector() as selector:
            for end in [*self._ours, self._stop[1]]:
                end.setblocking(False)
                selector.register(end, selectors.EVENT_READ)
            while True:
                for key, _ in selector.select():
                    if key.fileobj is self._stop[1]:
                        return
                    self._pass_on(key.fileobj, selector)

    def _pass_on(self, source, selector: selectors.BaseSelector) -> None:
        try:
            frame = source.recv(LONGEST_FRAME)
        except BlockingIOError:
            return
        except OSError:  # that kernel is gone
            selector.unregister(source)
            return
        for end in self._ours:
            if end is not source:
                with contextlib.suppress(OSError):
                    end.send(frame)
