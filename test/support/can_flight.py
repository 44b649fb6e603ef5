#!/usr/bin/python3
# Copyright 2026 the Understory authors
# SPDX-License-Identifier: BSD-3-Clause
"""A made-up flight as a log of the bus: every message, each time the same bytes for the same seed.

usage: can_flight.py LOG SECONDS     writes it in candump's format

Disarmed, armed after 0.5 s, 0.5 s before the end on the ground again; the vehicle follows the
setpoints of a circle 0.1 s later. Its clock wraps in the second second.
"""

import math
import pathlib
import random
import sys
from dataclasses import dataclass
from typing import Callable, Dict, Iterable, List

ROOT = pathlib.Path(__file__).resolve().parents[2]
CAN, LOG = ROOT / "firmware_bridge" / "can", ROOT / "firmware_bridge" / "log"
sys.path[:0] = [str(CAN), str(LOG)]
from dbc import Message, frame_bytes, protocol_hash, read_messages  # noqa: E402

DBC = CAN / "understory.dbc"
VERSION, MESSAGES = read_messages(DBC)
BY_NAME = {message.dbc_name: message for message in MESSAGES}
BEGIN_US = 1_700_000_000_000_000
FRAME_US = 130  # on the wire, about
WRAP_US = 1 << 24
VEHICLE_AHEAD_US = WRAP_US - 1_500_000  # the vehicle's clock when the log begins
PONG_DELAY_US = 60
PING_US = FRAME_US  # way of a ping or pong at least, between log and vehicle
LAG_S = 0.1
STATES = {"DISARMED": 1, "ARMED": 3, "LAND": 5}


@dataclass
class Sent:
    time_us: int  # since the log's begin
    message: Message
    counter: int
    raws: Dict[str, int]

    @property
    def name(self) -> str:
        return self.message.dbc_name

    @property
    def data(self) -> bytes:
        raws = [self.raws.get(signal.dbc_name, 0) for signal in self.message.signals]
        return frame_bytes(self.message, raws, self.counter)


def raws_of(message: Message, values: Dict[str, float]) -> Dict[str, int]:
    signals = {signal.dbc_name: signal for signal in message.signals}
    return {
        name: round((value - signals[name].offset) / signals[name].factor)
        for name, value in values.items()
    }


def smooth(part: float) -> float:
    part = min(max(part, 0.0), 1.0)
    return part * part * (3.0 - 2.0 * part)


class Flight:
    """Fills `frames`; see flight()."""

    def __init__(self, duration_s: float, seed: int):
        self.rng = random.Random(seed)
        self.duration_s = duration_s
        self.frames: List[Sent] = []
        self.counters: Dict[str, int] = {}

    def send(self, time_us: int, name: str, **values: float) -> None:
        counter = self.counters.get(name, 0)
        self.counters[name] = (counter + 1) % 16
        message = BY_NAME[name]
        self.frames.append(Sent(int(time_us), message, counter, raws_of(message, values)))

    def state(self, time_s: float) -> str:
        if time_s < 0.5 or time_s >= self.duration_s - 0.25:
            return "DISARMED"
        return "ARMED" if time_s < self.duration_s - 0.5 else "LAND"

    def position_at(self, time_s: float) -> List[float]:
        """Up and outwards, round and round, back and down."""
        rise_s = min(6.0, (self.duration_s - 0.75) / 3)
        part = smooth((time_s - 0.5) / rise_s) * smooth((self.duration_s - 0.5 - time_s) / rise_s)
        angle = 0.35 * time_s
        return [4.0 * part * math.cos(angle), 4.0 * part * math.sin(angle), 2.0 * part]

    def velocity_at(self, time_s: float) -> List[float]:
        before, after = self.position_at(time_s - 0.01), self.position_at(time_s + 0.01)
        return [(b - a) / 0.02 for a, b in zip(before, after)]

    def setpoint(self, at_us: int, number: int) -> None:
        time_s = at_us / 1e6
        x, y, z = self.position_at(time_s)
        vx, vy, vz = self.velocity_at(time_s)
        clock_us = vehicle_clock(at_us - 400)  # computed shortly before
        self.send(at_us, "SP_POS_XY", SpX=x, SpY=y)
        self.send(at_us + FRAME_US, "SP_POS_Z", SpZ=z, SpTime=clock_us)
        self.send(at_us + 2 * FRAME_US, "SP_VEL", SpVx=vx, SpVy=vy, SpVz=vz)
        self.send(at_us + 3 * FRAME_US, "SP_ACC", SpAx=0.1, SpAy=-0.1, SpAz=0)
        commit_us = at_us + 4 * FRAME_US
        yaw = math.remainder(0.35 * time_s, 2 * math.pi)
        self.send(commit_us, "SP_COMMIT", SpYaw=yaw, SpYawRate=0.35, SpMask=31, SpSeq=number % 256)
        ack_us = commit_us + 150 + self.rng.randrange(200)
        self.send(
            ack_us,
            "SP_ACK",
            AckResult=0 if self.state(time_s) == "ARMED" else 1,
            AckSeq=number % 256,
            AckTime=vehicle_clock(ack_us),
            AckDelay=400 + ack_us - at_us,
        )

    def odometry(self, at_us: int) -> None:
        time_s = max(at_us / 1e6 - LAG_S, 0.0)
        noise = [self.rng.gauss(0, 0.01) for _ in range(3)]
        x, y, z = (value + off for value, off in zip(self.position_at(time_s), noise))
        vx, vy, vz = self.velocity_at(time_s)
        clock_us = vehicle_clock(at_us - 200)
        yaw = math.remainder(0.35 * time_s, 2 * math.pi)
        self.send(at_us, "ODO_POS_XY", OdoX=x, OdoY=y)
        self.send(at_us + FRAME_US, "ODO_POS_Z", OdoZ=z, OdoTime=clock_us)
        self.send(at_us + 2 * FRAME_US, "ODO_VEL", OdoVx=vx, OdoVy=vy, OdoVz=vz)
        self.send(at_us + 3 * FRAME_US, "ODO_ATT", OdoRoll=0.05, OdoPitch=-0.03, OdoYaw=yaw)
        self.send(at_us + 4 * FRAME_US, "ODO_RATE", OdoQuality=1, OdoP=0, OdoQ=0, OdoR=0.35)
        base = 4000 + 800 * math.sin(time_s) if self.state(at_us / 1e6) != "DISARMED" else 0
        rpm = {f"EscRpm{esc}": max(0, base + 100 * esc) for esc in range(4)}
        self.send(at_us + 5 * FRAME_US, "ESC_RPM", EscOkMask=15, **rpm)

    def vehicle_state(self, at_us: int) -> None:
        state = self.state(at_us / 1e6)
        is_first = at_us < 500_000
        reason = {"ARMED": 0, "LAND": 2, "DISARMED": 1 if is_first else 10}[state]
        self.send(
            at_us,
            "VEH_STATE",
            State=STATES[state],
            StateReason=reason,
            FlagSetpoints=int(at_us >= 400_000),
            FlagHost=1,
            FlagOnGround=int(state == "DISARMED"),
            StateNonce=0xBEEF if is_first else 0xCAFE,
        )

    def slow(self, at_us: int, tick: int) -> None:
        time_s = at_us / 1e6
        flying = self.state(time_s) != "DISARMED"
        if tick % 10 == 3:
            beat = {"ProtoMajor": int(VERSION.split(".", maxsplit=1)[0]), "ProtoMinor": 0}
            beat.update(DbcHash=protocol_hash(MESSAGES), Uptime=int(time_s))
            host = {f"Host{name}": value for name, value in beat.items()}
            vehicle = {f"Veh{name}": value for name, value in beat.items()}
            self.send(at_us, "HOST_HB", HostState=3 if flying else 1, **host)
            self.send(at_us + FRAME_US, "VEH_HB", VehHealth=0, **vehicle)
            self.send(at_us + 2 * FRAME_US, "ARM_CMD", ArmRequest=int(0.3 < time_s < 2), ArmToken=7)
            for esc in range(4):
                values = {"Idx": esc, "Volt": 15.8, "Curr": 6 * flying, "Temp": 30 + esc, "Err": 0}
                named = {f"Esc{name}{esc}": value for name, value in values.items()}
                self.send(at_us + (3 + esc) * FRAME_US, f"ESC_STAT{esc}", **named)
        if tick % 20 == 7:
            soc = 95 - 20 * time_s / 600
            battery = {"BattVolt": 16.2 - time_s / 600, "BattCurr": 24 * flying, "BattSoc": soc}
            self.send(at_us, "BATTERY", **battery)
            number = tick // 20
            self.send(at_us + FRAME_US, "PING", PingSeq=number % 256, PingT1=at_us % WRAP_US)
            ping_us = at_us + FRAME_US + PING_US + self.rng.randrange(40)
            pong = {"PongT2": vehicle_clock(ping_us), "PongDt": PONG_DELAY_US}
            pong_us = ping_us + PONG_DELAY_US + PING_US
            self.send(pong_us, "PONG", PongSeq=number % 256, **pong)
        if tick % 100 == 11:
            self.send(at_us, "HOST_LINK", HlRxOk=tick % 65536)
            self.send(at_us + FRAME_US, "VEH_LINK", VlRxOk=tick % 65536)


def vehicle_clock(time_us: int) -> int:
    return (VEHICLE_AHEAD_US + time_us) % WRAP_US


def flight(duration_s: float = 3.0, seed: int = 1) -> List[Sent]:
    """Frames in the order of the bus, 100 setpoints and odometries a second."""
    made = Flight(duration_s, seed)
    for tick in range(round(100 * duration_s)):
        at_us = 10_000 * tick
        made.setpoint(at_us + made.rng.randrange(60), tick)
        made.odometry(at_us + 5000)
        made.slow(at_us + 2000, tick)
        if tick % 2 == 0:
            made.vehicle_state(at_us + 7500)
    return sorted(made.frames, key=lambda frame: frame.time_us)


def line(time_us: int, identifier: int, data: bytes, interface: str = "vcan0") -> str:
    seconds, fraction = divmod(BEGIN_US + time_us, 1_000_000)
    return f"({seconds:010d}.{fraction:06d}) {interface} {identifier:03X}#{data.hex().upper()}\n"


def candump(frames: Iterable[Sent], interface: str = "vcan0") -> str:
    return "".join(line(each.time_us, each.message.id, each.data, interface) for each in frames)


def without(frames: Iterable[Sent], is_lost: Callable[[Sent], bool]) -> List[Sent]:
    return [frame for frame in frames if not is_lost(frame)]


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    pathlib.Path(sys.argv[1]).write_text(candump(flight(float(sys.argv[2]))), encoding="ascii")
