# Copyright 2026 the Understory authors
# SPDX-License-Identifier: BSD-3-Clause
"""Two flights that were recorded on a real bus: what the log tool must say of them for ever.

flight.log: armed, flown and landed by understory_host, by its own --log. host_dies.log: its host
was killed in flight, by candump. Both at 50 Hz. A change of the DBC needs them recorded anew.
"""

import json
import subprocess
import sys
import unittest
from pathlib import Path
from typing import Any, Dict, List, Tuple

ROOT = Path(__file__).resolve().parents[2]
GOLDEN = ROOT / "hil" / "golden"
TOOL = ROOT / "firmware_bridge" / "log" / "log.py"
HOLD_S, LAND_S, STATE_PERIOD_S = 0.25, 1.0, 0.02


def output_of(*words: Any) -> str:
    command = [sys.executable, "-B", str(TOOL), *map(str, words)]
    return subprocess.run(
        command, stdout=subprocess.PIPE, encoding="utf-8", check=True, timeout=60.0
    ).stdout


def summary_of(name: str) -> Dict[str, Any]:
    return json.loads(output_of("--summary", "--json", GOLDEN / name))


def spans_of(summary: Dict[str, Any], station: str) -> List[Tuple[float, str, str]]:
    return [
        (round(span["begin_s"], 2), span["state"], span["reason"]) for span in summary[station]
    ]


class ARecordedFlight(unittest.TestCase):
    maxDiff = None

    def check_counts(self, summary: Dict[str, Any]) -> None:
        """Nothing was lost, torn, repeated or wrong, and each set was answered."""
        for name, stream in summary["messages"].items():
            bad = {key: stream[key] for key in ("lost", "jumps", "repeated", "checksum", "code")}
            self.assertEqual(set(bad.values()), {0}, f"{name}: {bad}")
        self.assertEqual(summary["other"], {})
        self.assertEqual(summary["foreign"], [])
        self.assertEqual(summary["unanswered"], 0)
        self.assertEqual(set(summary["link"].values()), {0})

    def test_to_the_end_is_summarised_as_it_was(self) -> None:
        summary = summary_of("flight.log")

        self.check_counts(summary)
        self.assertEqual(summary["frames"], 3569)
        self.assertEqual(summary["sets"]["setpoint"]["complete"], 242)
        self.assertEqual(summary["sets"]["odometry"]["complete"], 244)
        self.assertEqual(summary["answers"], {"FLOWN": 43, "NOT_ARMED": 26, "OVERRULED": 172})
        self.assertEqual(
            spans_of(summary, "vehicle"),
            [
                (0.0, "DISARMED", "POWER_ON"),
                (0.1, "ARMING", "ARM_NO_SETPOINTS"),
                (0.56, "ARMED", "NONE"),
                (1.42, "LAND", "HOST_REQUEST"),
                (4.86, "DISARMED", "LANDED"),
            ],
        )
        host = [state for _, state, _ in spans_of(summary, "host")]
        self.assertEqual(host, ["WAITING", "ARMING", "FLYING", "LANDING"])
        self.assertAlmostEqual(summary["load"]["mean"], 0.0880, places=4)
        self.assertEqual(summary["errors"], [])

    def test_whose_host_died_is_summarised_as_it_was(self) -> None:
        summary = summary_of("host_dies.log")

        self.check_counts(summary)
        self.assertEqual(summary["frames"], 2740)
        self.assertEqual(summary["sets"]["setpoint"]["complete"], 56)
        self.assertEqual(summary["answers"], {"FLOWN": 30, "NOT_ARMED": 26})
        self.assertEqual(
            spans_of(summary, "vehicle"),
            [
                (0.0, "DISARMED", "POWER_ON"),
                (0.24, "ARMING", "ARM_NO_SETPOINTS"),
                (0.68, "ARMED", "NONE"),
                (1.52, "HOLD", "SETPOINT_SILENCE"),
                (2.24, "LAND", "HOST_SILENCE"),
                (5.7, "DISARMED", "LANDED"),
            ],
        )
        self.assertEqual(
            summary["errors"],
            [
                "vehicle: HOLD (SETPOINT_SILENCE) at 1.519 s",
                "vehicle: LAND (HOST_SILENCE) at 2.236 s",
                "vehicle: FlagLate at 1.316 s",
            ],
        )

    def test_whose_host_died_kept_to_the_times_of_the_protocol(self) -> None:
        lines = output_of("--decode", "--json", GOLDEN / "host_dies.log").splitlines()
        frames = [json.loads(line) for line in lines]
        states = [frame for frame in frames if frame["message"] == "VEH_STATE"]

        def last(name: str) -> float:
            return [frame["time_s"] for frame in frames if frame["message"] == name][-1]

        def first(state: str) -> float:
            return next(f["time_s"] for f in states if f["signals"]["state_name"] == state)

        for state, begin_s, limit_s in (
            ("HOLD", last("SP_COMMIT"), HOLD_S),
            ("LAND", last("HOST_HB"), LAND_S),
        ):
            took_s = first(state) - begin_s
            self.assertGreaterEqual(took_s, limit_s, state)
            self.assertLess(took_s, limit_s + 2 * STATE_PERIOD_S, state)


if __name__ == "__main__":
    unittest.main()
