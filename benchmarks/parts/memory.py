# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Memory: the core's peak beyond the cloud that it is given, and the pipeline's over thousands of frames."""

from __future__ import annotations

from statistics import median

from benchmarks import child, synthetic
from benchmarks.parts.frames import run_frame
from benchmarks.recordings import frames, source, whole_frame
from benchmarks.results import Result, Setting, Table
from topo_region_seg.params import Params
from topo_region_seg.pipeline import Pipeline, warm_up

TITLE = "6. Memory"
BYTES_PER_POINT, FIXED_MB = 250, 50.0
SAMPLE_EVERY = 24  # frames; a multiple of the number of frames, so that the same one has just been answered
GROWTH_MB = 2.0
"""What may be chance: pages that the allocator keeps."""

SIZES = ((26_000, 0.03), (200_000, 0.02), (800_000, 0.02))


def measure(setting: Setting) -> Result:
    """Measure in processes of their own."""
    result = Result()
    rows = []
    for n, radius in setting.choose(SIZES, SIZES[:1]):
        rows.append(_peak(result, n, radius))
    rows.append(_peak(result, 0, 0.02))
    result.tables.append(Table("The core's peak", ["cloud", "points", "peak (MB)", "bytes per point"], rows))
    count = setting.choose(2016, 96)
    resident = child.call("parts.memory", "resident_over", count=count)
    quarter = len(resident) // 4
    growth = median(resident[-quarter:]) - median(resident[quarter : 2 * quarter])
    goal = f"no growth over {count:,} frames (last quarter to second quarter, to {GROWTH_MB:g} MB)"
    result.at_most(goal, f"{source()} 640x480 frames", growth / 1e6, GROWTH_MB, "MB", 2)
    result.data["resident"] = {"every": SAMPLE_EVERY, "megabytes": [round(value / 1e6, 2) for value in resident]}
    return result


def _peak(result: Result, n: int, radius: float) -> list[str]:
    found = child.call("parts.memory", "core_peak", n=n, radius=radius)
    name, n, peak = found["name"], found["points"], found["peak"]
    goal = f"core peak at most {BYTES_PER_POINT} bytes per point + {FIXED_MB:g} MB"
    limit = BYTES_PER_POINT * n / 1e6 + FIXED_MB
    result.at_most(f"{goal} ({limit:,.0f} MB)", f"{name}, R = {radius:g} m", peak / 1e6, limit, "MB")
    result.data[name] = found
    return [name, f"{n:,}", f"{peak / 1e6:,.1f}", f"{peak / n:,.0f}"]


def core_peak(n: int, radius: float) -> dict[str, int | str]:
    """Return the most bytes that the core takes beyond its input: a made cloud, or the largest frame if `n` is 0."""
    params = Params(max_radius=radius)
    warm_up()
    points = synthetic.objects(n, 0.002) if n else whole_frame(max(frames(), key=lambda frame: frame.valid()))
    name = points.name if n else f"whole {points.name}, {len(points):,} points"
    child.reset_peak()
    before, _ = child.memory()
    points.components(params)
    _, peak = child.memory()
    return {"name": name, "points": len(points), "peak": peak - before}


def resident_over(count: int) -> list[int]:
    """Answer `count` frames; return the resident memory after every few, bytes."""
    pipeline = Pipeline()
    warm_up()
    every = frames()
    resident = []
    for number in range(count):
        run_frame(every[number % len(every)], pipeline)
        if (number + 1) % SAMPLE_EVERY == 0:
            resident.append(child.memory()[0])
    return resident
