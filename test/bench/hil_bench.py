#!/usr/bin/python3
# Copyright 2026 the Understory authors
# SPDX-License-Identifier: BSD-3-Clause
"""The bus at full load: a flight with 200 setpoints and odometries a second and a station that
only talks. Prints the latency of setpoints, jitter, what was lost, and what the host costs.

usage: understory hil -- test/bench/hil_bench.py [--seconds S] [--rate HZ]
"""

import argparse
import os
import sys
import tempfile
from pathlib import Path
from typing import Any, Dict

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "hil" / "test"), str(ROOT / "test" / "support")]

from bench import HOST_BUS, MEMORY, Program, program, summary_of  # noqa: E402
from machine import Machine  # noqa: E402

TALKER_PERIOD_MS = 3.3  # fills up to 2.8 k frames/s
TICK_S = 1.0 / os.sysconf("SC_CLK_TCK")


def cpu_s(process_id: int) -> float:
    words = Path(f"/proc/{process_id}/stat").read_text(encoding="ascii").rpartition(")")[2].split()
    return (int(words[11]) + int(words[12])) * TICK_S


def fly(seconds: float, rate_hz: float, log_path: Path) -> float:
    """Returns the host's share of the processor while it flew."""
    programs = [Program(program("understory_vehicle"), "--rate", rate_hz)]
    programs[0].wait_for_line("DISARMED")
    programs.append(
        Program("cangen", HOST_BUS, "-I", "7FF", "-L", 8, "-D", "r", "-g", TALKER_PERIOD_MS)
    )
    words = ["--rate", rate_hz, "--duration", seconds, "--log", log_path]
    host = Program(program("understory_host"), *words)
    try:
        host.wait_for_line("FLYING")
        begin = cpu_s(host.process.pid)
        host.wait_for_line("LANDING", seconds + 30.0)
        share = (cpu_s(host.process.pid) - begin) / seconds
        if host.wait(60.0) != 0:
            raise SystemExit("not flown and landed:\n" + "\n".join(host.lines[-5:]))
    finally:
        for each in (host, *programs):
            each.close()
    return share


def report(summary: Dict[str, Any], share: float) -> None:
    messages, latency = summary["messages"], summary["latency"]
    ours = summary["frames"] / summary["duration_s"]
    print(f"frames: {ours:.0f} a second of ours and {1000 / TALKER_PERIOD_MS:.0f} of the talker")
    print(f"bus load at 1 Mbit/s: mean {100 * summary['load']['mean']:.1f} % without the talker")
    for title, name in (("SP_COMMIT to SP_ACK", "commit_to_ack"), ("PING to PONG", "ping_to_pong")):
        row = latency[name]
        print(f"{title}: p50 {row['p50_ms']:.3f} ms, p99 {row['p99_ms']:.3f} ms", end="")
        print(f", max {row['max_ms']:.3f} ms, of {row['count']}")
    for name in ("SP_COMMIT", "ODO_RATE"):
        row = messages[name]
        print(f"{name}: {row['rate_hz']:.1f} Hz, period p50 {row['p50_ms']:.3f} ms", end="")
        print(f", jitter (p99 - p1) {row['jitter_ms']:.3f} ms, max {row['max_ms']:.3f} ms")
    lost = {name: row["lost"] for name, row in messages.items() if row["lost"]}
    torn = {name: sets["torn"] for name, sets in summary["sets"].items()}
    print(f"lost by the counters: {lost or 'nothing'}; torn sets: {torn}")
    print(f"setpoints without an answer: {summary['unanswered']}")
    print(f"both ends counted: {summary['link']}")
    print(f"CPU of the host: {100 * share:.1f} % of one processor, as the kernel's tick", end=" ")
    print(f"of {1e3 * TICK_S:.0f} ms counts it, which may be far off")


def main() -> None:
    parser = argparse.ArgumentParser(description="The bus at full load.")
    parser.add_argument("--seconds", type=float, default=60.0, help="of flight (default: 60)")
    parser.add_argument("--rate", type=float, default=200.0, help="of setpoints, Hz (default: 200)")
    options = parser.parse_args()
    machine = Machine()
    with tempfile.TemporaryDirectory(dir=MEMORY) as folder:
        log_path = Path(folder) / "flight.log"
        share = fly(options.seconds, options.rate, log_path)
        trouble, gaps = machine.trouble(), [end - begin for begin, end in machine.gaps()]
        machine.close()
        report(summary_of(log_path), share)
    print(f"the machine woke late {len(gaps)} times, {sum(gaps):.3f} s in all; {trouble or 'calm'}")


if __name__ == "__main__":
    main()
