#!/usr/bin/python3
# Copyright 2026 the Understory authors
# SPDX-License-Identifier: BSD-3-Clause
"""Says how long the stages of the onboard pipeline took in one run, and checks a budget.

Exit status: 0 done, 1 over budget, 2 wrong use or a trace that cannot be read.
"""

import argparse
import contextlib
import io
import os
import pathlib
import sys
from typing import Dict, List

from budget_file import Budget, BudgetError, excesses, read_budget
from latency_rows import (
    KNOWN_ROWS,
    Statistics,
    csv_text,
    dropped_frames,
    statistics_of,
    table_text,
)
from trace_events import trace_event_json
from trace_file import Trace, TraceError, read_trace

DESCRIPTION = """\
Reads RESULT/trace.csv, which the onboard pipeline writes, prints how long each stage took, how long
frames waited between stages and how long they took end to end, and writes latency.csv, latency.png
and trace.json, which https://ui.perfetto.dev opens."""
EPILOG = """\
The budget is a YAML file of rows of the table and limits in milliseconds, such as
config/latency_budget.yaml:

  exposure_to_trajectory: {p99_ms: 50}
  wakeup: {p99_ms: 1, max_ms: 20}

Limits: mean_ms, p50_ms, p90_ms, p99_ms, max_ms. Exit status 1 if one is exceeded, or if a row of
the budget has no samples."""


class OutputError(Exception):
    """A file that cannot be written; the message names it."""


class Parser(argparse.ArgumentParser):
    """Says in one line what is wrong."""

    def error(self, message):
        self.exit(2, f"understory latency: {message} (see understory latency --help)\n")


def parse_arguments(words: List[str]) -> argparse.Namespace:
    parser = Parser(
        prog="understory latency",
        usage="understory latency [--budget FILE] [--out DIR] RESULT",
        description=DESCRIPTION,
        epilog=EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("result", type=pathlib.Path, metavar="RESULT", help="folder of one run")
    parser.add_argument("--budget", type=pathlib.Path, metavar="FILE", help="limits to be kept")
    parser.add_argument(
        "--out", type=pathlib.Path, metavar="DIR", help="where to write (default: RESULT)"
    )
    return parser.parse_args(words)


def read_result(folder: pathlib.Path) -> Trace:
    if not folder.is_dir():
        raise TraceError(f"{folder}: not a folder")
    return read_trace(folder / "trace.csv")


def write_whole(path: pathlib.Path, content: bytes) -> None:
    """Replaces the file as a whole or leaves it as it was."""
    draft = path.with_name(path.name + ".part")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        draft.write_bytes(content)
        os.replace(draft, path)
    except OSError as error:
        with contextlib.suppress(OSError):
            draft.unlink()
        raise OutputError(f"{path}: cannot write: {error.strerror}") from error


def figure_png(trace: Trace, budget: Budget) -> bytes:
    # Here, not above: help and wrong use need no Matplotlib, which takes a second.
    from latency_figure import draw_latency

    buffer = io.BytesIO()
    # Without the version note, the same trace gives the same bytes.
    draw_latency(trace, budget).savefig(buffer, format="png", metadata={"Software": None})
    return buffer.getvalue()


def print_frames(trace: Trace) -> None:
    dropped, images = dropped_frames(trace)
    print(f"\nframes with an image: {images}, of these without a map (dropped): {dropped}")


def over_budget(path: pathlib.Path, budget: Budget, statistics: Dict[str, Statistics]) -> bool:
    """Says what is; whether anything is."""
    found = excesses(budget, statistics)
    for line in found:
        print(f"over budget: {line}")
    if not found:
        print(f"within the budget of {path}")
    return bool(found)


def main(words: List[str]) -> int:
    """Returns the exit status."""
    arguments = parse_arguments(words)
    folder = arguments.out or arguments.result
    try:
        trace = read_result(arguments.result)
        statistics = statistics_of(trace)
        budget = {}
        if arguments.budget:
            budget = read_budget(arguments.budget, list(dict.fromkeys([*statistics, *KNOWN_ROWS])))
        write_whole(folder / "latency.csv", csv_text(statistics).encode("ascii"))
        write_whole(folder / "trace.json", trace_event_json(trace).encode("ascii"))
        write_whole(folder / "latency.png", figure_png(trace, budget))
    except (TraceError, BudgetError, OutputError) as error:
        print(f"understory latency: {error}", file=sys.stderr)
        return 2
    for note in trace.notes:
        print(f"understory latency: note: {note}", file=sys.stderr)
    print(table_text(statistics), end="")
    print_frames(trace)
    for name in ("latency.csv", "latency.png", "trace.json"):
        print(f"{name.split('.')[-1]}: {(folder / name).resolve()}")
    return 1 if budget and over_budget(arguments.budget, budget, statistics) else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
