# Copyright 2026 the Understory authors
# SPDX-License-Identifier: BSD-3-Clause
"""What the HIL tests share: plain CAN sockets and the standard tools."""

import contextlib
import fcntl
import json
import os
import re
import select
import socket
import struct
import subprocess
import threading
import time
import tty
from pathlib import Path
from typing import Any, Dict, List, NamedTuple, Optional

ROOT = Path(__file__).resolve().parents[2]
BUS = os.environ.get("UNDERSTORY_CAN", "vcan0")
FRAME = struct.Struct("=IB3x8s")
OWN_FRAMES = 4  # CAN_RAW_RECV_OWN_MSGS
ERROR_FILTER = 2  # CAN_RAW_ERR_FILTER
ALL_ERRORS = 0x1FFFFFFF
SET_LINE_DISCIPLINE, SLCAN = 0x5423, 17
NAME_OF_DEVICE = 0x8910  # SIOCGIFNAME
STAMPS_NS = 35  # SO_TIMESTAMPNS


class Frame(NamedTuple):
    id: int
    data: bytes
    stamp_s: float = 0.0  # when the kernel received it
    is_own: bool = False  # the confirmation that our own frame was sent

    def __str__(self) -> str:
        return f"{self.id:03X}#{self.data.hex().upper()}"


def frame_of(text: str) -> Frame:
    """From candump's notation."""
    number, _, data = text.partition("#")
    return Frame(int(number, 16), bytes.fromhex(data))


class Port:
    """A raw CAN socket with stamps of the kernel."""

    def __init__(self, name: str = BUS, own_frames: bool = False, errors: bool = False) -> None:
        self.socket = socket.socket(socket.PF_CAN, socket.SOCK_RAW, socket.CAN_RAW)
        self.socket.setsockopt(socket.SOL_SOCKET, STAMPS_NS, 1)
        self.socket.setsockopt(socket.SOL_CAN_RAW, OWN_FRAMES, int(own_frames))
        if errors:
            self.socket.setsockopt(socket.SOL_CAN_RAW, ERROR_FILTER, ALL_ERRORS)
        self.socket.bind((name,))

    def __enter__(self) -> "Port":
        return self

    def __exit__(self, *_: Any) -> None:
        self.socket.close()

    def send(self, frame: Frame) -> None:
        self.socket.send(FRAME.pack(frame.id, len(frame.data), frame.data.ljust(8, b"\0")))

    def receive(self, patience_s: float = 2.0) -> Optional[Frame]:
        """None if nothing came."""
        if not select.select([self.socket], [], [], patience_s)[0]:
            return None
        data, extras, flags, _ = self.socket.recvmsg(FRAME.size, 128)
        number, length, payload = FRAME.unpack(data)
        stamp_s = 0.0
        for level, kind, value in extras:
            if level == socket.SOL_SOCKET and kind == STAMPS_NS:
                seconds, nanoseconds = struct.unpack("ll", value[:16])
                stamp_s = seconds + nanoseconds * 1e-9
        return Frame(number, payload[:length], stamp_s, bool(flags & socket.MSG_CONFIRM))


def run(*words: Any, patience_s: float = 30.0) -> "subprocess.CompletedProcess[str]":
    return subprocess.run(
        [str(word) for word in words],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        encoding="utf-8",
        errors="replace",
        timeout=patience_s,
        check=False,
    )


def must_run(*words: Any, patience_s: float = 30.0) -> str:
    """Standard output; the tool's own words in the exception if it fails."""
    outcome = run(*words, patience_s=patience_s)
    if outcome.returncode != 0:
        raise AssertionError(f"{' '.join(map(str, words))}: {outcome.stderr or outcome.stdout}")
    return outcome.stdout


def link(name: str) -> Dict[str, Any]:
    """What ip tells of an interface."""
    return json.loads(must_run("ip", "-details", "-json", "link", "show", "dev", name))[0]


class Candump:
    """candump in the background; it listens once this is constructed."""

    def __init__(self, *words: str) -> None:
        before = self._receivers()
        self._process = subprocess.Popen(
            ["candump", *words], stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, encoding="utf-8"
        )
        wait_until(lambda: self._receivers() > before, "candump to listen")

    @staticmethod
    def _receivers() -> int:
        listed = Path("/proc/net/can/rcvlist_all").read_text(encoding="ascii")
        return len(re.findall(r"raw$", listed, re.MULTILINE))

    def lines(self, patience_s: float = 10.0) -> List[str]:
        """What it printed until it ended by itself (-n, -T)."""
        output, _ = self._process.communicate(timeout=patience_s)
        return output.splitlines()


class SerialAdapter:
    """A CAN device of the kernel whose other end we hold: slcan on a pseudo terminal."""

    def __init__(self) -> None:
        self._master, self._slave = os.openpty()
        tty.setraw(self._slave)
        self._received = b""
        # The device comes up only while somebody reads what it writes.
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()
        fcntl.ioctl(self._slave, SET_LINE_DISCIPLINE, struct.pack("i", SLCAN))
        self.name = fcntl.ioctl(self._slave, NAME_OF_DEVICE, bytes(40))[:16].rstrip(b"\0").decode()
        must_run("ip", "link", "set", self.name, "type", "can", "bitrate", 1000000)
        must_run("ip", "link", "set", self.name, "up")

    def write(self, text: bytes) -> None:
        os.write(self._master, text)

    def _read(self) -> None:
        with contextlib.suppress(OSError):  # closed
            while True:
                self._received += os.read(self._master, 4096)

    def wait_for(self, text: bytes) -> None:
        """Until the device wrote it."""
        wait_until(lambda: text in self._received, f"{text!r} from the adapter")

    def close(self) -> None:
        os.close(self._slave)
        self._reader.join()
        os.close(self._master)


def wait_until(condition: Any, what: str, patience_s: float = 10.0) -> None:
    deadline = time.monotonic() + patience_s
    while not condition():
        if time.monotonic() > deadline:
            raise AssertionError(f"waited {patience_s:.0f} s in vain for {what}")
        time.sleep(0.02)
