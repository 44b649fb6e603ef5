# Copyright 2026 the Understory authors
# SPDX-License-Identifier: BSD-3-Clause
"""What tests of whole missions share: `fly.py` on the buses that are there, with programs as built."""

import os
import shlex
import tempfile
from pathlib import Path
from typing import Any

from bench import HOST_BUS, MEMORY, ROOT, FlightTest, Program

TREE = Path(os.environ.get("UNDERSTORY_ROOT", ROOT))
WORKSPACE = TREE / "catkin_ws" / "devel"
ONBOARD = WORKSPACE / "lib" / "understory_nodelets" / "onboard"
VEHICLE = WORKSPACE / "lib" / "understory_hil" / "understory_vehicle"
FLY = TREE / "src" / "understory_nodelets" / "onboard" / "fly.py"
# The processor is shared with the camera, the map and the vehicle.
LITTLE = ["--scenario", "clearing", "--camera-size", "160x120", "--quiet", "--no-report"]
STOP_PATIENCE_S = 60.0


class MissionTest(FlightTest):
    """Results are in `out`."""

    def setUp(self) -> None:
        super().setUp()
        for path in (ONBOARD, VEHICLE):
            if not path.exists():
                self.skipTest(f"{path} is not built")
        folder = tempfile.TemporaryDirectory(prefix="mission_hil_", dir=MEMORY)
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)
        self.out = self.folder / "out"

    def start_mission(self, *words: Any) -> Program:
        command = ["/usr/bin/python3", "-B", FLY, "--bus", HOST_BUS, "--onboard", ONBOARD]
        command += ["--vehicle", VEHICLE, "--out", self.out, *LITTLE, *words]
        line = shlex.join(map(str, command))
        mission = self.run_program("bash", "-c", f". {WORKSPACE}/setup.bash; exec {line}")
        self.addCleanup(mission.stop, STOP_PATIENCE_S)  # it has programs of its own to end
        return mission
