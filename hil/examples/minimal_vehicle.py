#!/usr/bin/python3
# Copyright 2026 the Understory authors
# SPDX-License-Identifier: BSD-3-Clause
"""A vehicle for the bus in one file, written from docs/hil.md and docs/can_protocol.md alone: a
point mass that is where the setpoint says, without motors and battery. To be copied and changed.

minimal_vehicle.py [INTERFACE]; Ctrl-C ends it.
"""

import contextlib
import math
import random
import select
import socket
import struct
import sys
import time

DBC_HASH, KILL_MAGIC = 0xFC12, (1263094860).to_bytes(4, "little")
MESSAGES = {name: (int(identifier, 16), int(data_identifier, 16))
            for name, identifier, data_identifier in (entry.split(":") for entry in """
    KILL:010:11 ARM_CMD:020:18 VEH_STATE:021:1F SP_POS_XY:100:2D SP_POS_Z:101:34 SP_VEL:102:3B
    SP_ACC:103:42 SP_COMMIT:104:49 SP_ACK:110:50 PING:180:57 PONG:181:5E ODO_POS_XY:200:65
    ODO_POS_Z:201:6C ODO_VEL:202:73 ODO_ATT:203:7A ODO_RATE:204:81 ESC_RPM:210:88 ESC_STAT0:300:8F
    ESC_STAT1:301:96 ESC_STAT2:302:9D ESC_STAT3:303:A4 BATTERY:310:AB HOST_HB:400:B2 VEH_HB:401:B9
    HOST_LINK:410:C0 VEH_LINK:411:C7""".split())}
NAMES = {identifier: name for name, (identifier, _) in MESSAGES.items()}
SETPOINT = ("SP_POS_XY", "SP_POS_Z", "SP_VEL", "SP_ACC", "SP_COMMIT")
FROM_HOST = SETPOINT + ("KILL", "ARM_CMD", "PING", "HOST_HB", "HOST_LINK")
DISARMED, ARMING, ARMED, HOLD, LAND, KILLED = 1, 2, 3, 4, 5, 6  # State
NONE, POWER_ON, HOST_REQUEST, SETPOINT_SILENCE, HOST_SILENCE = range(5)  # StateReason
LINK_FAULT, KILL, LANDED, FOREIGN_VEHICLE = 8, 9, 10, 11
ARM_TOKEN, ARM_VERSION, ARM_DBC_HASH, ARM_NO_HEARTBEAT, ARM_NO_SETPOINTS = range(32, 37)
ARM_SETPOINT_FAR, ARM_LINK_FAULT, ARM_FOREIGN_VEHICLE = 37, 41, 42
FLOWN, NOT_ARMED, STALE, SEQUENCE, LIMITS, UNSUPPORTED, OVERRULED = range(7)  # AckResult
CRC8_TABLE = list(range(256))
for _ in range(8):
    CRC8_TABLE = [(entry << 1) ^ (0x12F if entry & 0x80 else 0) for entry in CRC8_TABLE]


def crc8h2f(data: bytes) -> int:
    value = 0xFF
    for byte in data:
        value = CRC8_TABLE[value ^ byte]
    return value ^ 0xFF


def crc32c(data: bytes) -> int:
    value = 0xFFFFFFFF
    for bit in (byte >> shift & 1 for byte in data for shift in range(8)):
        value = (value >> 1) ^ (0x82F63B78 if (value ^ bit) & 1 else 0)
    return value ^ 0xFFFFFFFF


def token_of(nonce: int, session: int) -> int:
    return crc32c(struct.pack("<HH", nonce, session) + b"ARM1")


def clock() -> int:
    return time.monotonic_ns() // 1000


def u24(value: int) -> bytes:
    return (value & 0xFFFFFF).to_bytes(3, "little")


def i16(values: list[float], scale: float) -> bytes:
    return struct.pack("<3h", *(max(-32767, min(32767, round(v / scale))) for v in values))


class Link:
    def __init__(self, interface: str) -> None:
        self.socket = socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW)
        self.socket.bind((interface,))
        self.socket.setblocking(False)
        self.counters: dict[str, int] = {}
        self.last: dict[str, int] = {}
        self.resync: dict[str, int] = {}  # frames still to be dropped after a wrong sequence
        self.sets: dict[int, tuple[int, dict[str, bytes]]] = {}
        self.good = self.bad = self.lost = self.torn = self.errors = 0

    def send(self, name: str, code: int, payload: bytes) -> None:
        self.counters[name] = (self.counters.get(name, -1) + 1) % 16
        body = bytes([code << 4 | self.counters[name]]) + payload
        crc = crc8h2f(body + bytes([MESSAGES[name][1]]))
        for _ in range(20):
            try:
                self.socket.send(struct.pack("=IB3xB7s", MESSAGES[name][0], 8, crc, body))
                return
            except OSError:
                time.sleep(0.0002)  # the interface's queue is full

    def check(self, name: str, data: bytes) -> bool:
        right = len(data) == 8 and crc8h2f(data[1:] + bytes([MESSAGES[name][1]])) == data[0]
        ahead = (data[1] - self.last.get(name, data[1] - 1)) % 16 if right else 0
        self.bad += not right
        if right:
            self.last[name] = data[1] & 15
        if not 1 <= ahead <= 3:
            self.resync[name] = 2 if ahead else self.resync.get(name, 0)
            self.errors = min(10, self.errors + 1)
            return False
        self.good, self.lost = self.good + 1, self.lost + ahead - 1
        self.errors = max(0, self.errors - 1)
        self.resync[name] = max(-1, self.resync.get(name, 0) - 1)
        return self.resync[name] < 0

    def collect(self, name: str, data: bytes, now: int) -> dict[str, bytes]:
        begin, parts = self.sets.pop(data[1] & 15, (now, {}))
        if now - begin > 20000:
            begin, parts, self.torn = now, {}, self.torn + 1
        parts[name] = data
        if len(parts) < 5:
            self.sets[data[1] & 15] = begin, parts
        return parts


class Setpoint:
    def __init__(self, parts: dict[str, bytes], now: int) -> None:
        xy, z, commit = parts["SP_POS_XY"], parts["SP_POS_Z"], parts["SP_COMMIT"]
        codes = [int.from_bytes(part, "little") for part in (xy[2:5], xy[5:], z[2:5])]
        velocity = struct.unpack("<3h", parts["SP_VEL"][2:])
        acceleration = struct.unpack("<3h", parts["SP_ACC"][2:])
        yaw, yaw_rate, mask, self.seq = struct.unpack("<hhBB", commit[2:])
        self.position = [code * 0.001 - 8388.608 for code in codes]
        self.velocity, self.yaw = [code * 0.001 for code in velocity], yaw * 0.0001
        self.acceleration, self.yaw_rate = [code * 0.002 for code in acceleration], yaw_rate * 0.001
        self.age = (now - int.from_bytes(z[5:], "little") + 0x800000) % 0x1000000 - 0x800000
        self.time = now - self.age
        known = 0xFFFFFF not in codes and -32768 not in velocity + acceleration + (yaw, yaw_rate)
        self.supported = known and mask == 31 and xy[1] >> 4 == 0 and commit[1] >> 4 <= 1


class Vehicle:
    def __init__(self, link: Link) -> None:
        self.link, self.begin, self.moved = link, clock(), clock()
        self.state, self.reason, self.nonce, self.arm_seq = DISARMED, POWER_ON, 0, 0
        self.position, self.velocity, self.yaw, self.yaw_rate = [0.0] * 3, [0.0] * 3, 0.0, 0.0
        self.setpoint: Setpoint | None = None
        self.good_at = self.near_since = self.heard_at = self.foreign_at = self.asked_at = -10**10
        self.arms = self.disarms = self.session = self.last_seq = 0  # ARM, DISARM in a row
        self.near, self.host = False, (0, 0)
        self.spent_nonce, self.ended_at = 0, -10**10  # of the last flight
        self.become(DISARMED, POWER_ON)

    def become(self, state: int, reason: int) -> None:
        if state == DISARMED:
            if self.state in (ARMED, HOLD, LAND):
                self.spent_nonce, self.ended_at = self.nonce, clock()
            self.nonce = (self.nonce + random.randint(1, 65535)) % 65536
            self.arms, self.velocity, self.setpoint = 0, [0.0] * 3, None
        self.state, self.reason = state, reason
        print(f"{(clock() - self.begin) * 1e-6:.3f} s: state {state}, reason {reason}", flush=True)

    def frame(self, identifier: int, data: bytes, now: int) -> None:
        name = NAMES.get(identifier, "")
        if name and name not in FROM_HOST:
            self.foreign_at = now
        elif not name or not self.link.check(name, data):
            return
        elif name in SETPOINT:
            parts = self.link.collect(name, data, now)
            if len(parts) == 5:
                self.answer(Setpoint(parts, now), now)
        elif name == "PING":
            delay = struct.pack("<H", min(65535, clock() - now))
            self.link.send("PONG", 0, data[2:3] + u24(now) + delay)
        elif name == "HOST_HB":
            self.heard_at, self.host = now, struct.unpack("<BxH", data[2:6])
        elif name == "ARM_CMD":
            self.arm_command(data[1] >> 4, *struct.unpack("<IH", data[2:]), now)
        elif name == "KILL" and data[2:6] == KILL_MAGIC and self.state != KILLED:
            self.become(KILLED, KILL)

    def answer(self, setpoint: Setpoint, now: int) -> None:
        result = self.judge(setpoint, now)
        if result in (FLOWN, NOT_ARMED):
            self.near = math.dist(setpoint.position, self.position) <= 1.0
            if now - self.good_at > 250000 or not self.near:
                self.near_since = now
            self.good_at, self.last_seq = now, setpoint.seq
        if result == FLOWN:
            self.setpoint = setpoint
            if self.state == HOLD:
                self.become(ARMED, NONE)
        self.link.send("SP_ACK", result, bytes([setpoint.seq]) + u24(now)
                       + struct.pack("<H", max(0, min(65535, setpoint.age))))

    def judge(self, setpoint: Setpoint, now: int) -> int:
        for result, applies in (
                (UNSUPPORTED, not setpoint.supported),
                (STALE, not -20000 <= setpoint.age <= 100000),
                (SEQUENCE, now - self.good_at <= 250000
                 and not 1 <= (setpoint.seq - self.last_seq) % 256 <= 127),
                (LIMITS, math.hypot(*setpoint.velocity) > 12.0
                 or math.hypot(*setpoint.acceleration) > 20.0
                 or math.dist(setpoint.position, self.position) > (3.0, 1.0)[self.state == HOLD]),
                (NOT_ARMED, self.state in (DISARMED, ARMING)),
                (OVERRULED, self.state in (LAND, KILLED) or self.link.errors >= 5)):
            if applies:
                return result
        return FLOWN

    def arm_command(self, request: int, token: int, session: int, now: int) -> None:
        if now - self.ended_at < 500000 and token == token_of(self.spent_nonce, session):
            return  # the host has not heard yet that the flight is over
        row = self.arms if session == self.session and now - self.asked_at < 500000 else 0
        right = token == token_of(self.nonce, session)
        self.arms = row + 1 if request == 1 and right else 0
        self.disarms = self.disarms + 1 if request == 0 else 0
        self.session, self.asked_at = session, now
        if request == 0 and self.state == ARMING:
            self.become(DISARMED, NONE)
        elif self.disarms >= 3 and self.state in (ARMED, HOLD):
            self.become(LAND if self.position[2] > 0.0 else DISARMED, HOST_REQUEST)
        elif request == 1 and self.state in (DISARMED, ARMING):
            missing = self.missing(now) if right else ARM_TOKEN
            if missing == NONE and self.arms >= 3:
                self.arm_seq = (self.arm_seq + 1) % 256
                self.become(ARMED, NONE)
            elif (self.state, self.reason) != (ARMING, missing):
                self.become(ARMING, missing)

    def missing(self, now: int) -> int:
        for reason, missing in (
                (ARM_NO_HEARTBEAT, now - self.heard_at > 1000000),
                (ARM_VERSION, self.host[0] != 1), (ARM_DBC_HASH, self.host[1] != DBC_HASH),
                (ARM_SETPOINT_FAR, not self.near and now - self.good_at < 250000),
                (ARM_NO_SETPOINTS, not self.setpoints_come(now)),
                (ARM_LINK_FAULT, self.link.errors >= 5),
                (ARM_FOREIGN_VEHICLE, now - self.foreign_at < 1000000)):
            if missing:
                return reason
        return NONE

    def setpoints_come(self, now: int) -> bool:
        return now - self.good_at <= 250000 and self.near and now - self.near_since >= 500000

    def step(self, now: int) -> None:
        silence, dt, self.moved = now - self.good_at, (now - self.moved) * 1e-6, now
        if self.state == ARMING and now - self.asked_at > 500000:
            self.become(DISARMED, NONE)
        elif self.state in (ARMED, HOLD):
            if now - self.foreign_at < 1000000:
                self.become(LAND, FOREIGN_VEHICLE)
            elif now - self.heard_at > 1000000 or silence > 1000000:
                self.become(LAND, SETPOINT_SILENCE if silence > 1000000 else HOST_SILENCE)
            elif self.state == ARMED and (silence > 250000 or self.link.errors >= 5):
                self.become(HOLD, SETPOINT_SILENCE if silence > 250000 else LINK_FAULT)
        self.move(now, dt)
        if self.state == LAND and self.position[2] <= 0.0:
            self.become(DISARMED, LANDED)

    def move(self, now: int, dt: float) -> None:
        if self.state == ARMED and self.setpoint:
            goal, dt = self.setpoint, (now - self.setpoint.time) * 1e-6
            bend = min(0.05, dt)
            self.velocity = [v + a * bend for v, a in zip(goal.velocity, goal.acceleration)]
            self.position = [p + v * dt + a * bend * (dt - bend / 2) for p, v, a in
                             zip(goal.position, goal.velocity, goal.acceleration)]
            self.yaw = math.remainder(goal.yaw + goal.yaw_rate * dt, 2 * math.pi)
            self.yaw_rate = goal.yaw_rate
        elif self.state in (HOLD, LAND):
            left = max(0.0, 1.0 - 3.0 * dt / max(1e-9, math.hypot(*self.velocity)))
            self.velocity = [v * left for v in self.velocity]
            if self.state == LAND:
                self.velocity[2] = -0.4
            self.position = [p + v * dt for p, v in zip(self.position, self.velocity)]
            self.yaw_rate = 0.0
        self.position[2] = max(0.0, self.position[2])

    def telemetry(self, tick: int, now: int) -> None:
        link = self.link
        x, y, z = (u24(round((value + 8388.608) * 1000)) for value in self.position)
        link.send("ODO_POS_XY", 0, x + y)
        link.send("ODO_POS_Z", 0, z + u24(self.moved))
        link.send("ODO_VEL", 0, i16(self.velocity, 0.001))
        link.send("ODO_ATT", 0, i16([0.0, 0.0, self.yaw], 0.0001))
        link.send("ODO_RATE", 1, i16([0.0, 0.0, self.yaw_rate], 0.001))
        link.send("ESC_RPM", 15, b"\xFF" * 6)  # of what it does not have, nothing is known
        if tick % 2 == 0:
            flags = ((now - self.good_at > 50000) << 0 | self.setpoints_come(now) << 1
                     | (now - self.heard_at < 1000000) << 2 | (link.errors >= 5) << 7
                     | (self.position[2] <= 0.0) << 8 | (now - self.foreign_at < 1000000) << 10)
            link.send("VEH_STATE", self.state, struct.pack("<HBBH", flags, self.reason,
                                                           self.arm_seq, self.nonce))
        if tick % 10 < 4:
            link.send(f"ESC_STAT{tick % 10}", tick % 10, b"\xFF\xFF\x00\x80\x80\x00")
        elif tick % 10 == 5:
            uptime = (now - self.begin) // 1000000 & 0xFFFF
            link.send("VEH_HB", 0, struct.pack("<BBHH", 1, 0, DBC_HASH, uptime))
        elif tick % 20 == 7:
            link.send("BATTERY", 0, b"\xFF\xFF\x00\x80\xFF\xFF")
        elif tick % 100 == 9:
            counts = (min(255, count) for count in (link.bad, link.lost, link.torn, 0))
            link.send("VEH_LINK", 0, struct.pack("<H4B", link.good & 0xFFFF, *counts))

    def run(self) -> None:
        tick, due, can = 0, clock(), self.link.socket
        while True:
            now = clock()
            if now >= due:  # first of all: who only listens is silent
                self.step(now)
                self.telemetry(tick, now)
                tick, due = tick + 1, max(due + 10000, now + 5000)
            elif select.select([can], [], [], (due - now) * 1e-6)[0]:
                now = clock()
                with contextlib.suppress(BlockingIOError):
                    for _ in range(20):
                        identifier, length, data = struct.unpack("=IB3x8s", can.recv(16))
                        self.frame(identifier, data[:length], now)


def main() -> int:
    interface = (sys.argv[1:] or ["vcan0"])[0]
    if interface in ("-h", "--help"):
        print(__doc__)
        return 0
    try:
        Vehicle(Link(interface)).run()
    except KeyboardInterrupt:
        return 0
    except OSError as error:
        print(f"minimal_vehicle.py: {interface}: {error.strerror}", file=sys.stderr)
        return 1


if __name__ == "__main__":
    sys.exit(main())
