# Copyright 2026 the Understory authors
# SPDX-License-Identifier: BSD-3-Clause
"""The provider that boots User-Mode Linux: a kernel as a process, with the host's files as root."""

import os
from pathlib import Path
from typing import Dict, List, Optional

from job import HilError, Job
from kernel import KernelRun, inside_needs, not_bootable, run_kernel
from registers import KEPT_BY_UML, build_preload, compiler, traced_register_bytes

KERNEL = Path("/usr/bin/linux.uml")
MODULES = Path("/usr/lib/uml/modules")
MEMORY_FOLDERS = ("/dev/shm", "/tmp", "/var/tmp")
SLACK_MIB = 64


def memory_folder(memory_mib: int) -> Optional[str]:
    """Where a file that is the kernel's memory may lie: room enough, and code may run from it."""
    for folder in dict.fromkeys((*MEMORY_FOLDERS, os.environ.get("TMPDIR", "/tmp"))):
        try:
            status = os.statvfs(folder)
        except OSError:
            continue
        free_mib = status.f_bavail * status.f_frsize >> 20
        runs_code = not status.f_flag & os.ST_NOEXEC
        if runs_code and free_mib >= memory_mib + SLACK_MIB and os.access(folder, os.W_OK):
            return folder
    return None


class Uml:
    name = "uml"

    def missing(self, job: Job) -> Optional[str]:
        """Why it cannot work here."""
        refused = not_bootable(job)
        if refused is not None:
            return refused
        if not os.access(KERNEL, os.X_OK) or not MODULES.is_dir():
            return f"{KERNEL} is not there (package user-mode-linux)"
        lacking = inside_needs()
        if lacking is not None:
            return lacking
        if memory_folder(job.memory_mib) is None:
            return f"no folder for temporary files has {job.memory_mib} MiB free (see --memory)"
        register_bytes = traced_register_bytes()
        if register_bytes is None:
            return "ptrace is not permitted here (in a container: --cap-add SYS_PTRACE)"
        if register_bytes > KEPT_BY_UML and compiler() is None:
            return "this processor needs a C compiler besides (package gcc)"
        return None

    def run(self, job: Job) -> int:
        """The wait status of the command."""
        return run_kernel(
            self.name,
            job,
            lambda folder, channel: (
                self._command(job, folder, channel),
                self._environment(job, folder),
            ),
        )

    def _command(self, job: Job, folder: Path, channel: int) -> List[str]:
        return [
            str(KERNEL),
            f"mem={job.memory_mib}M",
            f"uml_dir={folder}",
            "umid=kernel",
            "root=/dev/root",
            "rootfstype=hostfs",
            "rw",
            "con=null",
            "con0=null,fd:1",
            "ssl=null",
            f"ssl0=fd:{channel}",
            "quiet",
            *KernelRun.boot_arguments(job, folder, "/dev/ttyS0", MODULES),
        ]

    def _environment(self, job: Job, folder: Path) -> Dict[str, str]:
        memory = memory_folder(job.memory_mib)
        if memory is None:
            raise HilError("no room left for the kernel's memory")
        environment = {"PATH": "/usr/sbin:/usr/bin:/sbin:/bin", "HOME": str(folder)}
        environment["TMPDIR"] = memory
        if (traced_register_bytes() or 0) > KEPT_BY_UML:
            environment["LD_PRELOAD"] = str(build_preload(folder))
        return environment
