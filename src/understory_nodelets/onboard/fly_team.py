# Copyright 2026 the Understory authors
# SPDX-License-Identifier: BSD-3-Clause
"""A team in real time on one machine: for each vehicle a ROS master, an onboard process and, on a
bus of its own, a vehicle; between them DDS on the loopback interface.
"""

import argparse
import bisect
import copy
import csv
import json
import math
import os
import re
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path
from typing import Dict, List, Optional, Sequence, Tuple

SHOW_S = 1.0
LEFT_BEHIND_S = 45.0  # after an interrupt; then what still runs is killed
DDS_PORT = 7400  # of domain 0; each further domain is DDS_PORTS higher
DDS_PORTS = 250
DDS_DOMAINS = 100
DDS_INDICES = 10
Kill = Tuple[int, float]
Track = List[Tuple[float, float, float, float]]  # seconds since 1970, metres


def parse_kill(text: str, size: int) -> Kill:
    match = re.fullmatch(r"(\d+)@(\d+(?:\.\d+)?)", text)
    if not match or int(match[1]) >= size:
        raise ValueError(f"--kill {text}: expected ID@SECONDS, ID less than {size}")
    return int(match[1]), float(match[2])


def is_free(port: int) -> bool:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.bind(("", port))
            return True
        except OSError:
            return False


def free_domain() -> int:
    """One whose ports nobody has: vehicles find each other by port."""
    for domain in range(1, DDS_DOMAINS):
        base = DDS_PORT + DDS_PORTS * domain
        if all(is_free(base + 10 + 2 * index) for index in range(DDS_INDICES)):
            return domain
    raise OSError("no free DDS domain")


def read_ticks(folder: Path) -> List[Dict[str, str]]:
    """The last may be half written."""
    try:
        with open(folder / "ticks.csv", encoding="utf-8", newline="") as file:
            return [row for row in csv.DictReader(file) if row.get("clearance_m") is not None]
    except OSError:
        return []


def last_tick(folder: Path) -> Optional[Dict[str, str]]:
    """Without reading all of it."""
    try:
        with open(folder / "ticks.csv", "rb") as file:
            names = file.readline().decode().strip().split(",")
            size = file.seek(0, os.SEEK_END)
            file.seek(max(0, size - 4096))
            lines = file.read().decode(errors="replace").split("\n")[:-1]
    except OSError:
        return None
    words = lines[-1].split(",") if lines else []
    is_row = len(words) == len(names) and words[0] != names[0]
    return dict(zip(names, words)) if is_row else None


class Mate:
    """A vehicle of the team: its processes and what it leaves behind."""

    def __init__(self, number: int, folder: Path) -> None:
        self.number = number
        self.folder = folder
        self.uri = ""
        self.onboard: Optional[subprocess.Popen] = None
        self.helpers: List[subprocess.Popen] = []  # its vehicle, its master
        self.is_killed = False

    def is_running(self) -> bool:
        return self.onboard is not None and self.onboard.poll() is None

    def time_s(self) -> float:
        tick = last_tick(self.folder)
        return float(tick["time_s"]) if tick else 0.0

    def shown(self) -> str:
        tick = last_tick(self.folder)
        if self.is_killed:
            return f"{self.number}: killed"
        if tick is None:
            return f"{self.number}: starting"
        covered = f" {100 * float(tick['coverage']):5.1f} %" if tick["coverage"] else ""
        state = tick["mission_state"] if self.is_running() else "done"
        speed = f"{float(tick['speed_mps']):3.1f} m/s"
        return f"{self.number}: {float(tick['time_s']):5.1f} s{covered} {speed} {state:<11}"

    def kill(self) -> None:
        """As if its battery had come off: nothing of it says another word."""
        self.is_killed = True
        for process in [self.onboard, *self.helpers]:
            if process is not None and process.poll() is None:
                process.kill()
                process.wait()

    def said(self) -> str:
        """What the onboard process made of the flight."""
        lines = (self.folder / "onboard.log").read_text(encoding="utf-8", errors="replace")
        found = [line for line in lines.splitlines() if re.match(r"(NOT )?completed after", line)]
        return found[-1] if found else (lines.strip().splitlines() or ["said nothing"])[-1]

    def started_at_s(self) -> Optional[float]:
        try:
            text = (self.folder / "start.json").read_text(encoding="utf-8")
            return json.loads(text)["started_at_s"]
        except (OSError, ValueError, KeyError):
            return None

    def track(self) -> Optional[Track]:
        start_s = self.started_at_s()
        ticks = read_ticks(self.folder)
        if start_s is None or not ticks:
            return None
        return [
            (start_s + float(tick["time_s"]), *(float(tick[name]) for name in ("x_m", "y_m", "z_m")))
            for tick in ticks
        ]

    def completed_at_s(self) -> Optional[float]:
        """Since 1970."""
        start_s = self.started_at_s()
        try:
            result = json.loads((self.folder / "result.json").read_text(encoding="utf-8"))
        except (OSError, ValueError):
            return None
        taken_s = result.get("completion_time_s")
        return None if start_s is None or taken_s is None else start_s + taken_s


def position_at(track: Track, times: List[float], time_s: float) -> List[float]:
    """`times` are the track's. Before its first and after its last word it is where it was then."""
    after = bisect.bisect_left(times, time_s)
    if after == 0 or after == len(times):
        return list(track[min(after, len(times) - 1)][1:])
    begin, end = track[after - 1], track[after]
    part = (time_s - begin[0]) / (end[0] - begin[0])
    return [a + part * (b - a) for a, b in zip(begin[1:], end[1:])]


def least_separation_m(tracks: List[Track], lost: Sequence[bool] = ()) -> Optional[float]:
    """On one clock, between any two. Who is lost counts until its last word: where it went from
    there nobody knows, and others take it to have flown its last trajectory to the end."""
    lost = lost or [False] * len(tracks)
    ends = [track[-1][0] if is_lost else math.inf for track, is_lost in zip(tracks, lost)]
    least = None
    clocks = [[row[0] for row in track] for track in tracks]
    for i in range(len(tracks)):
        for j in range(i):
            for time_s in clocks[i] + clocks[j]:
                if time_s > min(ends[i], ends[j]):
                    continue
                apart_m = math.dist(
                    position_at(tracks[i], clocks[i], time_s),
                    position_at(tracks[j], clocks[j], time_s),
                )
                least = apart_m if least is None else min(least, apart_m)
    return least


def overrides_of(arguments: argparse.Namespace, number: int) -> str:
    """What a vehicle is told over the scenario: the user's, and which one of its team it is."""
    import yaml  # pylint: disable=import-outside-toplevel  # --help needs Python alone

    told = yaml.safe_load(arguments.overrides) or {}
    told["team"] = {**told.get("team", {}), "size": arguments.team, "id": number}
    return yaml.safe_dump(told)


class Team:
    def __init__(self, arguments: argparse.Namespace, folder: Path, tools) -> None:
        self.arguments = arguments
        self.tools = tools  # of fly.py: what one vehicle needs
        self.mates = [Mate(number, folder / f"vehicle_{number}") for number in range(arguments.team)]
        self.kills = [parse_kill(text, arguments.team) for text in arguments.kill]
        self.interrupts = 0
        self.interrupted_at = 0.0
        self.dds = (
            f"dds: {{domain: {free_domain()}, team: fly_{os.getpid()}, interface: lo, "
            "multicast: false, peers: '127.0.0.1'}\n"
        )

    def start(self) -> None:
        """What takes the least time of the machine first: so none waits long for another."""
        for mate in self.mates:
            mate.folder.mkdir(parents=True, exist_ok=True)
            for name in ("ticks.csv", "start.json", "result.json"):
                (mate.folder / name).unlink(missing_ok=True)  # of a flight before
        for mate in self.mates:
            master, mate.uri = self.tools.start_master(mate.folder / "master.log")
            mate.helpers.append(master)
            print(f"vehicle {mate.number}: export ROS_MASTER_URI={mate.uri}", flush=True)
        told = [self._arguments_of(mate.number) for mate in self.mates]
        for mate, arguments in zip(self.mates, told):
            if arguments.bus != self.tools.MEMORY:
                mate.helpers.append(self.tools.start_vehicle(arguments, mate.folder))
        for mate, arguments in zip(self.mates, told):
            self._start_onboard(mate, self.tools.onboard_command(arguments, mate.folder))

    def _arguments_of(self, number: int) -> argparse.Namespace:
        arguments = copy.copy(self.arguments)
        arguments.quiet = True
        arguments.overrides = overrides_of(self.arguments, number)
        arguments.onboard_overrides = self.dds + (self.arguments.onboard_overrides or "")
        if arguments.bus != self.tools.MEMORY:
            arguments.bus = f"vcan{number}"
        return arguments

    @staticmethod
    def _start_onboard(mate: Mate, command: List[str]) -> None:
        environment = {**os.environ, "ROS_MASTER_URI": mate.uri}
        environment.setdefault("ROS_IP", "127.0.0.1")
        environment.setdefault("ROSCONSOLE_FORMAT", "${message}")
        with open(mate.folder / "onboard.log", "w", encoding="utf-8") as log:
            mate.onboard = subprocess.Popen(
                command,
                env=environment,
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=subprocess.STDOUT,
                start_new_session=True,
            )

    def on_signal(self, number: int, _frame) -> None:
        self.interrupts += 1
        self.interrupted_at = time.monotonic()
        for mate in self.mates:
            if mate.is_running() and mate.onboard is not None:
                mate.onboard.send_signal(number)

    def fly(self) -> None:
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, self.on_signal)
        shown_at = 0.0
        while any(mate.is_running() for mate in self.mates):
            time.sleep(0.1)
            self._kill_those_due()
            if not self.arguments.quiet and time.monotonic() > shown_at + SHOW_S:
                shown_at = time.monotonic()
                self._show("\r" if sys.stderr.isatty() else "")
            if self.interrupts and time.monotonic() > self.interrupted_at + LEFT_BEHIND_S:
                self.close()
        if not self.arguments.quiet:
            self._show("\r" if sys.stderr.isatty() else "")
            print(file=sys.stderr)

    def _kill_those_due(self) -> None:
        for kill in list(self.kills):
            mate = self.mates[kill[0]]
            if mate.time_s() >= kill[1]:
                self.kills.remove(kill)
                mate.kill()
                print(f"\nvehicle {mate.number} is lost at {mate.time_s():.1f} s", file=sys.stderr)

    def _show(self, begin: str) -> None:
        line = " | ".join(mate.shown() for mate in self.mates)
        print(begin + line, end="" if begin else "\n", file=sys.stderr, flush=True)

    def close(self) -> None:
        for mate in self.mates:
            for process in [mate.onboard, *mate.helpers]:
                if process is not None:
                    self.tools.stop(process)

    def summary(self) -> int:
        """Says what came of it; the exit status of the team."""
        status = 0
        for mate in self.mates:
            if mate.is_killed:
                print(f"vehicle {mate.number}: lost after {mate.time_s():.1f} s")
                continue
            assert mate.onboard is not None
            code = mate.onboard.returncode
            print(f"vehicle {mate.number}: {mate.said()}")
            status = max(status, code if code >= 0 else 1)
        ends = [mate.completed_at_s() for mate in self.mates if not mate.is_killed]
        starts = [mate.started_at_s() for mate in self.mates]
        known = [start for start in starts if start is not None]
        text = "team: NOT completed"
        if ends and all(end is not None for end in ends) and known:
            text = f"team: completed after {max(end for end in ends if end) - min(known):.1f} s"
        flown = [(mate.track(), mate.is_killed) for mate in self.mates]
        tracks = [track for track, _ in flown if track is not None]
        lost = [is_lost for track, is_lost in flown if track is not None]
        least = least_separation_m(tracks, lost)
        print(text + ("" if least is None else f", least separation {least:.2f} m"), flush=True)
        return status


def fly_team(arguments: argparse.Namespace, folder: Path, tools) -> int:
    team = Team(arguments, folder, tools)
    try:
        team.start()
        team.fly()
    finally:
        team.close()
    status = team.summary()
    for mate in team.mates:
        if not arguments.no_report and (mate.folder / "result.json").exists():
            status = status if tools.report(mate.folder) else max(status, 1)
    return status
