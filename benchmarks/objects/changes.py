# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Two runs of the benchmark compared, for ablations: means by group, and the frames that changed most."""

from __future__ import annotations

from benchmarks.objects.programs import OURS
from benchmarks.objects.tables import Found, groups, mean

COMPARED = ("wov", "overlap_f", "precision_50", "recall_50", "reported", "cpu_ms")
MOST = 10


def changes(before: Found, after: Found) -> str:
    """Return the means of the frames of both runs, before and after, and the frames whose overlap changed most."""
    both = {
        name: {frame for frame in frames if frame in before[name]} for name, frames in after.items() if name in before
    }
    old, new = (
        {name: {frame: run[name][frame] for frame in run[name] if frame in both[name]} for name in both}
        for run in (before, after)
    )
    lines = [f"{'':60}" + "".join(f"{key:>22}" for key in COMPARED)]
    for group in groups(new):
        frames = group.frames(old, OURS), group.frames(new, OURS)
        pairs = [(mean(frames[0].values(), key), mean(frames[1].values(), key)) for key in COMPARED]
        lines.append(f"{group.title:60.60}" + "".join(f"{_pair(*pair):>22}" for pair in pairs))
    moved = [
        (new[name][frame][OURS]["wov"] - old[name][frame][OURS]["wov"], name, frame)
        for name in both
        for frame in both[name]
        if new[name][frame][OURS]["wov"] is not None and old[name][frame][OURS]["wov"] is not None
    ]
    moved.sort(key=_by_size)
    for change, name, frame in moved[-MOST:][::-1]:
        if change:
            pair = _pair(*(run[name][frame][OURS]["wov"] for run in (old, new)))
            lines.append(f"  {name}: {frame}: WOv {pair.strip()} ({change:+.3f})")
    return "\n".join(lines)


def _by_size(entry: tuple[float, str, str]) -> float:
    return abs(entry[0])


def _pair(a: float | None, b: float | None) -> str:
    return " -> ".join("n/a" if value is None else f"{value:.3f}" for value in (a, b))
