# Copyright 2026 the Understory authors
# SPDX-License-Identifier: BSD-3-Clause
"""A whole mission over the bus: the onboard pipeline, ROS, the vehicle; and its sudden end."""

import json
import os
import re
import signal
import subprocess
import time
import unittest
from pathlib import Path
from typing import List

from bench import HOST_BUS, ROOT, summary_of
from can_tools import must_run, wait_until
from mission_bench import VEHICLE, MissionTest

LOG_TOOL = ROOT / "firmware_bridge" / "log" / "log.py"
MISSION_PATIENCE_S = 100.0
HOLD_S, LAND_S = 0.25, 1.0
NEAR_M = 1.5


def decodes_with_wireshark(log_path: Path, folder: Path) -> None:
    """Every frame, with every one of its signals, by the stock program."""
    must_run("/usr/bin/python3", LOG_TOOL, "--wireshark", folder)
    shown = subprocess.run(
        ["tshark", "-r", str(log_path), "-T", "fields", "-e", "can.id", "-e", "frame.protocols"],
        env={**os.environ, "WIRESHARK_CONFIG_DIR": str(folder)},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        encoding="utf-8",
        check=True,
        timeout=60.0,
    )
    lines = shown.stdout.splitlines()
    frames = log_path.read_text(encoding="ascii").count("\n")
    odd = [line for line in lines if "signal_pdu" not in line or "malformed" in line]
    assert len(lines) == frames, f"tshark read {len(lines)} of {frames} frames"
    assert not odd, f"tshark did not decode {len(odd)} frames, such as {odd[0]}"


class AMission(MissionTest):
    @staticmethod
    def children(process_id: int, name: str) -> List[int]:
        found = []
        for path in Path("/proc").glob("[0-9]*/stat"):
            try:
                text = path.read_text(encoding="ascii")
            except OSError:
                continue
            match = re.match(r"(\d+) \((.*)\) \S (\d+) ", text)
            if match and match[2] == name and int(match[3]) == process_id:
                found.append(int(match[1]))
        return found

    def test_is_completed_without_collisions_and_its_log_decodes(self) -> None:
        mission = self.start_mission()

        status = mission.wait(MISSION_PATIENCE_S)

        result = json.loads((self.out / "result.json").read_text(encoding="utf-8"))
        print(f"    {({key: result[key] for key in list(result)[:8]})}")
        self.assertEqual(status, 0, mission.lines[-5:])
        self.assertEqual(result["collisions"], 0)
        log_path = self.out / "bus.log"
        decodes_with_wireshark(log_path, self.folder / "wireshark")
        summary = summary_of(log_path)
        spans = [(span["state"], span["reason"]) for span in summary["vehicle"]]
        print(f"    {summary['frames']} frames, all decoded by tshark; {spans}; {summary['link']}")
        self.assertEqual(summary["other"], {})
        self.assertEqual(spans[-1][0], "DISARMED")
        self.assertIn(("ARMED", "NONE"), spans)
        for name, stream in summary["messages"].items():
            self.assertEqual(stream["checksum"] + stream["code"] + stream["length"], 0, name)

    def test_whose_onboard_process_dies_holds_and_lands(self) -> None:
        self.run_program(VEHICLE, "--scenario", "clearing", "--interface", HOST_BUS)
        mission = self.start_mission("--no-vehicle")
        armed = self.bus.wait_for_state("ARMED", patience_s=60.0)
        time.sleep(6.0)
        onboard = self.children(mission.process.pid, "onboard")
        self.assertEqual(len(onboard), 1)

        died_s = time.time()
        os.kill(onboard[0], signal.SIGKILL)

        hold = self.bus.wait_for_state("HOLD", since_s=died_s)
        land = self.bus.wait_for_state("LAND", since_s=died_s)
        self.assertGreater(died_s, armed.stamp_s)
        self.assert_after(HOLD_S, self.bus.last_flown(hold.stamp_s).stamp_s, hold, "HOLD")
        heartbeat = self.bus.of("HOST_HB", until_s=land.stamp_s)[-1]
        self.assert_after(LAND_S, heartbeat.stamp_s, land, "LAND")
        self.assert_lands(since_s=died_s)
        path = list(self.bus.positions(died_s))
        _, x_m, y_m, _ = path[0]
        farthest_m = max(max(abs(x - x_m), abs(y - y_m)) for _, x, y, _ in path)
        print(f"    went at most {farthest_m:.2f} m on")
        self.assertLess(farthest_m, NEAR_M)
        wait_until(lambda: mission.process.poll() is not None, "fly.py to end")
        self.assertEqual(mission.wait(), 2)
        self.assertIn("killed by signal 9", " ".join(mission.lines))


if __name__ == "__main__":
    unittest.main()
