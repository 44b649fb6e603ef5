#!/usr/bin/python3
# Copyright 2026 the Understory authors
# SPDX-License-Identifier: BSD-3-Clause
"""Where the time of a team went, from the ticks of its vehicles.

usage: team_time.py FOLDER...
Each FOLDER has the results of one team's mission. Prints a row for each: seconds per vehicle.
"""

import sys
from pathlib import Path
from typing import Dict, List

import numpy as np
from matplotlib import pyplot
from matplotlib.figure import Figure

from look import BLUE, GREEN, ORANGE, PINK, SKY, TRUNK
from result_folder import FolderError, ResultFolder, read_result_folder

STANDING_MPS = 0.1
USES = {
    "as Explorer": BLUE,
    "as Collector": GREEN,
    "standing": ORANGE,  # turns, waits for its camera or for another vehicle
    "meeting": PINK,  # at home, and on the way there
    "up and home": SKY,
    "down": TRUNK,  # while another was still at it
}


def time_use(ticks: Dict[str, np.ndarray], team_end_s: float) -> Dict[str, float]:
    """Seconds of each of USES; each tick stands for the time to the next one."""
    used = dict.fromkeys(USES, 0.0)
    if not len(ticks["time_s"]):
        return used
    explores = ticks["mission_state"][:-1] == "explore"
    meets = ticks["mission_state"][:-1] == "meet"
    stands = ticks["speed_mps"][:-1] < STANDING_MPS
    collects = ticks["mode"][:-1] == "collector"
    step_s = np.diff(ticks["time_s"])
    used["as Explorer"] = step_s[explores & ~stands & ~collects].sum()
    used["as Collector"] = step_s[explores & ~stands & collects].sum()
    used["standing"] = step_s[explores & stands].sum()
    used["meeting"] = step_s[meets].sum()
    is_down = np.isin(ticks["mission_state"][:-1], ["land", "stopped"])
    used["up and home"] = step_s[~explores & ~meets & ~is_down].sum()
    used["down"] = step_s[is_down].sum() + team_end_s - ticks["time_s"][-1]
    return used


def time_uses(folders: List[ResultFolder]) -> List[Dict[str, float]]:
    """Of all vehicles of a team."""
    ends_s = [folder.ticks["time_s"][-1] for folder in folders if len(folder.ticks["time_s"])]
    return [time_use(folder.ticks, max(ends_s, default=0.0)) for folder in folders]


def draw_times(names: List[str], folders: List[ResultFolder]) -> Figure:
    uses = time_uses(folders)
    figure, axes = pyplot.subplots(figsize=(9.0, 1.0 + 0.45 * len(names)), constrained_layout=True)
    begin_s = np.zeros(len(names))
    for use, colour in USES.items():
        length_s = np.array([used[use] for used in uses])
        axes.barh(names, length_s, left=begin_s, color=colour, label=use)
        begin_s += length_s
    axes.invert_yaxis()
    axes.grid(False)
    axes.set_xlabel("s")
    axes.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0))
    return figure


def main(words: List[str]) -> int:
    if not words or "--help" in words:
        print(__doc__, end="")
        return 0 if words else 2
    print(f"| mission | {' | '.join(USES)} |\n|{'---|' * (len(USES) + 1)}")
    for word in words:
        try:
            found = sorted(Path(word).glob("vehicle_*/ticks.csv"))
            uses = time_uses([read_result_folder(file.parent) for file in found])
        except FolderError as error:
            print(f"team_time.py: {error}", file=sys.stderr)
            return 2
        if not uses:
            print(f"team_time.py: {word}: no team's mission", file=sys.stderr)
            return 2
        means = [f"{sum(used[use] for used in uses) / len(uses):.1f}" for use in USES]
        print(f"| {Path(word).name} | {' | '.join(means)} |")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
