# Copyright 2026 the Understory authors
# SPDX-License-Identifier: BSD-3-Clause
"""The bench of bench.py with a wire between host and vehicle that can be made to fail."""

import json
import sys
import time
from pathlib import Path
from typing import Any, Dict

from bench import HOST_BUS, VEHICLE_BUS, FlightTest, Program
from can_tools import wait_until


class Wire(Program):
    """Between host and vehicle; see faulty_wire.py for its faults."""

    def __init__(self, seed: int) -> None:
        script = Path(__file__).resolve().parent / "faulty_wire.py"
        super().__init__(sys.executable, "-B", script, HOST_BUS, VEHICLE_BUS, seed)
        self.wait_for_line("{", 30.0)

    def become(self, **faults: Any) -> float:
        """From now on. Returns since when."""
        answers = len(self.lines)
        self.tell(json.dumps(faults))
        wait_until(lambda: len(self.lines) > answers, "the wire to answer")
        self.counts()
        return time.time()

    def counts(self) -> Dict[str, int]:
        """As of the last change."""
        return json.loads(self.lines[-1])


class WireTest(FlightTest):
    """Host and vehicle with a wire between them. `bus` is the host's end."""

    vehicle_bus = VEHICLE_BUS
    seed = 1

    def setUp(self) -> None:
        super().setUp()
        self.far_bus = self.listen(VEHICLE_BUS, ("SP_COMMIT", "SP_ACK", "HOST_HB", "ARM_CMD"))
        self.wire = Wire(self.seed)
        self.addCleanup(self.wire.close)
