# Copyright 2026 the Understory authors
# SPDX-License-Identifier: BSD-3-Clause
"""A bench for flights on a CAN bus: the vehicle, the host, and a listener that decodes what they
say by the DBC, with the stamps of the kernel. Times are of CLOCK_REALTIME, in seconds."""

import contextlib
import json
import os
import re
import signal
import socket
import struct
import subprocess
import sys
import threading
import time
import unittest
from pathlib import Path
from typing import Any, Callable, Dict, Iterator, List, NamedTuple, Optional, Sequence, Tuple

from can_tools import FRAME, ROOT, STAMPS_NS, must_run, wait_until

sys.path += [str(ROOT / "firmware_bridge" / "can"), str(ROOT / "test" / "support")]
import dbc  # noqa: E402  pylint: disable=wrong-import-position
from machine import PatientTest  # noqa: E402  pylint: disable=wrong-import-position

HOST_BUS = "vcan0"
VEHICLE_BUS = "vcan1"  # behind the faulty wire
RECEIVE_BUFFER_FORCE = 33  # SO_RCVBUFFORCE
FILTER_MASK = 0xC00007FF  # 11 bits, neither extended nor remote
RECEIVE_BUFFER_BYTES = 8 << 20
LAUNCHER_HEIGHT_M = 1.0
LINES_SHOWN = 5  # of a program, where a test fails
# For logs: writing to the folders of the machine around it may stop a booted kernel for a while.
MEMORY = "/dev/shm"

VERSION, MESSAGES = dbc.read_messages(ROOT / "firmware_bridge" / "can" / "understory.dbc")
BY_NAME = {message.dbc_name: message for message in MESSAGES}
BY_ID = {message.id: message for message in MESSAGES}
PROTOCOL_HASH = dbc.protocol_hash(MESSAGES)
SETPOINT = ("SP_POS_XY", "SP_POS_Z", "SP_VEL", "SP_ACC", "SP_COMMIT")
ODOMETRY = ("ODO_POS_XY", "ODO_POS_Z", "ODO_VEL", "ODO_ATT", "ODO_RATE")
FLYING = ("ARMED", "HOLD", "LAND")

# What a test may find too late beyond what the vehicle itself stood still: VEH_STATE comes every
# 20 ms, and the machine is shared.
STATE_PERIOD_S = 0.02
SCHEDULING_S = 0.03
STAMPS_DIFFER_S = 0.001


class Said(NamedTuple):
    """A frame that decoded."""

    stamp_s: float
    name: str
    counter: int
    values: Dict[str, Any]  # codes by their names, numbers in their units

    def __getitem__(self, key: Any) -> Any:
        return self.values[key]


def decode(message: "dbc.Message", data: bytes) -> Optional[Dict[str, Any]]:
    """None if the checksum or the length is wrong."""
    if len(data) != 8 or dbc.crc8(data[1:] + bytes([message.data_id])) != data[0]:
        return None
    word = int.from_bytes(data, "little")
    values: Dict[str, Any] = {}
    for sig in message.signals:
        raw = (word >> sig.start) & ((1 << sig.size) - 1)
        if sig.is_signed and raw >= 1 << (sig.size - 1):
            raw -= 1 << sig.size
        number = raw if sig.is_whole else raw * sig.factor + sig.offset
        values[sig.dbc_name] = sig.values.get(raw, number)
    return values


def encode(name: str, counter: int, **raws: int) -> bytes:
    """What is not named is 0."""
    message = BY_NAME[name]
    assert raws.keys() <= {sig.dbc_name for sig in message.signals}
    return dbc.frame_bytes(message, [raws.get(sig.dbc_name, 0) for sig in message.signals], counter)


def crc32c(data: bytes) -> int:
    crc = 0xFFFFFFFF
    for byte in data:
        crc ^= byte
        for _ in range(8):
            crc = crc >> 1 ^ (0x82F63B78 if crc & 1 else 0)
    return crc ^ 0xFFFFFFFF


def arm_token(nonce: int, session: int) -> int:
    return crc32c(struct.pack("<HH", nonce, session) + b"ARM1")


def program(name: str) -> str:
    """Where the build is that the suite made, or else the developer's own."""
    named = os.environ.get(f"{name.upper()}")
    if named:
        return named
    folders = [Path(os.environ.get("UNDERSTORY_BUILD", ROOT / "build-test")), ROOT / "build"]
    for folder in folders:
        path = folder / "hil" / name
        if path.exists():
            return str(path)
    raise unittest.SkipTest(f"{name} is not built in {' or '.join(map(str, folders))}")


# What tests look at; the rest would only cost time.
HEARD = ("KILL", "ARM_CMD", "VEH_STATE", "ESC_CMD", "SP_POS_XY", "SP_COMMIT", "SP_ACK")
HEARD += ("PING", "PONG", "ODO_POS_XY", "ODO_POS_Z", "ODO_RATE", "HOST_HB", "VEH_HB", "BATTERY")
HEARD += ("HOST_LINK", "VEH_LINK")


class Listener:
    """These messages on a bus, from its construction on; another thread listens."""

    def __init__(self, interface: str = HOST_BUS, names: Sequence[str] = HEARD) -> None:
        self._socket = socket.socket(socket.PF_CAN, socket.SOCK_RAW, socket.CAN_RAW)
        self._socket.setsockopt(socket.SOL_SOCKET, STAMPS_NS, 1)
        self._socket.setsockopt(socket.SOL_SOCKET, RECEIVE_BUFFER_FORCE, RECEIVE_BUFFER_BYTES)
        filters = [struct.pack("=II", BY_NAME[name].id, FILTER_MASK) for name in names]
        self._socket.setsockopt(socket.SOL_CAN_RAW, socket.CAN_RAW_FILTER, b"".join(filters))
        # So that the thread notices when this is closed.
        patience = struct.pack("ll", 0, 200_000)
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVTIMEO, patience)
        self._socket.bind((interface,))
        self._raw: Dict[int, List[Tuple[float, bytes]]] = {}
        self._decoded: Dict[str, Tuple[int, List[Said]]] = {}
        self.frames: List[Tuple[float, int, bytes]] = []
        self._is_closed = False
        self._thread = threading.Thread(target=self._listen, daemon=True)
        self._thread.start()

    def _listen(self) -> None:
        unpack, stamp_of, room = FRAME.unpack, struct.Struct("ll").unpack, FRAME.size
        while not self._is_closed:
            try:
                data, extras, _, _ = self._socket.recvmsg(room, 64)
            except OSError:  # nothing came, the interface went down, or this is closed
                continue
            seconds, nanoseconds = stamp_of(extras[0][2][:16])
            number, length, payload = unpack(data)
            stamp_s = seconds + nanoseconds * 1e-9
            self.frames.append((stamp_s, number, payload[:length]))
            self._raw.setdefault(number, []).append((stamp_s, payload[:length]))

    def close(self) -> None:
        self._is_closed = True
        self._thread.join()
        self._socket.close()

    def catch_up(self, patience_s: float = 5.0) -> None:
        """Until what has been said so far has been read, on a bus where something is always said: the
        thread that listens may lag behind, and what it has last is not the last then."""
        now_s = time.time()
        wait_until(lambda: self.frames and self.frames[-1][0] >= now_s, "a frame", patience_s)

    def of(self, name: str, since_s: float = 0.0, until_s: float = 1e12) -> List[Said]:
        """Those whose checksum is right."""
        message = BY_NAME[name]
        done, found = self._decoded.get(name, (0, []))
        raw = self._raw.get(message.id, [])
        for stamp_s, data in raw[done : (done := len(raw))]:
            values = decode(message, data)
            if values is not None:
                found.append(Said(stamp_s, name, data[1] & 0xF, values))
        self._decoded[name] = (done, found)
        return [said for said in found if since_s <= said.stamp_s <= until_s]

    def wait_for(
        self,
        name: str,
        is_wanted: Callable[[Said], bool] = lambda said: True,
        patience_s: float = 10.0,
        since_s: float = 0.0,
    ) -> Said:
        """The first such frame that came since then, or comes yet."""
        deadline = time.monotonic() + patience_s
        seen, is_last = 0, False
        while True:
            found = self.of(name, since_s)
            for said in found[seen:]:
                if is_wanted(said):
                    return said
            seen = len(found)
            if is_last:
                last = f"; the last was {found[-1].values}" if found else ""
                raise AssertionError(f"waited {patience_s:.1f} s for another {name}{last}")
            if is_last := time.monotonic() > deadline:
                with contextlib.suppress(AssertionError):  # a silent bus
                    self.catch_up()
            time.sleep(0.005)

    def wait_for_state(
        self, *states: str, patience_s: float = 10.0, since_s: float = 0.0
    ) -> Said:
        return self.wait_for(
            "VEH_STATE", lambda said: said["State"] in states, patience_s, since_s
        )

    def states(self, since_s: float = 0.0) -> List[Tuple[str, str]]:
        """State and reason, as they changed."""
        found: List[Tuple[str, str]] = []
        for said in self.of("VEH_STATE", since_s):
            now = (said["State"], said["StateReason"])
            if not found or found[-1] != now:
                found.append(now)
        return found

    def positions(self, since_s: float = 0.0) -> Iterator[Tuple[float, float, float, float]]:
        """Stamp, x, y, z of the odometry."""
        planes: Dict[int, Said] = {}
        both = self.of("ODO_POS_XY", since_s) + self.of("ODO_POS_Z", since_s)
        for said in sorted(both):
            if said.name == "ODO_POS_XY":
                planes[said.counter] = said
            elif said.counter in planes:
                xy = planes.pop(said.counter)
                if said.stamp_s - xy.stamp_s < 0.02:
                    yield said.stamp_s, xy["OdoX"], xy["OdoY"], said["OdoZ"]

    def last_flown(self, before_s: float) -> Said:
        """The commit of the last set before then that the vehicle flew."""
        acks = self.of("SP_ACK", until_s=before_s)
        ack = [said for said in acks if said["AckResult"] == "FLOWN"][-1]
        commits = self.of("SP_COMMIT", ack.stamp_s - 0.5, ack.stamp_s)
        return [said for said in commits if said["SpSeq"] == ack["AckSeq"]][-1]

    def standstills(self) -> List[Tuple[float, float]]:
        """When the vehicle did nothing though it should have: from, and to when it was back."""
        ids = {BY_NAME[name].id for name in ("ODO_RATE", "VEH_STATE")}
        stamps = [stamp for stamp, number, _ in self.frames if number in ids]
        gaps = zip(stamps, stamps[1:])
        return [(before, after) for before, after in gaps if after - before > 0.02]


class Program:
    """One of ours, at work; what it says is kept."""

    def __init__(self, *words: Any) -> None:
        self.lines: List[str] = []
        environment = {**os.environ, "UNDERSTORY_ROOT": str(ROOT)}
        self.process = subprocess.Popen(
            [str(word) for word in words],
            env=environment,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            encoding="utf-8",
        )
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def _read(self) -> None:
        assert self.process.stdout is not None
        for line in self.process.stdout:
            self.lines.append(line.rstrip("\n"))

    def tell(self, line: str) -> None:
        assert self.process.stdin is not None
        self.process.stdin.write(line + "\n")
        self.process.stdin.flush()

    def wait_for_line(self, pattern: str, patience_s: float = 10.0) -> str:
        def found() -> List[str]:
            return [line for line in list(self.lines) if re.search(pattern, line)]

        wait_until(found, f"a line like {pattern!r}; it said {self.lines[-5:]}", patience_s)
        return found()[0]

    def kill(self) -> float:
        """As if it had crashed. Returns when."""
        self.process.kill()
        now_s = time.time()
        self.process.wait(10.0)
        return now_s

    def stop(self, patience_s: float = 10.0) -> int:
        """As Ctrl-C does; its exit status."""
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGINT)
        return self.wait(patience_s)

    def wait(self, patience_s: float = 30.0) -> int:
        status = self.process.wait(patience_s)
        self._reader.join(5.0)
        return status

    def close(self) -> None:
        if self.process.poll() is None:
            self.process.kill()
        self.process.wait()
        self._reader.join(5.0)
        for file in (self.process.stdin, self.process.stdout):
            assert file is not None
            file.close()

    def counters(self) -> Dict[str, int]:
        """Of the host's last line."""
        line = next(line for line in reversed(self.lines) if " sent " in line)
        return {name: int(value) for name, value in re.findall(r"([a-z]+) (\d+)(?= |$)", line)}


class FlightTest(PatientTest):
    """Whatever a test starts ends with it."""

    host_bus = vehicle_bus = HOST_BUS

    def setUp(self) -> None:
        self.programs: List[Program] = []
        self.bus = self.listen(self.host_bus)

    def run(self, result: Optional[unittest.TestResult] = None) -> Optional[unittest.TestResult]:
        before = 0 if result is None else len(result.failures) + len(result.errors)
        outcome = super().run(result)
        if outcome is not None and len(outcome.failures) + len(outcome.errors) > before:
            self.show_programs()
        return outcome

    def show_programs(self) -> None:
        """What they said last tells most."""
        for started in self.programs:
            print("   ", " ".join(map(str, started.process.args)))
            print(*(f"      {line}" for line in started.lines[-LINES_SHOWN:]), sep="\n")

    def listen(self, interface: str, names: Sequence[str] = HEARD) -> Listener:
        listener = Listener(interface, names)
        self.addCleanup(listener.close)
        return listener

    def run_program(self, *words: Any) -> Program:
        started = Program(*words)
        self.programs.append(started)
        self.addCleanup(started.close)
        return started

    def start_vehicle(self, *words: Any) -> Program:
        """Listens to the bus already."""
        vehicle = self.run_program(
            program("understory_vehicle"), "--interface", self.vehicle_bus, *words
        )
        vehicle.wait_for_line("DISARMED")
        return vehicle

    def start_host(self, *words: Any) -> Program:
        return self.run_program(
            program("understory_host"), "--interface", self.host_bus, "--height", 0.5, *words
        )

    def fly(self, *host_words: Any) -> Tuple[Program, Program]:
        """Vehicle and host, in flight and above where it hung."""
        began_s = time.time()
        vehicle = self.start_vehicle()
        host = self.start_host("--duration", 60, *host_words)
        self.bus.wait_for_state("ARMED", since_s=began_s)
        self.bus.wait_for(
            "ODO_POS_Z", lambda said: said["OdoZ"] > LAUNCHER_HEIGHT_M + 0.4, since_s=began_s
        )
        return vehicle, host

    def assert_never_armed(self, since_s: float = 0.0) -> None:
        states = [state for state, _ in self.bus.states(since_s)]
        self.assert_never("ARMED" in states, "armed all the same")

    def assert_after(
        self, limit_s: float, begin_s: float, end: Said, what: str, early_s: float = 0.0
    ) -> None:
        """`end` came when it was due: never early, and late only by what the machine explains.
        `early_s`: the vehicle's clock began so much before `begin_s` at most."""
        took_s = end.stamp_s - begin_s
        still = self.bus.standstills() + self.machine.gaps()
        near = [e - b for b, e in still if e > begin_s and b < end.stamp_s]
        late_s = STATE_PERIOD_S + SCHEDULING_S + sum(near)
        text = f"{what} after {1e3 * took_s:.1f} ms"
        print(f"    {text}, due after {1e3 * limit_s:.0f} ms")
        self.assert_never(took_s < limit_s - early_s - STAMPS_DIFFER_S, f"too early: {text}")
        self.assertLess(took_s, limit_s + late_s, f"{text}, allowed {1e3 * late_s:.0f} ms late")

    def assert_lands(self, patience_s: float = 15.0, since_s: float = 0.0) -> None:
        landed = self.bus.wait_for(
            "VEH_STATE",
            lambda said: (said["State"], said["StateReason"]) == ("DISARMED", "LANDED"),
            patience_s,
            since_s,
        )
        self.assertEqual(landed["FlagOnGround"], 1)


def summary_of(log_path: Path) -> Dict[str, Any]:
    """What our log tool says of it."""
    tool = ROOT / "firmware_bridge" / "log" / "log.py"
    return json.loads(must_run(sys.executable, tool, "--summary", "--json", log_path))
