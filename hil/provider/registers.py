# Copyright 2026 the Understory authors
# SPDX-License-Identifier: BSD-3-Clause
"""Whether this host lets us trace processes, and how large a processor's extended registers are."""

import ctypes
import os
import signal
import subprocess
from pathlib import Path
from typing import List, Optional

from job import HilError

KEPT_BY_UML = 2696  # bytes of extended registers that User-Mode Linux 6.1 has room for
XSTATE = 0x202
TRACE_ME, GET_REGISTER_SET = 0, 0x4204
SOURCE = Path(__file__).with_name("uml_registers.c")


class _Iovec(ctypes.Structure):
    _fields_ = [("base", ctypes.c_void_p), ("length", ctypes.c_size_t)]


def traced_register_bytes() -> Optional[int]:
    """What ptrace() gives for the extended registers of a child; None if it may not trace it."""
    libc = ctypes.CDLL(None, use_errno=True)
    libc.ptrace.argtypes = [ctypes.c_long, ctypes.c_int, ctypes.c_void_p, ctypes.c_void_p]
    child = os.fork()
    if child == 0:
        may = libc.ptrace(TRACE_ME, 0, None, None) == 0
        if may:
            os.kill(os.getpid(), signal.SIGSTOP)
        os._exit(0)
    _, status = os.waitpid(child, os.WUNTRACED)
    if not os.WIFSTOPPED(status):
        return None
    buffer = ctypes.create_string_buffer(65536)
    vector = _Iovec(ctypes.addressof(buffer), len(buffer))
    failed = libc.ptrace(GET_REGISTER_SET, child, XSTATE, ctypes.addressof(vector)) != 0
    os.kill(child, signal.SIGKILL)
    os.waitpid(child, 0)
    return 0 if failed else int(vector.length)


def compiler() -> Optional[str]:
    for path in ("/usr/bin/cc", "/usr/bin/gcc", "/usr/bin/clang"):
        if os.access(path, os.X_OK):
            return path
    return None


def build_preload(folder: Path) -> Path:
    """The library that makes up for what User-Mode Linux has no room for."""
    library = folder / "uml_registers.so"
    command: List[str] = [compiler() or "cc", "-O2", "-shared", "-fPIC", "-o", str(library)]
    outcome = subprocess.run(
        [*command, str(SOURCE)],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        encoding="utf-8",
        errors="replace",
        check=False,
    )
    if outcome.returncode != 0:
        raise HilError(f"{SOURCE.name} does not compile: {' '.join(outcome.stdout.split())}")
    return library
