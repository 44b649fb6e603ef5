#!/usr/bin/python3
# Copyright 2026 the Understory authors
# SPDX-License-Identifier: BSD-3-Clause
"""The bus provider: runs a command with a CAN bus of its own, on any machine.

Exit status: that of the command (128 + N if signal N ended it, 126 and 127 if it could not be
started), 2 for wrong use, 125 if there is no bus.
"""

import argparse
import os
import sys
from typing import Dict, List, NoReturn, Optional, Protocol, Sequence, Tuple

from job import FAILED_STATUS, WIRE_BITRATE, HilError, Job
from native import Native
from qemu import Qemu
from relay import Interrupted, is_terminal
from uml import Uml

WRONG_USE = 2


class Provider(Protocol):
    def missing(self, job: Job) -> Optional[str]:
        """Why it cannot work here; None if it can."""

    def run(self, job: Job) -> int:
        """The wait status of the command."""


# In the order in which they are tried: the quickest first.
PROVIDERS: Dict[str, Provider] = {"native": Native(), "uml": Uml(), "qemu": Qemu()}


class Parser(argparse.ArgumentParser):
    def error(self, message: str) -> NoReturn:
        """One line, as all commands of the project do."""
        self.exit(WRONG_USE, f"understory hil: {message} (see understory hil --help)\n")


def make_parser() -> argparse.ArgumentParser:
    parser = Parser(
        prog="understory hil",
        usage="understory hil [OPTION]... -- COMMAND [ARG]...\n"
        "       understory hil [OPTION]... --shell\n"
        "       understory hil --list",
        description="Runs a command with a CAN bus of its own, vcan0, on any machine: in a network "
        "namespace if the kernel has CAN, else in a kernel that it boots for the command, with the "
        "same files, folder and environment. Input, output, signals and exit status pass through.",
        epilog="Example: understory hil -- sh -c 'candump -n 1 vcan0 & sleep 1; cansend vcan0 "
        "123#DEADBEEF; wait'. More in docs/hil.md.",
    )
    parser.add_argument("--shell", action="store_true", help="a shell in which vcan0 is there")
    parser.add_argument("--list", action="store_true", help="which providers work here, and why")
    parser.add_argument(
        "--provider",
        choices=["auto", *PROVIDERS],
        default="auto",
        help="default: auto, the first that works",
    )
    parser.add_argument(
        "--interface", metavar="NAME", help="use this CAN interface of the host, as it is"
    )
    parser.add_argument("--interfaces", type=int, default=1, metavar="N", help="vcan0 to vcanN-1")
    parser.add_argument(
        "--echo", action="store_true", help="frames come back once sent, not at once (vcan echo=1)"
    )
    parser.add_argument(
        "--wire", action="store_true", help="1 Mbit/s, a queue of 10 frames; means --echo"
    )
    parser.add_argument(
        "--memory", type=int, default=2048, metavar="MIB", help="of a booted kernel (default: 2048)"
    )
    return parser


def split_arguments(words: Sequence[str]) -> Tuple[List[str], Optional[List[str]]]:
    """(options, command): the command is what follows the first `--`."""
    if "--" not in words:
        return list(words), None
    at = list(words).index("--")
    return list(words[:at]), list(words[at + 1 :])


def parse(words: Sequence[str]) -> Tuple[argparse.Namespace, Job]:
    ours, command = split_arguments(words)
    parser = make_parser()
    options, strange = parser.parse_known_args(ours)
    if strange and strange[0].startswith("-"):
        parser.error(f"unknown option {strange[0]}")
    if options.shell:
        if command is not None:
            parser.error("--shell takes no command")
        if not (is_terminal(0) and is_terminal(1)):
            parser.error("--shell needs a terminal")
        command = [os.environ.get("SHELL") or "/bin/bash"]
    elif not command and not options.list:
        parser.error("name a command after --, or use --shell")
    if strange:
        parser.error("the command must follow --")
    if not 1 <= options.interfaces <= 16:
        parser.error("--interfaces must be 1 to 16")
    if not 256 <= options.memory <= 1 << 20:
        parser.error("--memory must be 256 to 1048576")
    return options, Job(
        command=command or [],
        interfaces=options.interfaces,
        existing_interface=options.interface,
        is_echo=options.echo or options.wire,
        bitrate=WIRE_BITRATE if options.wire else None,
        memory_mib=options.memory,
        is_shell=options.shell,
    )


def list_providers(job: Job) -> int:
    works = False
    for name, provider in PROVIDERS.items():
        reason = provider.missing(job)
        works = works or reason is None
        print(f"{name:<8}{'works' if reason is None else reason}")
    return 0 if works else FAILED_STATUS


def choose(name: str, job: Job) -> Provider:
    if name == "auto" and job.existing_interface is not None:
        name = Native.name
    wanted = list(PROVIDERS) if name == "auto" else [name]
    reasons = []
    for candidate in wanted:
        reason = PROVIDERS[candidate].missing(job)
        if reason is None:
            return PROVIDERS[candidate]
        reasons.append(f"{candidate}: {reason}")
    raise HilError(("no provider works here. " if name == "auto" else "") + "; ".join(reasons))


def exit_status(wait_status: int) -> int:
    code = os.waitstatus_to_exitcode(wait_status)
    return code if code >= 0 else 128 - code


def main(words: Sequence[str]) -> int:
    options, job = parse(words)
    try:
        if options.list:
            return list_providers(job)
        return exit_status(choose(options.provider, job).run(job))
    except HilError as error:
        print(f"understory hil: {error}", file=sys.stderr)
        return FAILED_STATUS
    except Interrupted as interrupted:
        return 128 + interrupted.number
    except KeyboardInterrupt:
        return 130


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
