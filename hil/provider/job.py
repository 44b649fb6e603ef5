# Copyright 2026 the Understory authors
# SPDX-License-Identifier: BSD-3-Clause
"""What a provider is asked to run, and what can go wrong before the command runs."""

import dataclasses
import os
from typing import Dict, List, Optional

WIRE_BITRATE = 1_000_000
WIRE_QUEUE = 10  # frames, as the queue of a real CAN interface
FAILED_STATUS = 125  # the provider's own failure, as of timeout(1) and env(1)


class HilError(Exception):
    """One line for the user."""


@dataclasses.dataclass(frozen=True)
class Job:
    """A command, the bus it wants and the machine it runs on."""

    command: List[str]
    interfaces: int = 1
    existing_interface: Optional[str] = None
    is_echo: bool = False
    bitrate: Optional[int] = None
    queue: int = WIRE_QUEUE
    memory_mib: int = 2048
    is_shell: bool = False


def environment_for(job: Job, provider: str) -> Dict[str, str]:
    """The caller's, with the name of the bus for programs and tests."""
    return {
        **os.environ,
        "UNDERSTORY_CAN": job.existing_interface or "vcan0",
        "UNDERSTORY_HIL_PROVIDER": provider,
    }
