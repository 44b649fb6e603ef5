#!/usr/bin/python3
# Copyright 2026 the Understory authors
# SPDX-License-Identifier: BSD-3-Clause
"""Flies all missions of a table over all cores and writes rows (CSV) and the table (Markdown).

Exit status: 0 every mission completed without collision, 1 not so, 2 wrong use.
"""

import argparse
import concurrent.futures
import os
import pathlib
import shutil
import subprocess
import sys
import threading
import time

import series
import spread
from bench_figures import write_figures
from rows import KEY, append_row, comparison, cost_of_variants, grouped, is_good, markdown
from rows import read_rows, row_of
import team_rows
from table_file import TableError, name_of, quick, read_table

ROOT = pathlib.Path(os.environ["UNDERSTORY_ROOT"])
SIMULATOR = ROOT / "build/src/understory_sim/understory_simulate"


def parse_arguments():
    """The command line."""
    parser = argparse.ArgumentParser(
        prog="understory bench",
        description="Flies all missions of a table over all cores. What is flown already is kept: "
        "after an interrupt the same command goes on.",
    )
    parser.add_argument("--table", required=True, help="name in config/tables, or a YAML file")
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1, help="missions at once")
    parser.add_argument("--out", type=pathlib.Path, help="folder (default: results/bench/NAME)")
    parser.add_argument(
        "--quick", action="store_true",
        help="only the first mission of every other scenario, for each strategy",
    )
    parser.add_argument("--fresh", action="store_true", help="fly all again")
    parser.add_argument(
        "--hosts",
        help="machines to share the missions, as GNU parallel's --sshlogin takes them "
        "(host1,host2; ':' is this one); each has this project, built, at the same path",
    )
    parser.add_argument("--only", metavar="NAME", help="fly one mission and print it as JSON")
    parser.add_argument("--keep-folders", action="store_true", help="keep every result folder")
    arguments = parser.parse_args()
    if arguments.jobs < 1:
        parser.error("--jobs: expected a number from 1")
    return arguments


def table_path(name):
    """Of a table file, or of a name in config/tables."""
    if "/" in name or name.endswith(".yaml"):
        return pathlib.Path(name)
    path = ROOT / "config" / "tables" / f"{name}.yaml"
    if not path.exists():
        names = sorted(found.stem for found in path.parent.glob("*.yaml"))
        raise TableError(f"--table {name}: no such table; there are: {', '.join(names)}")
    return path


class Bench:
    """Missions in flight, and their rows."""

    def __init__(self, folder, keep_folders):
        self.folder = folder
        self.csv = folder / "rows.csv"
        self.keep_folders = keep_folders
        self.commit = os.environ.get("UNDERSTORY_COMMIT", "unknown")
        self.interrupted = threading.Event()
        self.writing = threading.Lock()

    def series_path(self, name):
        """Of a mission's course."""
        return self.folder / "series" / f"{name}.csv"

    def fly(self, mission):
        """(row, course) of one mission; none if the bench was interrupted."""
        if self.interrupted.is_set():
            return None
        out = self.folder / "missions" / mission.name
        words = [str(SIMULATOR), "--scenario", mission.scenario, "--seed", str(mission.seed)]
        words += ["--speed-cap", mission.speed_cap, "--out", str(out), "--quiet", "--no-report"]
        words += ["--strategy", mission.strategy]
        if mission.forest:
            words += ["--forest", mission.forest]
        if mission.settings:
            words += ["--set", mission.settings]
        done = subprocess.run(
            words, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, encoding="utf-8", check=False
        )
        said = done.stdout.strip().splitlines()
        row = row_of(mission, out, said[0] if done.returncode == 2 and said else "", self.commit)
        if row["stop_reason"] == "interrupted":
            return None
        course = series.sampled_of(out)
        if not self.keep_folders and is_good(row):
            shutil.rmtree(out, ignore_errors=True)
        return row, course

    def keep(self, flown):
        """Writes what a mission was; its row."""
        row, course = flown
        with self.writing:
            if course is not None:
                series.write(self.series_path(name_of(row[key] for key in KEY)), course)
            append_row(self.csv, row)
        return row

    def fly_and_keep(self, mission):
        """The row of one mission, written at once; none if the bench was interrupted."""
        flown = self.fly(mission)
        return None if flown is None else self.keep(flown)

    def fly_here(self, missions, jobs):
        """Yields their rows."""
        with concurrent.futures.ThreadPoolExecutor(jobs) as pool:
            flights = [pool.submit(self.fly_and_keep, mission) for mission in missions]
            try:
                for flight in concurrent.futures.as_completed(flights):
                    if flight.result() is not None:
                        yield flight.result()
            except KeyboardInterrupt:
                self.interrupted.set()
                print("\ninterrupted: waiting for the missions in flight", file=sys.stderr)

    def fly_there(self, missions, jobs, hosts, table):
        """Yields their rows; other machines fly them."""
        words = ["env", f"UNDERSTORY_ROOT={ROOT}", f"UNDERSTORY_COMMIT={self.commit}"]
        words += ["/usr/bin/python3", "-B", str(pathlib.Path(__file__).resolve())]
        words += ["--out", str(self.folder.resolve()), "--table", str(table.resolve()), "--only"]
        try:
            for flown in spread.fly([mission.name for mission in missions], hosts, jobs, words):
                yield self.keep(flown)
        except KeyboardInterrupt:
            self.interrupted.set()
            print("\ninterrupted", file=sys.stderr)

    def show_all(self, rows, total):
        """Shows how far it is; true if it was not interrupted."""
        began = time.monotonic()
        good = 0
        for done, row in enumerate(rows, 1):
            good += is_good(row)
            self.show(row, done, total, good, time.monotonic() - began)
        return not self.interrupted.is_set()

    @staticmethod
    def show(row, done, total, good, elapsed_s):
        """One line of progress, in place on a terminal."""
        left_min = elapsed_s / done * (total - done) / 60
        text = (
            f"{done} of {total} flown, {good} good, {left_min:.1f} minutes left; last: "
            f"{' '.join(filter(None, (row[key] for key in KEY)))}: "
            f"{row['completion_time_s'] or row['stop_reason']}"
        )
        in_place = sys.stderr.isatty() and done < total
        print(f"\r\033[K{text}" if sys.stderr.isatty() else text,
              end="" if in_place else "\n", file=sys.stderr, flush=True)


def report(bench, rows, folder):
    """Writes and prints the tables, draws the figures."""
    parts = [markdown(rows), team_rows.markdown(grouped(rows)), comparison(rows)]
    table = "\n".join(filter(None, [*parts, cost_of_variants(rows)]))
    (folder / "table.md").write_text(table, encoding="utf-8")
    print(table, end="")
    courses = {}
    for group, members in grouped(rows).items():
        found = [series.read(bench.series_path(name_of(row[key] for key in KEY)))
                 for row in members]
        courses[group] = [course for course in found if course is not None]
    drawn = write_figures({group: found for group, found in courses.items() if found}, folder)
    for what, path in (("rows", bench.csv), ("table", folder / "table.md"),
                       *(("figure", path) for path in drawn)):
        print(f"{what}: {path.resolve()}")


def fly_only(name, missions, bench):
    """One mission, for who asked for it from another machine; returns the exit status."""
    chosen = [mission for mission in missions if mission.name == name]
    if not chosen:
        print(f"understory bench: --only {name}: no such mission in the table", file=sys.stderr)
        return 2
    flown = bench.fly(chosen[0])
    if flown is None:
        return 1
    print(spread.line_of(*flown))
    return 0 if is_good(flown[0]) else 1


def main():
    """Returns the exit status."""
    arguments = parse_arguments()
    try:
        path = table_path(arguments.table)
        missions = read_table(path, ROOT)
        missions = quick(missions) if arguments.quick else missions
    except TableError as error:
        print(f"understory bench: {error}", file=sys.stderr)
        return 2
    folder = arguments.out or pathlib.Path("results/bench") / path.stem
    try:
        if arguments.fresh:
            shutil.rmtree(folder, ignore_errors=True)
        for name in ("missions", "series"):
            (folder / name).mkdir(parents=True, exist_ok=True)
        bench = Bench(folder, arguments.keep_folders)
        if arguments.only:
            return fly_only(arguments.only, missions, bench)
        flown = read_rows(bench.csv)
    except OSError as error:
        print(f"understory bench: {folder}: {error.strerror}", file=sys.stderr)
        return 2
    todo = [mission for mission in missions if mission.key not in flown]
    if len(todo) < len(missions):
        print(f"{len(missions) - len(todo)} of {len(missions)} are in {bench.csv} already "
              "(--fresh flies them again)", file=sys.stderr)
    try:
        rows = (
            bench.fly_there(todo, arguments.jobs, arguments.hosts, path)
            if arguments.hosts
            else bench.fly_here(todo, arguments.jobs)
        )
        finished = bench.show_all(rows, len(todo))
    except OSError as error:
        print(f"understory bench: {error}", file=sys.stderr)
        return 2
    kept = read_rows(bench.csv)
    rows = [kept[mission.key] for mission in missions if mission.key in kept]
    report(bench, rows, folder)
    good = sum(is_good(row) for row in rows)
    print(f"{good} of {len(missions)} completed without collision")
    return 0 if finished and good == len(missions) else 1


if __name__ == "__main__":
    sys.exit(main())
