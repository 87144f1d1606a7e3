# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Limits on the differences between two runs."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np

from topo_region_seg.offline.runs.comparison import Comparison


@dataclass(frozen=True)
class Limits:
    """Limits on a comparison; None accepts any value. Limits on a frame hold for every frame.

    Parameters
    ----------
    max_region_change : int
        Change in the number of regions of a frame.
    min_wov, min_ari : float
        Agreement of the regions of a frame.
    max_changed : float
        Share of changed points of a frame.
    max_ms_ratio : float
        Median CPU time per frame of B divided by that of A; of time, where one of them does not know its CPU time.
    max_quality_loss : float
        Mean WOv against the truth of A minus that of B.
    max_unmatched : int
        Number of frames that only one of the runs has.
    """

    max_region_change: int | None = None
    min_wov: float | None = None
    min_ari: float | None = None
    max_changed: float | None = None
    max_ms_ratio: float | None = None
    max_quality_loss: float | None = None
    max_unmatched: int | None = None


def summary(found: Comparison) -> dict[str, float | None]:
    """Return the figures that have limits, by the name of the limit without "max" or "min"; None if unknown."""
    frames = found.frames
    cpu, wall = _ratio([frame.cpu_ms for frame in frames]), _ratio([frame.ms for frame in frames])
    losses = [
        a["wov"] - b["wov"]
        for a, b in (frame.quality for frame in frames)
        if a and b and a["wov"] is not None and b["wov"] is not None
    ]
    return {
        "region_change": max((abs(frame.region_change) for frame in frames), default=None),
        "wov": _extreme(min, [frame.wov for frame in frames]),
        "ari": _extreme(min, [frame.ari for frame in frames]),
        "changed": _extreme(max, [frame.changed for frame in frames]),
        "ms_ratio": wall if cpu is None else cpu,
        "cpu_ms_ratio": cpu,
        "wall_ms_ratio": wall,
        "quality_loss": round(float(np.mean(losses)), 6) if losses else None,
        "unmatched": len(found.only_a) + len(found.only_b),
    }


def broken(found: Comparison, sums: dict[str, float | None], limits: Limits) -> list[str]:
    """Return a line for each exceeded limit; a limit on an unknown figure counts as exceeded."""
    lines = []
    for name in Limits.__dataclass_fields__:
        limit, value = getattr(limits, name), sums[name.partition("_")[2]]
        if limit is None:
            continue
        what = f"--{name.replace('_', '-')} {limit:g}"
        if value is None:
            reason = "the truth is unknown" if name == "max_quality_loss" else "there is nothing to compare"
            lines.append(f"{what}: {reason}")
        elif (value < limit) if name.startswith("min") else (value > limit):
            lines.append(f"{what}: it is {value:g}")
    sizes = [frame for frame in found.frames if frame.changed is None]
    if sizes and (limits.min_wov is not None or limits.min_ari is not None or limits.max_changed is not None):
        lines.append(f"{len(sizes)} frames differ in their number of points, first at {sizes[0].stamp:.3f} s")
    return lines


def _ratio(times: list[dict[str, tuple[float | None, float | None]]]) -> float | None:
    """Return the median total of B divided by that of A, over the frames in which both are known."""
    known = [pair for frame in times if None not in (pair := frame.get("total", (None, None)))]
    if not known:
        return None
    of_a, of_b = np.median(np.array(known, np.float64), axis=0).tolist()
    return round(of_b / of_a, 4) if of_a > 0 else None


def _extreme(pick: Callable[[list[float]], float], values: Iterable[float | None]) -> float | None:
    known = [value for value in values if value is not None]
    return round(pick(known), 6) if known else None
