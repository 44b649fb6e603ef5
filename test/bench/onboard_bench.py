#!/usr/bin/python3
# Copyright 2026 the Understory authors
# SPDX-License-Identifier: BSD-3-Clause
"""Latency, jitter and CPU time of the onboard host: all nodelets in one process beside the same
nodelets in a process each (TCPROS), one after the other in one run.

usage: onboard_bench.py [--seconds N] [--scenario NAME] [--camera-size WxH] [--out DIR]
After `./understory build`; starts a ROS master of its own.
"""

import argparse
import os
import signal
import subprocess
import sys
import tempfile
import time
import xmlrpc.client
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "src/understory_nodelets/latency"))
sys.path.insert(0, str(ROOT / "src/understory_nodelets/onboard"))
import fly  # noqa: E402
from latency_rows import statistics_of  # noqa: E402
from trace_file import read_trace  # noqa: E402

NODELETS = {
    "recorder": "Recorder",
    "monitor": "Monitor",
    "map_publisher": "MapPublisher",
    "explorer": "Explorer",
    "mapper": "Mapper",
    "depth_cloud": "DepthCloud",
    "sim_camera": "SimCamera",
    "bridge": "Bridge",
}
ROWS = ["cloud_wait", "map_wait", "decision_wait", "exposure_to_map", "exposure_to_trajectory"]
ROWS += ["camera_to_trajectory", "wakeup"]
WARM_UP_S = 8.0


def workspace_environment():
    """What catkin_ws/devel/setup.bash exports."""
    script = f"source '{ROOT}/catkin_ws/devel/setup.bash' && env -0"
    text = subprocess.run(["bash", "-c", script], check=True, stdout=subprocess.PIPE).stdout
    pairs = (entry.split("=", 1) for entry in text.decode().split("\0") if "=" in entry)
    return {**dict(pairs), "UNDERSTORY_ROOT": str(ROOT), "ROS_IP": "127.0.0.1"}


def cpu_s(processes):
    ticks = 0
    for process in processes:
        fields = Path(f"/proc/{process.pid}/stat").read_text().rsplit(")", 1)[1].split()
        ticks += int(fields[11]) + int(fields[12])
    return ticks / os.sysconf("SC_CLK_TCK")


def commands(kind, options, folder):
    program = ROOT / "catkin_ws/devel/lib/understory_nodelets/onboard"
    if kind == "one process":
        camera = fly.camera_override(options.camera_size)
        return [
            [program, "--scenario", options.scenario, "--overrides", camera]
            + ["--result-folder", folder]
        ]
    return [
        ["rosrun", "nodelet", "nodelet", "standalone", f"understory_nodelets/{kind}"]
        + [f"__name:={name}"]
        for name, kind in NODELETS.items()
    ]


def set_parameters(uri, options, folder):
    values = {
        "scenario": options.scenario,
        "overrides": fly.camera_override(options.camera_size).strip(),
        "result_folder": str(folder),
    }
    server = xmlrpc.client.ServerProxy(uri)
    for name, value in values.items():
        server.setParam("/onboard_bench", f"/{name}", value)


def measure(kind, options, folder, environment):
    """{row: Statistics}, CPU seconds per second, and those without the camera's rendering."""
    folder.mkdir(parents=True)
    if kind != "one process":
        set_parameters(environment["ROS_MASTER_URI"], options, folder)
    processes = [
        subprocess.Popen(
            [str(word) for word in command],
            env=environment,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            start_new_session=True,
        )
        for command in commands(kind, options, folder)
    ]
    try:
        time.sleep(WARM_UP_S)
        begin, begin_cpu_s = time.monotonic(), cpu_s(processes)
        time.sleep(options.seconds)
        share = (cpu_s(processes) - begin_cpu_s) / (time.monotonic() - begin)
    finally:
        for process in processes:
            os.killpg(process.pid, signal.SIGINT)
        for process in processes:
            process.wait(40)
    statistics = statistics_of(read_trace(folder / "trace.csv"))
    camera = statistics["camera"]
    rate_hz = camera.count / (options.seconds + WARM_UP_S)
    return statistics, share, share - rate_hz * camera.mean_ms * 1e-3


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--seconds", type=float, default=60.0)
    parser.add_argument("--scenario", default="small")
    parser.add_argument("--camera-size", default="640x480")
    parser.add_argument("--out", type=Path, default=None)
    options = parser.parse_args()
    out = options.out or Path(tempfile.mkdtemp(prefix="understory_onboard_bench_"))
    environment = workspace_environment()
    os.environ["PATH"] = environment["PATH"]
    found = {}
    for kind in ("one process", "a process each"):
        master, uri = fly.start_master(out / "master.log")
        try:
            print(f"{kind}: flying for {WARM_UP_S + options.seconds:.0f} s", flush=True)
            found[kind] = measure(
                kind, options, out / kind.replace(" ", "_"), {**environment, "ROS_MASTER_URI": uri}
            )
        finally:
            fly.stop(master)
    (one, one_cpu, one_rest), (many, many_cpu, many_rest) = found.values()
    print(f"\n{options.scenario}, camera {options.camera_size}, {options.seconds:.0f} s each; ms")
    print("| | one process p50 | p99 | a process each p50 | p99 | ratio p50 |\n|---|---|---|---|---|---|")
    for row in ROWS:
        a, b = one[row], many[row]
        print(
            f"| {row} | {a.p50_ms:.2f} | {a.p99_ms:.2f} | {b.p50_ms:.2f} | {b.p99_ms:.2f} "
            f"| {b.p50_ms / a.p50_ms:.1f} |"
        )
    print(f"| CPU, share of a core | {one_cpu:.2f} | | {many_cpu:.2f} | | {many_cpu / one_cpu:.1f} |")
    print(
        f"| CPU without rendering | {one_rest:.2f} | | {many_rest:.2f} | | {many_rest / one_rest:.1f} |"
    )


if __name__ == "__main__":
    main()
