#!/usr/bin/python3
# Copyright 2026 the Understory authors
# SPDX-License-Identifier: BSD-3-Clause
"""A wire between two CAN interfaces that can be made faulty: the host is at one end, the vehicle at
the other. A process of its own, because one that decodes and waits would be late.

usage: faulty_wire.py HOST_INTERFACE VEHICLE_INTERFACE [SEED]
Each line on standard input is a JSON object, the faults from then on; {} is a good wire:
  "to": "vehicle", "host" or "both" (default): in which direction
  "loss", "duplicate", "reorder", "corrupt": probability for each frame
  "drop": [name of a message...], or "all"
  "rewrite": {message: {signal: number added to its code}}, with a right checksum
  "set": {message: {signal: code}}, likewise
Answers each line, and its end, with the counts so far.
"""

import contextlib
import json
import os
import random
import select
import socket
import sys
from collections import Counter
from typing import Any, Dict, List, Tuple

import bench
from can_tools import FRAME

REAL_TIME_PRIORITY = 50  # under vehicle and host
BUFFER_FORCE = 33  # SO_RCVBUFFORCE
AT_ONCE = 8  # frames are passed on before the other end has its turn: most come in fives
HELD_BACK = 3  # a reordered frame lets so many others pass


class Wire:
    def __init__(self, host: str, vehicle: str, seed: int) -> None:
        self._ends = [self._open(host), self._open(vehicle)]
        self._chance = random.Random(seed)
        self._faults: Dict[str, Any] = {}
        self._held: Tuple[List[Tuple[int, bytes]], ...] = ([], [])
        self.counts: "Counter[str]" = Counter()

    @staticmethod
    def _open(name: str) -> socket.socket:
        end = socket.socket(socket.PF_CAN, socket.SOCK_RAW, socket.CAN_RAW)
        end.setsockopt(socket.SOL_SOCKET, BUFFER_FORCE, 4 << 20)
        end.bind((name,))
        return end

    def obey(self, text: str) -> None:
        self._faults = json.loads(text)

    def run(self) -> None:
        host, vehicle = self._ends
        while True:
            for ready in select.select([host, vehicle, sys.stdin], [], [])[0]:
                if ready is sys.stdin:
                    line = sys.stdin.readline()
                    if not line:
                        return
                    self.obey(line)
                    print(json.dumps(self.counts), flush=True)
                else:
                    self._forward(0 if ready is host else 1)

    def _forward(self, source: int) -> None:
        receive, send = self._ends[source].recv, self._ends[1 - source].send
        is_hit = self._faults.get("to", "both") in ("both", ("vehicle", "host")[source])
        # Nothing more is there; or an interface went down, and what was on it is lost.
        with contextlib.suppress(OSError):
            for _ in range(AT_ONCE):
                data = receive(FRAME.size, socket.MSG_DONTWAIT)
                self.counts["frames"] += 1
                for frame in self._suffer(source, data) if is_hit else [data]:
                    send(frame)

    def _happens(self, fault: str) -> bool:
        rate = self._faults.get(fault, 0.0)
        is_hit = rate > 0.0 and self._chance.random() < rate
        self.counts[fault] += is_hit
        return is_hit

    def _suffer(self, source: int, data: bytes) -> List[bytes]:
        """What comes out at the other end now."""
        drop = self._faults.get("drop", ())
        if drop:
            message = bench.BY_ID.get(FRAME.unpack(data)[0])
            if drop == "all" or (message is not None and message.dbc_name in drop):
                self.counts["drop"] += 1
                return []
        if self._happens("loss"):
            return []
        if "rewrite" in self._faults or "set" in self._faults:
            data = self._rewritten(data)
        if self._happens("corrupt"):
            data = self._corrupted(data)
        out = [data, data] if self._happens("duplicate") else [data]
        held = self._held[source]
        if self._happens("reorder"):
            held.append((HELD_BACK, data))
            out = out[1:]
        late = [frame for left, frame in held if left <= 0]
        held[:] = [(left - 1, frame) for left, frame in held if left > 0]
        return out + late

    def _corrupted(self, data: bytes) -> bytes:
        at = self._chance.randrange(8, 16)  # the payload
        return data[:at] + bytes([data[at] ^ self._chance.randrange(1, 256)]) + data[at + 1 :]

    def _rewritten(self, data: bytes) -> bytes:
        number, length, payload = FRAME.unpack(data)
        message = bench.BY_ID.get(number)
        if message is None:
            return data
        added = self._faults.get("rewrite", {}).get(message.dbc_name, {})
        fixed = self._faults.get("set", {}).get(message.dbc_name, {})
        if not added and not fixed:
            return data
        word = int.from_bytes(payload, "little")
        raws = []
        for signal in message.signals:
            raw = (word >> signal.start) & ((1 << signal.size) - 1)
            raws.append(fixed.get(signal.dbc_name, raw + added.get(signal.dbc_name, 0)))
        self.counts["rewrite"] += 1
        return FRAME.pack(number, length, bench.dbc.frame_bytes(message, raws, payload[1] & 0xF))


def main(words: List[str]) -> None:
    with contextlib.suppress(PermissionError):
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(REAL_TIME_PRIORITY))
    wire = Wire(words[0], words[1], int(words[2]) if len(words) > 2 else 1)
    print(json.dumps(wire.counts), flush=True)
    wire.run()
    print(json.dumps(wire.counts), flush=True)


if __name__ == "__main__":
    main(sys.argv[1:])
