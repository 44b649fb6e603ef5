# Copyright 2026 the Understory authors
# SPDX-License-Identifier: BSD-3-Clause
"""What a booted kernel needs before a command can run: file systems, a name, modules, interfaces.

In one process, since starting one takes 20 to 50 ms in there. The provider's wishes come as HIL_
variables, from the kernel's command line.
"""

import contextlib
import ctypes
import os
import socket
import subprocess
from typing import Dict, List

OWN = "/dev/understory"  # not the host's: /dev is made by this kernel
MODULES = ["can-raw", "can-gw", "vcan"]  # can-gw is not loaded by itself when it is needed
PROGRAMS = "/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin"


class NoBus(Exception):
    """Why there is none."""


def mount(kind: str, folder: str, options: str = "") -> None:
    libc = ctypes.CDLL(None, use_errno=True)
    failed = libc.mount(kind.encode(), folder.encode(), kind.encode(), 0, options.encode())
    if failed and not os.path.ismount(folder):
        raise NoBus(f"{kind} cannot be mounted: {os.strerror(ctypes.get_errno())}")


def mount_all() -> None:
    """The root is the host's: its /dev, /proc and /sys would speak of another kernel."""
    mount("proc", "/proc")
    mount("sysfs", "/sys")
    mount("devtmpfs", "/dev")
    for folder in ("/dev/pts", "/dev/shm", OWN):
        os.makedirs(folder, exist_ok=True)
    mount("devpts", "/dev/pts", "mode=620,ptmxmode=666")
    mount("tmpfs", "/dev/shm", "mode=1777")
    links = {"ptmx": "pts/ptmx", "fd": "/proc/self/fd"}
    links.update({"stdin": "fd/0", "stdout": "fd/1", "stderr": "fd/2"})
    for name, target in links.items():
        with contextlib.suppress(FileNotFoundError):
            os.unlink(f"/dev/{name}")
        os.symlink(target, f"/dev/{name}")


def run(*words: str, text: str = "") -> None:
    outcome = subprocess.run(
        words,
        input=text,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        encoding="utf-8",
        errors="replace",
        check=False,
    )
    if outcome.returncode != 0:
        what = "; ".join(text.splitlines()) or " ".join(words)
        raise NoBus(f"'{what}' failed inside: {' '.join(outcome.stdout.split())}")


def load_modules(settings: Dict[str, str]) -> None:
    """Others load when they are needed, as on any machine, but from the provider's folder: the
    host may have no /lib/modules at all."""
    os.makedirs(f"{OWN}/lib/modules")
    release = os.uname().release
    os.symlink(f"{settings['HIL_MODULES']}/{release}", f"{OWN}/lib/modules/{release}")
    with open(f"{OWN}/modprobe.conf", "w", encoding="ascii") as file:
        file.write(f"options vcan echo={settings['HIL_ECHO']}\n")
    loader = f"{OWN}/modprobe"
    with open(loader, "w", encoding="ascii") as file:
        file.write(f'#!/bin/sh\nexec modprobe -C {OWN}/modprobe.conf -d {OWN} "$@"\n')
    os.chmod(loader, 0o755)
    with open("/proc/sys/kernel/modprobe", "w", encoding="ascii") as file:
        file.write(loader)
    run(loader, "-a", *MODULES)


def make_buses(settings: Dict[str, str]) -> None:
    names = [f"vcan{number}" for number in range(int(settings["HIL_INTERFACES"]))]
    lines: List[str] = ["link set lo up"]
    for name in names:
        lines += [f"link add dev {name} type vcan", f"link set {name} up"]
    run("ip", "-batch", "-", text="".join(f"{line}\n" for line in lines))
    if settings["HIL_BITRATE"]:
        netem = f"netem rate {settings['HIL_BITRATE']}bit limit {settings['HIL_QUEUE']}"
        lines = [f"qdisc add dev {name} root {netem}\n" for name in names]
        run("tc", "-batch", "-", text="".join(lines))


def prepare() -> None:
    """NoBus says what is not there."""
    os.environ["PATH"] = PROGRAMS
    mount_all()
    # The one name that every machine resolves; ROS announces itself with it.
    socket.sethostname("localhost")
    load_modules(dict(os.environ))
    make_buses(dict(os.environ))
