#!/usr/bin/python3 -BES
# Copyright 2026 the Understory authors
# SPDX-License-Identifier: BSD-3-Clause
"""The first process of a kernel that the bus provider boots: makes the CAN interfaces, runs the one
command for the provider and switches off.

It starts without the user's Python packages and settings: these are for the command.
"""

import ctypes
import fcntl
import json
import os
import select
import shutil
import signal
import struct
import sys
import termios
import time
import tty
from typing import Any, Dict, List, Optional

import frames
from execute import execute, fail
from machine import NoBus, prepare

OUTPUT_PENDING = 65536  # more than this is not taken from the command until the host took it
TERM_PATIENCE_S = 2.0  # for what the command left running
KILL_PATIENCE_S = 1.0
POWER_OFF = 0x4321FEDC


def power_off() -> None:
    os.sync()
    ctypes.CDLL(None).reboot(POWER_OFF)


def open_channel(path: str) -> int:
    channel = os.open(path, os.O_RDWR | os.O_NOCTTY)
    if os.isatty(channel):
        tty.setraw(channel)
    os.set_blocking(channel, False)
    return channel


class Command:
    """The command and our ends of its standard files."""

    def __init__(self, spec: Dict[str, Any]) -> None:
        self.outputs: Dict[int, bytes] = {}  # our end: frame kind
        self.input: Optional[int] = None
        self.terminal: Optional[int] = None
        self.on_whole_terminal: bool = spec["whole_terminal"]
        theirs = self._open_files(spec["terminal"], spec["whole_terminal"])
        self.pid = os.fork()
        if self.pid == 0:
            self._become(spec, theirs)
        for end in set(theirs):
            os.close(end)
        for end in [*self.outputs, *([] if self.input is None else [self.input])]:
            os.set_blocking(end, False)

    def _open_files(self, is_terminal: List[bool], whole: bool) -> List[int]:
        """Their ends of standard input, output and error."""
        slave = -1
        if any(is_terminal):
            self.terminal, slave = os.openpty()
            if not whole:
                tty.setraw(slave)  # the host's terminal does the line discipline
            self.outputs[self.terminal] = frames.OUTPUT
        if whole:
            self.input = os.dup(self.terminal)
            return [slave, slave, slave]
        their_input, self.input = os.pipe()
        theirs = [their_input]
        for kind, on_terminal in ((frames.OUTPUT, is_terminal[1]), (frames.ERRORS, is_terminal[2])):
            if on_terminal:
                theirs.append(slave)
            else:
                ours, their = os.pipe()
                self.outputs[ours] = kind
                theirs.append(their)
        return theirs

    def _become(self, spec: Dict[str, Any], theirs: List[int]) -> None:
        os.setsid()
        if self.on_whole_terminal:
            fcntl.ioctl(theirs[0], termios.TIOCSCTTY, 0)
        for number, end in enumerate(theirs):
            os.dup2(end, number)
        signal.set_wakeup_fd(-1)
        signal.signal(signal.SIGCHLD, signal.SIG_DFL)
        os.umask(spec["umask"])
        try:
            os.chdir(spec["folder"])
        except OSError as error:
            fail(spec["folder"], error)
        execute(spec["command"], spec["environment"])

    def close_output(self, kind: bytes) -> None:
        """So that the command notices, as it would with `| head` on the host."""
        for end in [end for end, its in self.outputs.items() if its == kind]:
            if end != self.terminal:
                del self.outputs[end]
                os.close(end)

    def resize(self, size: List[int]) -> None:
        if self.terminal is not None:
            packed = struct.pack("HHHH", size[0], size[1], 0, 0)
            fcntl.ioctl(self.terminal, termios.TIOCSWINSZ, packed)


class Agent:
    """One loop over the channel, the command's files and the death of children."""

    def __init__(self, channel: int) -> None:
        self._channel = channel
        self._decoder = frames.Decoder()
        self._to_host = bytearray()
        self._to_command = bytearray()
        self._input_ended = False
        self._command: Optional[Command] = None
        self._status: Optional[int] = None
        self._ending_since: Optional[float] = None
        self._host_is_there = True
        self._has_children = False
        self._wake, wake_write = os.pipe()
        for end in (self._wake, wake_write):
            os.set_blocking(end, False)
        signal.set_wakeup_fd(wake_write, warn_on_full_buffer=False)
        signal.signal(signal.SIGCHLD, lambda *_: None)

    def run(self) -> None:
        self._send(frames.encode(frames.READY))
        while not self._is_done():
            self._wait_and_serve()
            self._reap()
            self._end_the_rest()
        if self._status is not None:
            os.sync()  # the host must find every file before it hears of the end
            self._send(frames.encode_number(frames.EXIT, self._status))
        self.flush()

    def fail(self, reason: str) -> None:
        self._send(frames.encode(frames.FAILED, os.fsencode(reason)))
        self.flush()

    def flush(self) -> None:
        while self._to_host and self._host_is_there:
            select.select([], [self._channel], [], 1.0)
            self._write_channel()

    def _send(self, frame: bytes) -> None:
        self._to_host += frame

    def _is_done(self) -> bool:
        if self._command is None:
            return not self._host_is_there
        ended = self._status is not None and not self._has_children
        return ended and not self._command.outputs

    def _wait_and_serve(self) -> None:
        command = self._command
        reading = [self._wake]
        writing = [self._channel] if self._to_host and self._host_is_there else []
        if self._host_is_there:
            reading.append(self._channel)
        if command is not None:
            if len(self._to_host) < OUTPUT_PENDING:
                reading += command.outputs
            if command.input is not None and self._to_command:
                writing.append(command.input)
        timeout_s = None if self._ending_since is None else 0.05
        readable, writable, _ = select.select(reading, writing, [], timeout_s)
        if self._wake in readable:
            os.read(self._wake, 4096)
        if self._channel in readable:
            self._read_channel()
        if self._channel in writable:
            self._write_channel()
        if command is not None:
            for end in [end for end in readable if end in command.outputs]:
                self._read_output(command, end)
            if command.input in writable:
                self._write_input()

    def _read_channel(self) -> None:
        try:
            data = os.read(self._channel, 65536)
        except BlockingIOError:
            return
        except OSError:
            data = b""
        if not data:
            self._leave_host()
            return
        self._send(frames.encode_number(frames.RECEIVED, len(data)))
        for kind, payload in self._decoder.feed(data):
            self._on_frame(kind, payload)

    def _leave_host(self) -> None:
        """The provider was killed: nobody wants the command any more, nobody else tidies up."""
        self._host_is_there = False
        self._to_host.clear()
        self._signal_command(signal.SIGTERM)
        self._ending_since = self._ending_since or time.monotonic()
        shutil.rmtree(os.environ["HIL_FOLDER"], ignore_errors=True)

    def _on_frame(self, kind: bytes, payload: bytes) -> None:
        if kind == frames.START:
            self._command = Command(json.loads(payload))
            self._has_children = True
        elif kind == frames.SIGNAL:
            self._signal_command(frames.number_of(payload))
        elif kind == frames.SIZE and self._command is not None:
            self._command.resize(json.loads(payload))
        elif kind == frames.CLOSED and self._command is not None:
            self._command.close_output(payload)
        elif kind == frames.INPUT and payload:
            self._to_command += payload
        elif kind == frames.INPUT:
            self._input_ended = True
        if kind == frames.INPUT:
            self._close_input_at_end()

    def _signal_command(self, number: int) -> None:
        if number == signal.SIGKILL:
            os.kill(-1, signal.SIGKILL)
        elif self._command is not None and self._status is None:
            try:
                os.killpg(self._command.pid, number)
            except ProcessLookupError:
                pass  # it has just ended

    def _write_channel(self) -> None:
        try:
            written = os.write(self._channel, self._to_host[:4096])
        except BlockingIOError:
            return
        except OSError:
            self._leave_host()
            return
        del self._to_host[:written]

    def _read_output(self, command: Command, end: int) -> None:
        try:
            data = os.read(end, frames.CHUNK)
        except BlockingIOError:
            return
        except OSError:  # a terminal that nobody has open any more
            data = b""
        if data:
            if self._host_is_there:
                self._send(frames.encode(command.outputs[end], data))
            return
        del command.outputs[end]
        if end == command.terminal:
            command.terminal = None
        os.close(end)

    def _write_input(self) -> None:
        assert self._command is not None and self._command.input is not None
        try:
            taken = os.write(self._command.input, self._to_command[: frames.CHUNK])
        except BlockingIOError:
            return
        except OSError:  # the command reads no more: as with a pipe, the rest is lost
            taken = len(self._to_command)
        del self._to_command[:taken]
        self._send(frames.encode_number(frames.TAKEN, taken))
        self._close_input_at_end()

    def _close_input_at_end(self) -> None:
        command = self._command
        if self._input_ended and not self._to_command and command is not None:
            if command.input is not None and not command.on_whole_terminal:
                os.close(command.input)
                command.input = None

    def _reap(self) -> None:
        while True:
            try:
                pid, status = os.waitpid(-1, os.WNOHANG)
            except ChildProcessError:
                self._has_children = False  # as first process we inherit all: nothing else runs
                return
            if pid == 0:
                return
            if self._command is not None and pid == self._command.pid:
                self._status = status
                self._ending_since = self._ending_since or time.monotonic()
                os.kill(-1, signal.SIGTERM)  # it does not reach ourselves

    def _end_the_rest(self) -> None:
        """What the command left running gets a moment to end."""
        if self._ending_since is None:
            return
        waited_s = time.monotonic() - self._ending_since
        if waited_s > TERM_PATIENCE_S and self._has_children:
            os.kill(-1, signal.SIGKILL)
        if waited_s > TERM_PATIENCE_S + KILL_PATIENCE_S and self._command is not None:
            self._command.outputs.clear()  # not even killing helped: give up on its output


def main() -> None:
    reason = None
    try:
        prepare()
    except (NoBus, OSError) as error:
        reason = str(error)
    agent = Agent(open_channel(os.environ["HIL_CHANNEL"]))
    if reason is not None:
        agent.fail(reason)
    else:
        agent.run()


if __name__ == "__main__":
    if os.getpid() != 1:  # it ends all other processes of its machine
        sys.exit("agent.py is for the first process of a booted kernel")
    try:
        main()
    finally:
        power_off()
