# Copyright 2026 the Understory authors
# SPDX-License-Identifier: BSD-3-Clause
"""Turning into the command, alike inside a booted kernel and outside."""

import errno
import os
import signal
from typing import List, Mapping, NoReturn

NOT_FOUND_STATUS, NOT_EXECUTABLE_STATUS = 127, 126


def execute(command: List[str], environment: Mapping[str, str]) -> NoReturn:
    for number in (signal.SIGPIPE, signal.SIGXFSZ):  # Python ignores them
        signal.signal(number, signal.SIG_DFL)
    try:
        os.execvpe(command[0], command, environment)
    except OSError as error:
        fail(command[0], error)


def fail(name: str, error: OSError) -> NoReturn:
    text = f"understory hil: {name}: {os.strerror(error.errno or 0)}\n"
    os.write(2, os.fsencode(text))
    missing = error.errno in (errno.ENOENT, errno.ENOTDIR)
    os._exit(NOT_FOUND_STATUS if missing else NOT_EXECUTABLE_STATUS)
