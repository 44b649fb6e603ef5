# Copyright 2026 the Understory authors
# SPDX-License-Identifier: BSD-3-Clause
"""The provider for hosts whose kernel has CAN: vcan in a network namespace of its own, or an
interface that is already there."""

import ctypes
import os
import signal
import subprocess
from pathlib import Path
from typing import Optional

from endings import ENDING, EndingSignals
from execute import execute
from job import HilError, Job, environment_for
from kernel import find_program
from processes import adopt_orphans, die_with_parent, end_all, signal_all

NEW_USER, NEW_NET, NEW_MOUNTS = 0x10000000, 0x40000000, 0x00020000
CAN_DEVICE = "280"  # ARPHRD_CAN
UP = 1
FROM_KERNEL = 0x80  # si_code of what a terminal sends
HANDLED = (*ENDING, signal.SIGUSR1, signal.SIGUSR2, signal.SIGCHLD)
TERM_PATIENCE_S = 2.0
ECHO_OF_VCAN = Path("/sys/module/vcan/parameters/echo")


def enter_namespace() -> None:
    """OSError if this user may not."""
    libc = ctypes.CDLL(None, use_errno=True)
    user, group = os.getuid(), os.getgid()
    is_root = os.geteuid() == 0
    if libc.unshare(NEW_NET | NEW_MOUNTS | (0 if is_root else NEW_USER)) != 0:
        number = ctypes.get_errno()
        raise OSError(number, os.strerror(number))
    if not is_root:
        Path("/proc/self/setgroups").write_text("deny", encoding="ascii")
        Path("/proc/self/uid_map").write_text(f"0 {user} 1", encoding="ascii")
        Path("/proc/self/gid_map").write_text(f"0 {group} 1", encoding="ascii")


def run_tool(*words: str) -> None:
    program = find_program(words[0])
    if program is None:
        raise HilError(f"{words[0]} is not there")
    outcome = subprocess.run(
        [program, *words[1:]],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        encoding="utf-8",
        errors="replace",
        check=False,
    )
    if outcome.returncode != 0:
        raise HilError(f"'{' '.join(words)}' failed: {' '.join(outcome.stdout.split())}")


def make_buses(job: Job) -> None:
    """In the namespace that we have just entered."""
    run_tool("ip", "link", "set", "lo", "up")
    for name in (f"vcan{number}" for number in range(job.interfaces)):
        run_tool("ip", "link", "add", "dev", name, "type", "vcan")
        run_tool("ip", "link", "set", name, "up")
        if job.bitrate is not None:
            netem = f"netem rate {job.bitrate}bit limit {job.queue}"
            run_tool("tc", "qdisc", "add", "dev", name, "root", *netem.split())
    try:
        run_tool("mount", "--make-rslave", "/")
        run_tool("mount", "-t", "sysfs", "sysfs", "/sys")
    except HilError:
        pass  # then /sys/class/net tells of the host; nothing else needs it


def in_child(action) -> Optional[str]:
    """Runs `action` in a process of its own; what went wrong, if anything."""
    reading, writing = os.pipe()
    child = os.fork()
    if child == 0:
        reason = ""
        try:
            action()
        except (HilError, OSError) as error:
            reason = str(error) or type(error).__name__
        os.write(writing, os.fsencode(reason))
        os._exit(0)
    os.close(writing)
    with os.fdopen(reading, "rb") as file:
        reason = os.fsdecode(file.read())
    os.waitpid(child, 0)
    return reason or None


class Native:
    name = "native"

    def missing(self, job: Job) -> Optional[str]:
        """Why it cannot work here."""
        if job.existing_interface is not None:
            return self._missing_interface(job, job.existing_interface)
        if find_program("ip") is None:
            return "ip is not there (package iproute2)"
        if job.is_echo and os.geteuid() == 0 and not ECHO_OF_VCAN.exists():
            in_child(lambda: run_tool("modprobe", "vcan", "echo=1"))

        def attempt() -> None:
            enter_namespace()
            run_tool("ip", "link", "add", "dev", "vcan0", "type", "vcan")

        reason = in_child(attempt)
        if reason is not None and "permitted" in reason:
            return f"no network namespace for this user ({reason})"
        if reason is not None:
            return f"the kernel has no vcan ({reason})"
        if job.is_echo and ECHO_OF_VCAN.read_text(encoding="ascii").strip() not in ("Y", "1"):
            return "its vcan was loaded without echo=1"
        return None

    @staticmethod
    def _missing_interface(job: Job, name: str) -> Optional[str]:
        folder = Path("/sys/class/net") / name
        if job.is_echo or job.interfaces != 1:
            return "--interface uses one interface as it is"
        try:
            kind = (folder / "type").read_text(encoding="ascii").strip()
            flags = int((folder / "flags").read_text(encoding="ascii"), 16)
        except OSError:
            return f"there is no interface {name}"
        if kind != CAN_DEVICE:
            return f"{name} is not a CAN interface"
        return None if flags & UP else f"{name} is down (ip link set {name} up)"

    def run(self, job: Job) -> int:
        """The wait status of the command."""
        before = signal.pthread_sigmask(signal.SIG_BLOCK, HANDLED)
        adopt_orphans()
        reading, writing = os.pipe()
        child = os.fork()
        if child == 0:
            os.write(writing, os.fsencode(self._become(job, before)))
            os._exit(1)
        os.close(writing)
        with os.fdopen(reading, "rb") as file:
            reason = os.fsdecode(file.read())
        if reason:
            raise HilError(reason)
        status = self._wait_for(child)
        end_all(TERM_PATIENCE_S)
        return status

    @staticmethod
    def _become(job: Job, mask) -> str:
        """Turns into the command; what went wrong if it comes back."""
        try:
            die_with_parent()
            if job.existing_interface is None:
                enter_namespace()
                make_buses(job)
        except (HilError, OSError) as error:
            return str(error)
        signal.pthread_sigmask(signal.SIG_SETMASK, mask)
        execute(job.command, environment_for(job, Native.name))

    @staticmethod
    def _wait_for(child: int) -> int:
        endings = EndingSignals()
        while True:
            info = signal.sigwaitinfo(HANDLED)
            if info.si_signo == signal.SIGCHLD:
                pid, status = os.waitpid(-1, os.WNOHANG)
                while pid not in (0, child):
                    pid, status = os.waitpid(-1, os.WNOHANG)
                if pid == child:
                    return status
                continue
            if endings.is_second(info.si_signo):
                signal_all(signal.SIGKILL)
            elif info.si_code != FROM_KERNEL:  # else the terminal told the command as well
                signal_all(info.si_signo)
