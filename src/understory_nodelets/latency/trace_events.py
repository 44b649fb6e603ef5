# Copyright 2026 the Understory authors
# SPDX-License-Identifier: BSD-3-Clause
"""A trace as trace-event JSON, which ui.perfetto.dev and chrome://tracing open.

One track per stage. Viewers drop events of a track that overlap: where a stage begins anew before
it has ended (late wake-ups), the later one goes to a further track of the stage.
"""

import json
from typing import Dict, Iterator, List

import numpy as np

from trace_file import Marks, Trace

PROCESS = 1
FIRST_TRACK = 2  # 0 is the idle thread, and that of the number of the process takes its name


def frame_numbers(trace: Trace) -> np.ndarray:
    """Exposures of all frames; the first is frame 0."""
    exposures_ns = np.unique(np.concatenate([m.exposure_ns for m in trace.stages.values()]))
    return exposures_ns[exposures_ns > 0]


def lanes_of(marks: Marks) -> List[int]:
    """For each row the first lane that is free when it begins."""
    free_ns: List[int] = []
    lanes = []
    for begin_ns, end_ns in zip(marks.begin_ns.tolist(), marks.end_ns.tolist()):
        for lane, since_ns in enumerate(free_ns):
            if since_ns <= begin_ns:
                break
        else:
            lane = len(free_ns)
            free_ns.append(0)
        free_ns[lane] = max(begin_ns, end_ns)
        lanes.append(lane)
    return lanes


def trace_event_json(trace: Trace) -> str:
    return '{"displayTimeUnit":"ms","traceEvents":[\n' + ",\n".join(_events(trace)) + "\n]}\n"


def _events(trace: Trace) -> Iterator[str]:
    yield _metadata("process_name", 0, {"name": "understory"})
    exposures_ns = frame_numbers(trace)
    track = FIRST_TRACK
    for stage, marks in trace.stages.items():
        if not marks.count:
            continue
        lanes = lanes_of(marks)
        for lane in range(max(lanes) + 1):
            name = stage if lane == 0 else f"{stage} ({lane + 1})"
            yield _metadata("thread_name", track + lane, {"name": name})
            yield _metadata("thread_sort_index", track + lane, {"sort_index": track + lane})
        rows = zip(
            lanes,
            (marks.begin_ns - trace.first_ns).tolist(),
            np.maximum(marks.end_ns - marks.begin_ns, 0).tolist(),
            np.searchsorted(exposures_ns, marks.exposure_ns).tolist(),
            (marks.exposure_ns > 0).tolist(),
        )
        # Written by hand: a dictionary and json.dumps each take twice as long.
        for lane, begin_ns, duration_ns, frame, has_frame in rows:
            args = f'{{"frame":{frame}}}' if has_frame else "{}"
            yield (
                f'{{"name":"{stage}","ph":"X","pid":{PROCESS},"tid":{track + lane},'
                f'"ts":{_microseconds(begin_ns)},"dur":{_microseconds(duration_ns)},"args":{args}}}'
            )
        track += max(lanes) + 1


def _metadata(name: str, track: int, args: Dict[str, object]) -> str:
    event = {"name": name, "ph": "M", "pid": PROCESS, "tid": track, "args": args}
    return json.dumps(event, separators=(",", ":"))


def _microseconds(duration_ns: int) -> str:
    return f"{duration_ns // 1000}.{duration_ns % 1000:03d}"
