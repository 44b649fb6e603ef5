# Copyright 2026 the Understory authors
# SPDX-License-Identifier: BSD-3-Clause
"""A flight on a bus that is as slow as a wire: 1 Mbit/s and a short queue."""

import contextlib
import re
import subprocess
import tempfile
import threading
import time
import unittest
from pathlib import Path

from bench import HOST_BUS, MEMORY, FlightTest, summary_of
from can_tools import BUS, Frame, Port

HIL_OPTIONS = ["--wire"]
BITRATE, QUEUE = 1_000_000, 10
BURST_S, PAUSE_S = 0.015, 0.05  # longer than from one setpoint to the next
# canbusload counts bits of the frames in whole per cent, over a second.
LOAD_TOLERANCE = 0.03


class ASlowBus(FlightTest):
    def setUp(self) -> None:
        super().setUp()
        folder = tempfile.TemporaryDirectory(prefix="paced_hil_", dir=MEMORY)
        self.addCleanup(folder.cleanup)
        self.log_path = Path(folder.name) / "flight.log"

    def test_is_as_full_as_the_standard_tool_says(self) -> None:
        load = self.run_program("canbusload", "-e", f"{HOST_BUS}@{BITRATE}")
        self.start_vehicle()
        host = self.start_host("--duration", 3, "--log", self.log_path)

        self.assertEqual(host.wait(40.0), 0, host.lines)
        load.stop()

        shares = [int(found) for found in re.findall(r"(\d+)%", " ".join(load.lines))]
        flying = sorted(share for share in shares if share > 0)
        theirs = 0.01 * flying[len(flying) // 2]
        ours = summary_of(self.log_path)["load"]
        print(f"    log: mean {ours['mean']:.3f}, peak {ours['peak']:.3f}; canbusload {theirs:.2f}")
        self.assertGreater(ours["mean"], 0.12)
        self.assertLess(ours["mean"], 0.194 + 0.01)  # the worst case of docs/can_protocol.md
        self.assertLess(abs(ours["mean"] - theirs), LOAD_TOLERANCE)

    def test_whose_queue_is_full_now_and_then_is_flown_through(self) -> None:
        _, host = self.fly()

        self.is_ending = False
        thread = threading.Thread(target=self.burst, daemon=True)
        thread.start()
        began_s = time.time()
        time.sleep(4.0)
        self.is_ending = True
        thread.join()
        time.sleep(1.2)  # until the host's next line

        counters = host.counters()
        states = self.bus.states(began_s)
        flown = [s for s in self.bus.of("SP_ACK", began_s) if s["AckResult"] == "FLOWN"]
        print(f"    full {counters['full']}, expired {counters['expired']}, {len(flown)} flown")
        self.assertGreater(counters["full"], 0)
        self.assertGreater(len(flown), 100)
        self.assertLessEqual(set(states), {("ARMED", "NONE"), ("HOLD", "SETPOINT_SILENCE")})
        self.assertEqual(states[-1], ("ARMED", "NONE"))

    def burst(self) -> None:
        """Now and then frames stay in the queue for BURST_S, and another station fills it. It sends
        already when that begins: where host and vehicle come first they wait with two frames each
        in a queue that never fills."""
        with Port() as port, self.run_tc() as tc:
            while not self.is_ending:
                self.shape(tc, f"delay {1e3 * BURST_S:.0f}ms")
                end_s = time.monotonic() + 2 * BURST_S
                while time.monotonic() < end_s:
                    with contextlib.suppress(OSError):  # full
                        port.send(Frame(0x7FF, bytes(8)))
                self.shape(tc, f"rate {BITRATE}bit")
                time.sleep(PAUSE_S)

    @staticmethod
    def run_tc() -> "subprocess.Popen[str]":
        """Obeys line by line: starting it takes longer than the queue takes to fill."""
        return subprocess.Popen(["tc", "-batch", "-"], stdin=subprocess.PIPE, encoding="utf-8")

    @staticmethod
    def shape(tc: "subprocess.Popen[str]", netem: str) -> None:
        assert tc.stdin is not None
        tc.stdin.write(f"qdisc replace dev {BUS} root netem {netem} limit {QUEUE}\n")
        tc.stdin.flush()


if __name__ == "__main__":
    unittest.main()
