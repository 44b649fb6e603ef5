# Copyright 2026 the Understory authors
# SPDX-License-Identifier: BSD-3-Clause
"""A flight at the highest rates: 200 setpoints and 200 odometries a second."""

import tempfile
import unittest
from pathlib import Path

from bench import MEMORY, FlightTest, summary_of

FLIGHT_S = 8
RATE_HZ = 200
FEW = 0.01  # of what was sent, on a machine that is shared
MOST_EXCUSED = 0.3
STILLNESS_BORNE_S = 0.2  # of the 250 ms that a vehicle waits
CATCHING_UP_S = 0.02  # after the machine stood still


class TheHighestRates(FlightTest):
    def setUp(self) -> None:
        super().setUp()
        folder = tempfile.TemporaryDirectory(prefix="rate_hil_", dir=MEMORY)
        self.addCleanup(folder.cleanup)
        self.log_path = Path(folder.name) / "flight.log"

    def test_lose_and_tear_nothing(self) -> None:
        self.start_vehicle("--rate", RATE_HZ)
        host = self.start_host(
            "--rate", RATE_HZ, "--duration", FLIGHT_S, "--log", self.log_path
        )
        self.assertEqual(host.wait(40.0), 0, host.lines)

        summary = summary_of(self.log_path)
        seconds = summary["duration_s"]
        # Of answers that wait because the vehicle was late only the newest leaves.
        streams = {name: s for name, s in summary["messages"].items() if name != "SP_ACK"}
        lost = sum(stream["lost"] for stream in streams.values())
        torn = {name: sets["torn"] for name, sets in summary["sets"].items()}
        ack = summary["latency"]["commit_to_ack"]
        print(f"    {summary['frames'] / seconds:.0f} frames/s, load {summary['load']['mean']:.3f}")
        print(f"    lost {lost}, torn {torn}, unanswered {summary['unanswered']}, link", end=" ")
        print(f"{summary['link']}; SP_COMMIT to SP_ACK p50 {ack['p50_ms']:.2f}", end=" ")
        print(f"p99 {ack['p99_ms']:.2f} ms")
        # Whoever stood still sends nothing meanwhile, and what it then has is too old to be sent.
        gaps = self.machine.gaps()
        excused = FEW + sum(end - begin + CATCHING_UP_S for begin, end in gaps) / seconds
        print(f"    the machine stood still {len(gaps)} times: {100 * excused:.1f} % are excused")
        self.assertLess(excused, MOST_EXCUSED, "too little is left to be tested")
        for name in ("SP_COMMIT", "ODO_RATE"):
            stream = summary["messages"][name]
            self.assertGreater(stream["count"], (0.95 - excused) * RATE_HZ * seconds, name)
            self.assertEqual(stream["checksum"] + stream["code"] + stream["length"], 0)
            self.assertLessEqual(stream["repeated"], len(gaps))  # sixteen lost look like it
        self.assertLessEqual(lost, excused * summary["frames"])
        for name, sets in summary["sets"].items():
            self.assertLessEqual(torn[name], excused * sets["complete"], name)
        if all(end - begin < STILLNESS_BORNE_S for begin, end in gaps):
            self.assertNotIn("HOLD", [span["state"] for span in summary["vehicle"]])


if __name__ == "__main__":
    unittest.main()
