# Copyright 2026 the Understory authors
# SPDX-License-Identifier: BSD-3-Clause
"""The host's end of the channel: passes input, output, signals and the exit status of a command
that runs in another kernel."""

import contextlib
import fcntl
import json
import os
import select
import signal
import socket
import struct
import termios
import time
import tty
from typing import Callable, Iterator, List, Optional

import frames
from endings import ENDING, EndingSignals
from job import HilError, Job, environment_for

BOOT_PATIENCE_S = 60.0
QUIET_BOOT_S = 2.0
KILL_PATIENCE_S = 3.0
ENDED_EARLY = "the booted kernel ended before the command did"
PASSED_ON = (*ENDING, signal.SIGUSR1, signal.SIGUSR2)
TERMINAL_STOPS = (signal.SIGTTIN, signal.SIGTTOU)


def is_terminal(number: int) -> bool:
    try:
        return os.isatty(number)
    except OSError:
        return False


def terminal_size() -> Optional[List[int]]:
    for number in (1, 0, 2):
        if is_terminal(number):
            packed = fcntl.ioctl(number, termios.TIOCGWINSZ, bytes(8))
            return list(struct.unpack("HHHH", packed)[:2])
    return None


def start_frame(job: Job, provider: str) -> bytes:
    terminals = [is_terminal(number) for number in (0, 1, 2)]
    umask = os.umask(0)
    os.umask(umask)
    spec = {
        "command": job.command,
        "environment": environment_for(job, provider),
        "folder": os.getcwd(),
        "umask": umask,
        "terminal": [False, *terminals[1:]],  # lines typed come through a pipe, its end included
        "whole_terminal": job.is_shell,
    }
    return frames.encode(frames.START, json.dumps(spec).encode())


class Interrupted(Exception):
    """A signal ended the provider itself."""

    def __init__(self, number: int) -> None:
        super().__init__()
        self.number = number


class Relay:
    """Serves one command from the boot of its kernel to its exit status."""

    def __init__(self, channel: socket.socket, job: Job, kernel_lives: Callable[[], bool]) -> None:
        channel.setblocking(False)
        self._channel, self._job, self._kernel_lives = channel, job, kernel_lives
        self._decoder = frames.Decoder()
        self._to_agent = bytearray()
        self._outputs = {1: bytearray(), 2: bytearray()}
        self._line_window = frames.LINE_WINDOW
        self._input_window = frames.INPUT_WINDOW
        self._input_open = True
        self._is_ready = False
        self._status: Optional[int] = None
        self._endings = EndingSignals()
        self._killed_at: Optional[float] = None
        self._notice_shown = False
        self._began = time.monotonic()

    def run(self, provider: str) -> int:
        """The wait status of the command; HilError if it could not be started."""
        self._send(start_frame(self._job, provider))
        with self._signals() as wake, self._raw_terminal():
            while self._status is None or any(self._outputs.values()):
                self._wait_and_serve(wake)
                self._watch_time()
        return self._status

    def _send(self, frame: bytes) -> None:
        self._to_agent += frame

    @contextlib.contextmanager
    def _signals(self) -> Iterator[int]:
        wake, wake_write = os.pipe()
        os.set_blocking(wake, False)
        os.set_blocking(wake_write, False)
        handled = (*PASSED_ON, signal.SIGWINCH, *TERMINAL_STOPS)
        before = {number: signal.getsignal(number) for number in handled}
        for number in (*PASSED_ON, signal.SIGWINCH):
            # What whoever started us ignores stays ignored, as under nohup.
            if before[number] != signal.SIG_IGN:
                signal.signal(number, lambda *_: None)
        for number in TERMINAL_STOPS:  # in the background there is no input, but we go on
            signal.signal(number, signal.SIG_IGN)
        signal.set_wakeup_fd(wake_write, warn_on_full_buffer=False)
        try:
            yield wake
        finally:
            signal.set_wakeup_fd(-1)
            for number, handler in before.items():
                signal.signal(number, handler)
            os.close(wake)
            os.close(wake_write)

    @contextlib.contextmanager
    def _raw_terminal(self) -> Iterator[None]:
        if not self._job.is_shell:
            yield
            return
        before = termios.tcgetattr(0)
        tty.setraw(0)
        try:
            yield
        finally:
            termios.tcsetattr(0, termios.TCSAFLUSH, before)

    def _wait_and_serve(self, wake: int) -> None:
        reading: List[int] = [wake]
        full = any(len(pending) > frames.INPUT_WINDOW for pending in self._outputs.values())
        if self._status is None and not full:
            reading.append(self._channel.fileno())
        if self._is_ready and self._input_open and self._input_window > 0 and self._status is None:
            reading.append(0)
        writing: List[int] = [number for number, pending in self._outputs.items() if pending]
        may_send = self._is_ready and self._status is None and self._line_window > 0
        if self._to_agent and may_send:
            writing.append(self._channel.fileno())
        try:
            readable, writable, _ = select.select(reading, writing, [], 0.25)
        except OSError:  # our own standard input is closed
            self._end_input()
            return
        if wake in readable:
            self._on_signals(os.read(wake, 256))
        for number in (1, 2):
            if number in writable:
                self._write_output(number)
        if self._channel.fileno() in writable:
            self._write_channel()
        if self._channel.fileno() in readable:
            self._read_channel()
        if 0 in readable:
            self._read_input()

    def _end_input(self) -> None:
        self._input_open = False
        self._send(frames.encode(frames.INPUT))

    def _read_input(self) -> None:
        try:
            data = os.read(0, min(frames.CHUNK, self._input_window))
        except OSError:  # a terminal that we do not have
            data = b""
        if not data:
            self._end_input()
            return
        self._input_window -= len(data)
        self._send(frames.encode(frames.INPUT, data))

    def _write_output(self, number: int) -> None:
        pending = self._outputs[number]
        try:
            # So much never blocks once select() calls a pipe writable.
            del pending[: os.write(number, pending[: select.PIPE_BUF])]
        except BlockingIOError:
            return
        except OSError:  # nobody reads any more, as with `| head`
            pending.clear()
            kind = frames.OUTPUT if number == 1 else frames.ERRORS
            self._send(frames.encode(frames.CLOSED, kind))

    def _write_channel(self) -> None:
        try:
            sent = self._channel.send(self._to_agent[: self._line_window])
        except BlockingIOError:
            return
        except OSError:
            raise HilError(ENDED_EARLY) from None
        del self._to_agent[:sent]
        self._line_window -= sent

    def _read_channel(self) -> None:
        try:
            data = self._channel.recv(65536)
        except OSError:
            data = b""
        if not data:
            raise HilError(ENDED_EARLY)
        for kind, payload in self._decoder.feed(data):
            if kind == frames.READY:
                self._on_ready()
            elif kind == frames.OUTPUT:
                self._outputs[1] += payload
            elif kind == frames.ERRORS:
                self._outputs[2] += payload
            elif kind == frames.RECEIVED:
                self._line_window += frames.number_of(payload)
            elif kind == frames.TAKEN:
                self._input_window += frames.number_of(payload)
            elif kind == frames.EXIT:
                self._status = frames.number_of(payload)
            elif kind == frames.FAILED:
                raise HilError(os.fsdecode(payload))

    def _on_ready(self) -> None:
        self._is_ready = True
        self._clear_notice()
        self._send_size()

    def _send_size(self) -> None:
        size = terminal_size()
        if size is not None:
            self._send(frames.encode(frames.SIZE, json.dumps(size).encode()))

    def _on_signals(self, numbers: bytes) -> None:
        for number in numbers:
            if number == signal.SIGWINCH:
                self._send_size()
                continue
            if not self._is_ready:
                raise Interrupted(number)  # nothing runs yet: there is nothing to end cleanly
            if self._endings.is_second(number):
                number = signal.SIGKILL
                self._killed_at = self._killed_at or time.monotonic()
            self._send(frames.encode_number(frames.SIGNAL, number))

    def _watch_time(self) -> None:
        # The channel does not tell: what the kernel leaves behind when killed has it open too.
        if self._status is None and not self._kernel_lives():
            raise HilError(ENDED_EARLY)
        waited_s = time.monotonic() - self._began
        if not self._is_ready:
            if waited_s > BOOT_PATIENCE_S:
                raise HilError(f"the kernel is not up after {BOOT_PATIENCE_S:.0f} s")
            if waited_s > QUIET_BOOT_S and not self._notice_shown and is_terminal(2):
                self._notice_shown = True
                os.write(2, b"understory hil: starting a kernel with CAN ...")
        if self._killed_at is not None and time.monotonic() - self._killed_at > KILL_PATIENCE_S:
            raise Interrupted(signal.SIGKILL)

    def _clear_notice(self) -> None:
        if self._notice_shown:
            os.write(2, b"\r\033[K")
            self._notice_shown = False
