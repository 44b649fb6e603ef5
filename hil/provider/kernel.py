# Copyright 2026 the Understory authors
# SPDX-License-Identifier: BSD-3-Clause
"""A kernel that runs as a process of the host, from its folder for logs to its last child."""

import contextlib
import os
import shutil
import signal
import socket
import subprocess
import tempfile
from pathlib import Path
from types import TracebackType
from typing import Callable, Dict, List, Optional, Tuple, Type

from job import HilError, Job
from relay import Relay

HERE = Path(__file__).resolve().parent
NEEDED_INSIDE = {"ip": "iproute2", "tc": "iproute2", "modprobe": "kmod", "mount": "mount"}
PYTHON = "/usr/bin/python3"
Started = Tuple[List[str], Dict[str, str]]  # command line and environment


def find_program(name: str) -> Optional[str]:
    return shutil.which(name, path="/usr/sbin:/usr/bin:/sbin:/bin")


def inside_needs() -> Optional[str]:
    """What a booted kernel would not find on this machine."""
    for name, package in NEEDED_INSIDE.items():
        if find_program(name) is None:
            return f"{name} is not there (package {package})"
    if not os.access(PYTHON, os.X_OK):
        return f"{PYTHON} is not there (package python3)"
    return None


class KernelRun(contextlib.AbstractContextManager):  # type: ignore[type-arg]
    """A private folder and the processes of one kernel; both are gone afterwards."""

    def __init__(self, name: str) -> None:
        self._name = name
        self._kernel: Optional["subprocess.Popen[bytes]"] = None
        # The kernel's command line has no way to write a space.
        parent = "/tmp" if " " in tempfile.gettempdir() else None
        self.folder = Path(tempfile.mkdtemp(prefix="understory-hil-", dir=parent))
        # Whatever the path of the project is, this one is short and plain.
        (self.folder / "provider").symlink_to(HERE)

    @staticmethod
    def boot_arguments(job: Job, folder: Path, channel: str, modules: Path) -> List[str]:
        settings = {
            "HIL_CHANNEL": channel,
            "HIL_FOLDER": folder,
            "HIL_MODULES": modules,
            "HIL_INTERFACES": job.interfaces,
            "HIL_ECHO": int(job.is_echo),
            "HIL_BITRATE": job.bitrate or "",
            "HIL_QUEUE": job.queue,
        }
        return [f"init={folder}/provider/agent.py", *(f"{k}={v}" for k, v in settings.items())]

    def start(
        self, command: List[str], environment: Dict[str, str], kept_files: Tuple[int, ...]
    ) -> None:
        """In a session of its own: a Ctrl-C of the terminal is for the command inside."""
        with open(self._log(), "wb") as log:
            self._kernel = subprocess.Popen(
                command,
                cwd="/",
                env=environment,
                pass_fds=kept_files,
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=log,
                start_new_session=True,
            )

    def relay(self, channel: socket.socket, job: Job) -> int:
        try:
            return Relay(channel, job, self._lives).run(self._name)
        except HilError as error:
            raise HilError(f"{error} (its log: {self._kept_log()})") from None

    def _lives(self) -> bool:
        return self._kernel is not None and self._kernel.poll() is None

    def _log(self) -> Path:
        return self.folder / "kernel.log"

    def _kept_log(self) -> Path:
        number, path = tempfile.mkstemp(prefix="understory-hil-", suffix=".log")
        os.close(number)
        shutil.copyfile(self._log(), path)
        return Path(path)

    def __exit__(
        self,
        kind: Optional[Type[BaseException]],
        value: Optional[BaseException],
        trace: Optional[TracebackType],
    ) -> None:
        # The agent has written everything to the disk before it said that the command ended.
        if self._kernel is not None:
            with contextlib.suppress(ProcessLookupError):
                os.killpg(self._kernel.pid, signal.SIGKILL)
            self._kernel.wait()
        shutil.rmtree(self.folder, ignore_errors=True)


def not_bootable(job: Job) -> Optional[str]:
    """Why no kernel can be booted for this, whichever it is."""
    if job.existing_interface is not None:
        return "--interface needs the host's own kernel"
    if "UNDERSTORY_HIL_PROVIDER" in os.environ:
        return "not within another provider"
    return None


def run_kernel(name: str, job: Job, prepare: Callable[[Path, int], Started]) -> int:
    """The wait status of the command. `prepare` makes the kernel's command line and environment of
    its folder and its end of the channel."""
    with KernelRun(name) as run:
        ours, theirs = socket.socketpair()
        with ours, theirs:
            command, environment = prepare(run.folder, theirs.fileno())
            run.start(command, environment, (theirs.fileno(),))
            theirs.close()
            return run.relay(ours, job)
