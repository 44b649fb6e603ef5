#!/usr/bin/python3
# Copyright 2026 the Understory authors
# SPDX-License-Identifier: BSD-3-Clause
"""Reads a log of the bus: what was on it, how regularly, how late, what was lost; all signals.

Exit status: 0 done, 1 --check found errors, 2 wrong use or a log that cannot be read, 130
interrupted.
"""

import argparse
import contextlib
import json
import os
import pathlib
import shutil
import signal
import sys
import time
from typing import Any, Callable, Iterable, Iterator, List, Tuple

PROG = "understory log"
DESCRIPTION = """\
Reads a log of the bus as `candump -l` and the bridge write it (also .gz), or an ASC or BLF file,
and says what was on the bus: each message with its rate and losses, the load, complete and torn
sets, states, latency, errors."""
EPILOG = """\
Columns of the summary: periods of good frames; jitter is their p99 - p1; gaps are periods over 2.5
times the usual one. By the counter of each message: lost is up to two frames in a row, repeated is
the same counter again, a jump is anything else. checksum, code, length: frames with a wrong
checksum, a code that the protocol forbids, or not 8 bytes.

Output: --decode, --latency and --summary choose what is written, --json and --csv how; --json or
--csv alone mean --decode. Numbers that are not available are nan, in JSON null.

The log as a bus again, on which telemetry can be watched (it cannot arm anything):
  canplayer -I FILE vcan0=vcan0
With Wireshark, also in its window:
  understory log --wireshark FOLDER
  WIRESHARK_CONFIG_DIR=FOLDER tshark -r FILE -V
More tools: docs/can_log.md.

Exit status: 0 done, 1 --check found errors, 2 wrong use or a log that cannot be read. A log whose
last line was cut off is readable: that is noted on stderr."""
PROGRESS_AFTER_S = 2.0


class OutputError(Exception):
    """A file that cannot be written; the message names it."""


class Parser(argparse.ArgumentParser):
    """Says in one line what is wrong."""

    def error(self, message):
        self.exit(2, f"{PROG}: {message} (see {PROG} --help)\n")


class Progress:
    """One line on a terminal, for what takes long."""

    def __init__(self) -> None:
        self.begin_s = time.monotonic()
        self.is_shown = False

    def __call__(self, text: str) -> None:
        if sys.stderr.isatty() and time.monotonic() - self.begin_s > PROGRESS_AFTER_S:
            self.is_shown = True
            print(f"\r\033[K{text}", end="", file=sys.stderr, flush=True)

    def clear(self) -> None:
        if self.is_shown:
            print("\r\033[K", end="", file=sys.stderr, flush=True)
        self.is_shown = False


def bitrate(text: str) -> int:
    value = int(text)
    if not 1000 <= value <= 8_000_000:
        raise ValueError
    return value


def parse_arguments(words: List[str]) -> argparse.Namespace:
    parser = Parser(
        prog=PROG,
        usage=f"{PROG} [OPTION]... FILE\n       {PROG} --wireshark FOLDER",
        description=DESCRIPTION,
        epilog=EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        allow_abbrev=False,
    )
    path = pathlib.Path
    parser.add_argument("file", type=path, metavar="FILE", nargs="?", help="the log; - is stdin")
    view = parser.add_mutually_exclusive_group()
    for name, what in (
        ("summary", "all of it on a page (default)"),
        ("decode", "every frame with its signals"),
        ("latency", "how long things took on the bus"),
    ):
        view.add_argument(f"--{name}", dest="view", action="store_const", const=name, help=what)
    how = parser.add_mutually_exclusive_group()
    how.add_argument(
        "--json", action="store_true", help="as JSON: frames, one a line; else one object"
    )
    how.add_argument(
        "--csv",
        type=path,
        metavar="PATH",
        help="as CSV: one table if it ends in .csv, else a folder with one for each message",
    )
    parser.add_argument("--plots", type=path, metavar="FOLDER", help="also draw pictures into it")
    parser.add_argument(
        "--check", action="store_true", help="exit status 1 if the log shows errors"
    )
    parser.add_argument("--interface", default="", metavar="NAME", help="only its frames")
    parser.add_argument(
        "--bitrate",
        type=bitrate,
        default=1_000_000,
        metavar="N",
        help="of the bus, for its load (default: 1000000)",
    )
    parser.add_argument("--absolute", action="store_true", help="frames have the log's own stamps")
    parser.add_argument("--dbc", type=path, help="of another version of the protocol")
    parser.add_argument(
        "--wireshark",
        type=path,
        metavar="FOLDER",
        help="write DBC and configuration for Wireshark; takes no log",
    )
    arguments = parser.parse_args(words)
    _check_combination(parser, arguments)
    return arguments


def _check_combination(parser: Parser, arguments: argparse.Namespace) -> None:
    if arguments.wireshark:
        others = ("file", "view", "json", "csv", "plots", "check", "interface", "absolute")
        if any(getattr(arguments, name) for name in others):
            parser.error("--wireshark goes with no log and no other option but --dbc")
        return
    if not arguments.file:
        parser.error("no FILE given")
    arguments.view = arguments.view or ("decode" if arguments.json or arguments.csv else "summary")
    if arguments.view == "summary" and arguments.csv:
        parser.error("a summary is no table: --csv goes with --decode or --latency")
    if arguments.absolute and arguments.view != "decode":
        parser.error("--absolute goes with --decode")


@contextlib.contextmanager
def replaced(path: pathlib.Path) -> Iterator[pathlib.Path]:
    """A file to write that replaces the one at `path` as a whole, or leaves it as it was."""
    draft = path.with_name(path.name + ".part")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        yield draft
        os.replace(draft, path)
    except OSError as error:
        raise OutputError(f"{path}: cannot write: {error.strerror or error}") from error
    finally:
        with contextlib.suppress(OSError):
            draft.unlink()


def write_table(path: pathlib.Path, lines: Iterable[str], progress: Callable[[int], None]) -> None:
    from export import write_lines

    with replaced(path) as draft, open(draft, "w", encoding="utf-8", newline="") as file:
        write_lines(iter(lines), file, progress)
    print(path)


def write_decoded(log: Any, arguments: argparse.Namespace, progress: Progress) -> None:
    import export

    def report(done: int) -> None:
        progress(f"{100 * done / log.frames.count:.0f} % written")

    if arguments.json or not arguments.csv:
        lines = export.json_lines(log) if arguments.json else export.text_lines(log)
        # On a terminal the lines themselves show the progress.
        quiet = (lambda done: None) if sys.stdout.isatty() else report
        export.write_lines(lines, sys.stdout, quiet)
    elif export.is_single_file(arguments.csv):
        write_table(arguments.csv, export.csv_table(log), report)
    else:
        for name, lines in export.csv_files(log):
            write_table(arguments.csv / name, lines, report)


def write_latency(log: Any, arguments: argparse.Namespace) -> None:
    from dataclasses import asdict

    import log_latency
    from export import is_single_file

    samples = log_latency.samples_of(log)
    rows = log_latency.statistics_of(samples)
    if arguments.json:
        print(json.dumps({name: asdict(row) for name, row in rows.items()}, indent=1))
        return
    print(log_latency.table_text(rows), end="")
    if not arguments.csv:
        return
    is_single = is_single_file(arguments.csv)
    table = arguments.csv if is_single else arguments.csv / "latency.csv"
    write_table(table, log_latency.table_csv(rows).splitlines(), lambda done: None)
    if not is_single:
        lines = log_latency.samples_csv(log, samples).splitlines()
        write_table(arguments.csv / "latency_samples.csv", lines, lambda done: None)


def write_plots(log: Any, arguments: argparse.Namespace, progress: Progress) -> None:
    from log_figures import figures, save

    for name, draw in figures(log, arguments.bitrate):
        progress(f"drawing {name}")
        with replaced(arguments.plots / name) as draft:
            save(draw, draft)
        # To stderr: what a program reads from stdout stays as it is.
        progress.clear()
        print(f"{PROG}: wrote {arguments.plots / name}", file=sys.stderr)


def write_wireshark_folder(arguments: argparse.Namespace) -> None:
    from decode import Protocol
    from wireshark import write_wireshark

    folder = arguments.wireshark
    try:
        write_wireshark(Protocol(arguments.dbc).messages, folder)
        shutil.copyfile(arguments.dbc, folder / "understory.dbc")
    except OSError as error:
        raise OutputError(f"{folder}: cannot write: {error.strerror}") from error
    print(f"{folder}: understory.dbc and a configuration for Wireshark. Try:")
    print(f"  WIRESHARK_CONFIG_DIR={folder} tshark -r FILE -V")


def examine(arguments: argparse.Namespace, progress: Progress) -> int:
    """Returns the exit status."""
    from dataclasses import replace

    from decode import Protocol, decode
    from frame_log import read_log

    protocol = Protocol(arguments.dbc)
    frames = read_log(arguments.file, arguments.interface, progress)
    log = decode(frames, protocol)
    progress.clear()
    for note in frames.notes:
        print(f"{PROG}: note: {note}", file=sys.stderr)
    errors: List[str] = []
    if arguments.view == "summary" or arguments.check:
        summary, text = _summary(log, arguments)
        errors = summary["errors"]
        if arguments.view == "summary":
            print(text, end="")
    if arguments.view == "decode":
        shown = replace(log, zero_ns=0) if arguments.absolute else log
        write_decoded(shown, arguments, progress)
    elif arguments.view == "latency":
        write_latency(log, arguments)
    if arguments.plots:
        write_plots(log, arguments, progress)
    progress.clear()
    return 1 if arguments.check and errors else 0


def _summary(log: Any, arguments: argparse.Namespace) -> Tuple[Any, str]:
    from summary import page, summary_of

    summary = summary_of(log, arguments.bitrate)
    if arguments.json:
        return summary, json.dumps(summary, indent=1) + "\n"
    return summary, page(str(arguments.file), summary)


def main(words: List[str]) -> int:
    """Returns the exit status."""
    arguments = parse_arguments(words)
    # Here, not above: help and wrong use need no NumPy, and an interrupt meanwhile no traceback.
    from decode import DBC, LayoutError
    from frame_log import LogError

    arguments.dbc = arguments.dbc or DBC
    if str(arguments.file) == "-":
        arguments.file = pathlib.Path("/dev/stdin")

    progress = Progress()
    try:
        if arguments.wireshark:
            write_wireshark_folder(arguments)
            return 0
        return examine(arguments, progress)
    except (LogError, LayoutError, OutputError) as error:
        progress.clear()
        print(f"{PROG}: {error}", file=sys.stderr)
        return 2


if __name__ == "__main__":
    signal.signal(signal.SIGPIPE, signal.SIG_DFL)  # `| head` ends it as it ends candump
    try:
        sys.exit(main(sys.argv[1:]))
    except KeyboardInterrupt:
        if sys.stderr.isatty():
            print(file=sys.stderr)  # not beside a line that shows progress
        # Not sys.exit: what is buffered for stdout is no longer wanted.
        os._exit(130)
