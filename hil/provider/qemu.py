# Copyright 2026 the Understory authors
# SPDX-License-Identifier: BSD-3-Clause
"""The provider that boots a distribution's kernel in QEMU, with the host's files as root (9P).

For hosts that may not trace processes, as User-Mode Linux does. The processor is emulated: good for
protocols, too slow to fly in real time. UNDERSTORY_QEMU_ACCEL=kvm uses the host's KVM; that is not
tried by itself, since with some hosts' /dev/kvm the kernel never starts.
"""

import gzip
import os
import platform
import subprocess
from pathlib import Path
from typing import Dict, List, Optional

from job import HilError, Job
from kernel import KernelRun, find_program, inside_needs, not_bootable, run_kernel

EMULATOR = "qemu-system-x86_64"
BUSYBOX = Path("/bin/busybox")
KERNELS, MODULES = Path("/boot"), Path("/lib/modules")
DRIVERS = ("virtio_pci", "virtio_console", "9pnet_virtio", "9p")
CHANNEL = "/dev/hvc0"
# Until the host's files are there; then the agent is the first process. What the command writes must
# be on the host's disk when it ends, so only mapped files are cached.
INIT = """\
#!/bin/busybox sh
for driver in /drivers/*; do /bin/busybox insmod "$driver"; done
/bin/busybox mount -t 9p -o trans=virtio,version=9p2000.L,msize=512000,cache=mmap host /host
exec /bin/busybox switch_root /host "$HIL_AGENT"
"""


def accelerator() -> str:
    name = os.environ.get("UNDERSTORY_QEMU_ACCEL", "tcg")
    if name not in ("tcg", "kvm"):
        raise HilError(f"UNDERSTORY_QEMU_ACCEL={name}: expected tcg or kvm")
    return name


def kernel_with_can() -> Optional[Path]:
    """The newest kernel of the distribution that has what the bus needs."""
    kernels = sorted(KERNELS.glob("vmlinuz-*"), key=lambda path: path.stat().st_mtime)
    for path in reversed(kernels):
        modules = MODULES / path.name.split("-", 1)[1]
        if os.access(path, os.R_OK) and any(modules.glob("kernel/drivers/net/can/vcan.ko*")):
            return path
    return None


def driver_files(release: str) -> List[Path]:
    """In the order in which they must be loaded."""
    found: List[Path] = []
    for driver in DRIVERS:
        outcome = subprocess.run(
            [find_program("modprobe") or "modprobe", "-S", release, "--show-depends", driver],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            encoding="utf-8",
            check=False,
        )
        if outcome.returncode != 0:
            raise HilError(f"the kernel {release} lacks a driver: {outcome.stderr.strip()}")
        # "insmod FILE" or "builtin NAME"
        lines = [line.split() for line in outcome.stdout.splitlines()]
        files = [Path(words[1]) for words in lines if words[0] == "insmod"]
        found += [path for path in files if path not in found]
    return found


def write_first_files(folder: Path, release: str) -> Path:
    """The root that the kernel starts with: what finds the real one."""
    root = folder / "first"
    for name in ("bin", "drivers", "host", "dev"):
        (root / name).mkdir(parents=True)
    (root / "bin" / "busybox").write_bytes(BUSYBOX.read_bytes())
    (root / "init").write_text(INIT, encoding="ascii")
    for number, path in enumerate(driver_files(release)):
        (root / "drivers" / f"{number:02}.ko").write_bytes(path.read_bytes())
    for program in (root / "bin" / "busybox", root / "init"):
        program.chmod(0o755)
    names = "\n".join(str(path.relative_to(root)) for path in sorted(root.rglob("*")))
    packed = subprocess.run(
        ["cpio", "--create", "--format=newc", "--quiet", "--owner=+0:+0"],
        input=names.encode(),
        stdout=subprocess.PIPE,
        cwd=root,
        check=True,
    )
    archive = folder / "first.cpio.gz"
    archive.write_bytes(gzip.compress(packed.stdout, compresslevel=1))
    return archive


class Qemu:
    name = "qemu"

    def missing(self, job: Job) -> Optional[str]:
        """Why it cannot work here."""
        refused = not_bootable(job)
        if refused is not None:
            return refused
        if platform.machine() != "x86_64":
            return f"not on {platform.machine()}"
        if find_program(EMULATOR) is None:
            return f"{EMULATOR} is not there (package qemu-system-x86)"
        if kernel_with_can() is None:
            return f"no kernel in {KERNELS} has the module vcan (package linux-image-amd64)"
        if not os.access(BUSYBOX, os.X_OK):
            return f"{BUSYBOX} is not there (package busybox-static)"
        if find_program("cpio") is None:
            return "cpio is not there (package cpio)"
        return inside_needs()

    def run(self, job: Job) -> int:
        """The wait status of the command."""
        return run_kernel(
            self.name,
            job,
            lambda folder, channel: (
                self._command(job, folder, channel),
                self._environment(folder),
            ),
        )

    def _command(self, job: Job, folder: Path, channel: int) -> List[str]:
        kernel = kernel_with_can()
        if kernel is None:
            raise HilError("the kernel is gone")
        release = kernel.name.split("-", 1)[1]
        arguments = KernelRun.boot_arguments(job, folder, CHANNEL, MODULES)
        agent = f"HIL_AGENT={folder}/provider/agent.py"
        return [
            find_program(EMULATOR) or EMULATOR,
            *("-nodefaults", "-display", "none", "-no-reboot", "-serial", "stdio"),
            *("-machine", "q35", "-accel", accelerator(), "-cpu", "max"),
            *("-smp", str(min(2, os.cpu_count() or 1)), "-m", f"{job.memory_mib}M"),
            *("-kernel", str(kernel), "-initrd", str(write_first_files(folder, release))),
            *("-append", " ".join(["console=ttyS0 quiet panic=-1", agent, *arguments])),
            *("-chardev", f"socket,id=channel,fd={channel}"),
            *("-device", "virtio-serial-pci", "-device", "virtconsole,chardev=channel"),
            *("-virtfs", "local,path=/,mount_tag=host,security_model=none,multidevs=remap"),
        ]

    @staticmethod
    def _environment(folder: Path) -> Dict[str, str]:
        return {"PATH": "/usr/sbin:/usr/bin:/sbin:/bin", "HOME": str(folder)}
