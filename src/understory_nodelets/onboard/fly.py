#!/usr/bin/python3
# Copyright 2026 the Understory authors
# SPDX-License-Identifier: BSD-3-Clause
"""Flies a mission in real time: a CAN bus, a vehicle on it, a ROS master, the onboard process with
its live line, the report.

Without --bus it runs itself again with a bus of its own (hil/provider), one for each vehicle.
Exit status: that of the onboard process (0 completed without collision, 1 not so, 2 wrong use).
"""

import argparse
import os
import re
import signal
import socket
import subprocess
import sys
import time
import xmlrpc.client
from pathlib import Path
from typing import List, NoReturn, Optional

import fly_team

DEFAULT_PORT = 11311
MASTER_PATIENCE_S = 20.0
STOP_PATIENCE_S = 30.0
VEHICLE_PATIENCE_S = 1.0  # to find fault with its options and its bus
MEMORY = "memory"
OWN_BUS = "vcan0"
NATIVE = "native"  # the bus provider that boots no kernel
# A booted kernel has one processor: more than these do not fly there, nor two at the full rates.
MOST_IN_KERNEL = 2
KERNEL_BUS_HZ, KERNEL_CAMERA_HZ = 40.0, 5.0
# Two decide at once there: what is decided late must still be in time.
KERNEL_LEAD = "replan: {lead_s: 0.5}"
MOST_VEHICLES = 10  # that find each other on one machine
PROVIDER = Path(__file__).resolve().parents[3] / "hil/provider/hil.py"
PASSED_ON = ("forest", "crop", "strategy", "speed-cap", "resume")


class FlyError(Exception):
    pass


def parse_arguments(words: List[str]) -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog="understory fly",
        description="Flies one mission in real time: the onboard pipeline in one process, with a "
        "simulated camera, over a real CAN bus to a vehicle stand-in, and a ROS master of its own.",
        epilog="While it flies, rostopic, rosbag, rviz and the services see it: set ROS_MASTER_URI "
        "as printed. Ctrl-C brings the vehicle to rest; results are written.",
    )
    parser.add_argument("--scenario", default="small", help="name in config/scenarios, or a file")
    parser.add_argument("--seed", type=int, default=1, help="of everything random (default: 1)")
    parser.add_argument("--out", help="result folder (default: results/SCENARIO_SEED_onboard)")
    parser.add_argument("--camera-size", help="WxH of the simulated camera, in pixels")
    parser.add_argument("--camera-rate", type=float, metavar="HZ", help="of the simulated camera")
    parser.add_argument("--overrides", default="", help="YAML over the scenario's keys")
    parser.add_argument(
        "--team", type=int, default=1, metavar="N",
        help="N vehicles, each with a process, a ROS master and a bus of its own; results in "
        "vehicle_0, vehicle_1, ... of the result folder",
    )
    parser.add_argument(
        "--kill", action="append", default=[], metavar="ID@SECONDS",
        help="with --team: this vehicle is lost then, with its onboard process",
    )
    parser.add_argument("--master", help="URI of a running ROS master instead of an own one")
    parser.add_argument(
        "--bus",
        help="CAN interface to use as it is; memory: no CAN, a vehicle within the process "
        "(default: vcan0 on a bus of its own, as `understory hil` makes it)",
    )
    parser.add_argument(
        "--bus-rate", type=float, metavar="HZ",
        help="of setpoints and odometry on the bus (default: 100)",
    )
    parser.add_argument("--no-vehicle", action="store_true", help="there is one on the bus already")
    parser.add_argument("--no-bus-log", action="store_true", help="no bus.log in the result folder")
    parser.add_argument(
        "--fault", action="append", default=[], metavar="SECONDS:COMMAND",
        help="of the vehicle, counted from arming: freeze, resume, restart, lose_sensors, "
        "drain PERCENT, fail_esc N",
    )
    parser.add_argument("--onboard", help=argparse.SUPPRESS)  # the programs, set by `understory`
    parser.add_argument("--vehicle", help=argparse.SUPPRESS)
    parser.add_argument("--quiet", action="store_true", help="no live line")
    parser.add_argument("--no-report", action="store_true", help="no figures, no latency table")
    parser.add_argument("--forest", help="stem map (CSV) instead of the scenario's forest")
    parser.add_argument("--crop", help="X0,Y0,W,H: the piece of the stem map to fly, metres")
    parser.add_argument("--strategy", help="how targets are chosen")
    parser.add_argument("--speed-cap", help="paper or strict")
    parser.add_argument("--resume", help="go on from a saved map (.ot, .bt)")
    parser.add_argument("--onboard-overrides", help="YAML over config/onboard.yaml")
    return parser.parse_args(words)


def camera_override(arguments: argparse.Namespace) -> str:
    keys = []
    size = arguments.camera_size
    if size:
        match = re.fullmatch(r"(\d+)x(\d+)", size)
        if not match:
            raise FlyError(f"--camera-size {size}: expected WIDTHxHEIGHT, such as 640x480")
        keys = [f"width_px: {match[1]}", f"height_px: {match[2]}"]
    if arguments.camera_rate is not None:
        keys.append(f"rate_hz: {arguments.camera_rate}")
    return f"camera: {{{', '.join(keys)}}}\n" if keys else ""


def is_master(uri: str) -> bool:
    try:
        code, _, _ = xmlrpc.client.ServerProxy(uri).getPid("/understory_fly")
        return code == 1
    except (OSError, ValueError, xmlrpc.client.Error):
        return False


def free_port() -> int:
    for wanted in (DEFAULT_PORT, 0):
        with socket.socket() as probe:
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            try:
                probe.bind(("", wanted))
                return probe.getsockname()[1]
            except OSError:
                continue
    raise FlyError("no free TCP port for a ROS master")


def start_master(log_path: Path) -> "tuple[subprocess.Popen, str]":
    """An own ROS master, in a session of its own: Ctrl-C is for the flight, not for it."""
    port = free_port()
    # By address: a machine need not know its own name, or localhost.
    environment = {"ROS_IP": "127.0.0.1", **os.environ}
    with open(log_path, "w", encoding="utf-8") as log:
        try:
            process = subprocess.Popen(
                ["rosmaster", "--core", "-p", str(port)],
                env=environment,
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=log,
                start_new_session=True,
            )
        except FileNotFoundError as error:
            raise FlyError("rosmaster: not found (./understory setup installs it)") from error
    uri = f"http://127.0.0.1:{port}"
    until = time.monotonic() + MASTER_PATIENCE_S
    while not is_master(uri):
        if process.poll() is not None or time.monotonic() > until:
            stop(process)
            raise FlyError(f"the ROS master did not start, see {log_path}")
        time.sleep(0.05)
    return process, uri


def start_vehicle(arguments: argparse.Namespace, folder: Path) -> subprocess.Popen:
    """The stand-in, in a session of its own: it outlives the flight it is for."""
    command = [arguments.vehicle or "understory_vehicle", "--interface", arguments.bus]
    command += ["--scenario", arguments.scenario, "--seed", str(arguments.seed)]
    command += ["--overrides", arguments.overrides] if arguments.overrides else []
    command += ["--forest", str(Path(arguments.forest).resolve())] if arguments.forest else []
    command += ["--crop", arguments.crop] if arguments.crop else []
    command += ["--rate", str(arguments.bus_rate)] if arguments.bus_rate is not None else []
    for fault in arguments.fault:
        command += ["--fault", fault]
    log_path = folder / "vehicle.log"
    with open(log_path, "w", encoding="utf-8") as log:
        try:
            process = subprocess.Popen(
                command,
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=subprocess.STDOUT,
                start_new_session=True,
            )
        except FileNotFoundError as error:
            raise FlyError(f"{command[0]}: not found (./understory build makes it)") from error
    try:
        process.wait(VEHICLE_PATIENCE_S)
    except subprocess.TimeoutExpired:
        return process
    said = log_path.read_text(encoding="utf-8").strip().splitlines()
    raise FlyError(said[-1] if said else f"the vehicle ended with {process.returncode}")


def bus_override(arguments: argparse.Namespace, folder: Path) -> str:
    if arguments.bus == MEMORY:
        return ""
    log = "" if arguments.no_bus_log else f", log_file: '{folder / 'bus.log'}'"
    rate = "" if arguments.bus_rate is None else f"flight: {{rate_hz: {arguments.bus_rate}}}\n"
    return f"bus: {{interface: {arguments.bus}{log}}}\n{rate}"


def with_own_bus(words: List[str], buses: int) -> NoReturn:
    """Once more, where there is a CAN bus."""
    command = ["/usr/bin/python3", "-B", str(PROVIDER), "--interfaces", str(buses), "--"]
    command += ["/usr/bin/python3", str(Path(__file__).resolve()), "--bus", OWN_BUS, *words]
    os.execv(command[0], command)


def quickest_provider() -> str:
    """The one that will be taken; empty if none works here."""
    outcome = subprocess.run(
        ["/usr/bin/python3", "-B", str(PROVIDER), "--list"],
        stdin=subprocess.DEVNULL,
        capture_output=True,
        encoding="utf-8",
        check=False,
    )
    lines = [line.split(maxsplit=1) for line in outcome.stdout.splitlines()]
    return next((words[0] for words in lines if words[1:] == ["works"]), "")


def words_for_kernel(arguments: argparse.Namespace) -> List[str]:
    """What to add for a team where a kernel must be booted for its buses. Of more vehicles than fly
    there each is within its process."""
    if arguments.team == 1 or quickest_provider() in ("", NATIVE):
        return []
    begin = "understory fly: this kernel has no CAN"
    if arguments.team > MOST_IN_KERNEL:
        print(f"{begin}, and a booted one has no time for {arguments.team}: --bus memory", file=sys.stderr)
        arguments.bus = MEMORY
        return []
    words = []
    if arguments.bus_rate is None:
        words += ["--bus-rate", f"{KERNEL_BUS_HZ:g}"]
    if arguments.camera_rate is None and "camera:" not in arguments.overrides:
        words += ["--camera-rate", f"{KERNEL_CAMERA_HZ:g}"]
    if "replan:" not in arguments.overrides:
        words += ["--overrides", "\n".join(filter(None, [arguments.overrides, KERNEL_LEAD]))]
    print(f"{begin}: both in a booted one, {' '.join(words)}", file=sys.stderr)
    return words


def stop(process: subprocess.Popen) -> None:
    if process.poll() is None:
        process.terminate()
        try:
            process.wait(5)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()


def onboard_command(arguments: argparse.Namespace, folder: Path) -> List[str]:
    command = [arguments.onboard or "onboard", "--scenario", arguments.scenario]
    command += ["--seed", str(arguments.seed), "--result-folder", str(folder)]
    overrides = camera_override(arguments) + arguments.overrides
    command += ["--overrides", overrides] if overrides else []
    onboard = bus_override(arguments, folder) + (arguments.onboard_overrides or "")
    command += ["--onboard-overrides", onboard] if onboard else []
    for name in PASSED_ON:
        value = getattr(arguments, name.replace("-", "_"))
        if value is not None:
            is_file = name in ("forest", "resume")
            command += [f"--{name}", str(Path(value).resolve()) if is_file else value]
    return command + ([] if arguments.quiet else ["--live"])


def run_onboard(command: List[str], uri: str, master: Optional[subprocess.Popen]) -> int:
    """Until it ends; interrupts are passed on, so that the vehicle comes to rest first."""
    environment = {**os.environ, "ROS_MASTER_URI": uri}
    environment.setdefault("ROS_IP", "127.0.0.1")
    environment.setdefault("ROSCONSOLE_FORMAT", "${message}")
    process = subprocess.Popen(
        command, env=environment, stdin=subprocess.DEVNULL, start_new_session=True
    )

    def pass_on(number, _frame):
        process.send_signal(number)

    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, pass_on)
    has_master = master is not None
    while process.poll() is None:
        time.sleep(0.1)
        if has_master and master.poll() is not None:
            has_master = False
            print("\nthe ROS master has died; the flight goes on without it", file=sys.stderr)
    return process.returncode


def report(folder: Path) -> bool:
    """Figures, report.html and the latency table; says where they are."""
    sources = Path(__file__).resolve().parents[2]
    scripts = [
        [sources / "understory_nodelets/latency/latency.py", folder],
        [sources / "understory_sim/report/report.py", folder],
    ]
    good = True
    for script in scripts:
        outcome = subprocess.run(["/usr/bin/python3", *map(str, script)], check=False)
        good = good and outcome.returncode == 0
    if (folder / "bus.log").exists():
        print(f"bus: {folder / 'bus.log'} (./understory log FILE says what was on it)")
    return good


def check_team(arguments: argparse.Namespace) -> None:
    if not 1 <= arguments.team <= MOST_VEHICLES:
        raise FlyError(f"--team {arguments.team}: must be 1 to {MOST_VEHICLES}")
    if arguments.team == 1 and arguments.kill:
        raise FlyError("--kill: needs --team")
    is_bus_taken = arguments.bus not in (None, MEMORY, OWN_BUS)
    if arguments.team > 1 and (arguments.master or arguments.no_vehicle or is_bus_taken):
        raise FlyError("--team: not with --master, --no-vehicle or a bus of yours")
    try:
        for text in arguments.kill:
            fly_team.parse_kill(text, arguments.team)
    except ValueError as error:
        raise FlyError(str(error)) from error


def fly(arguments: argparse.Namespace) -> int:
    team = f"_team{arguments.team}" if arguments.team > 1 else ""
    name = f"{Path(arguments.scenario).stem}_{arguments.seed}{team}_onboard"
    folder = Path(arguments.out or Path("results") / name).resolve()
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise FlyError(f"{folder}: cannot be made: {error.strerror}") from error
    if arguments.team > 1:
        return fly_team.fly_team(arguments, folder, sys.modules[__name__])
    command = onboard_command(arguments, folder)
    master, uri = None, arguments.master or os.environ.get("ROS_MASTER_URI", "")
    if arguments.master and not is_master(arguments.master):
        raise FlyError(f"--master {arguments.master}: no ROS master answers there")
    if not uri or not is_master(uri):
        master, uri = start_master(folder / "master.log")
    print(f"export ROS_MASTER_URI={uri}", flush=True)
    vehicle = None
    try:
        if arguments.bus != MEMORY and not arguments.no_vehicle:
            vehicle = start_vehicle(arguments, folder)
        status = run_onboard(command, uri, master)
    finally:
        for process in (vehicle, master):
            if process is not None:
                stop(process)
    if status < 0:
        raise FlyError(f"the onboard process was killed by signal {-status}")
    if status == 2 or arguments.no_report or not (folder / "result.json").exists():
        return status
    return status if report(folder) else max(status, 1)


def main() -> int:
    arguments = parse_arguments(sys.argv[1:])
    try:
        check_team(arguments)
        if arguments.bus is None:
            words = words_for_kernel(arguments)
        if arguments.bus is None:
            with_own_bus([*sys.argv[1:], *words], arguments.team)
        return fly(arguments)
    except FlyError as error:
        print(f"understory fly: {error}", file=sys.stderr)
        return 2


if __name__ == "__main__":
    sys.exit(main())
