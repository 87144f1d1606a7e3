# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The core on whole frames, and how its time grows with the number of points."""

from __future__ import annotations

import numpy as np

from benchmarks import checks, peers, synthetic
from benchmarks.recordings import frames, whole_frame
from benchmarks.results import Result, Setting, Table
from benchmarks.timing import timed
from topo_region_seg.params import Params

TITLE = "2. Whole frames, and growth with the number of points"
PARAMS = Params(max_radius=0.02)
SPACING = 0.002
SIZES = (5_000, 10_000, 20_000, 50_000, 100_000, 200_000, 400_000, 800_000)
QUICK_SIZES = (5_000, 20_000, 80_000)
FRAME_LIMIT_MS = 250.0
EXPONENT_LIMIT = 1.15


def measure(setting: Setting) -> Result:
    """Time the core on recorded frames and on made clouds of fixed spacing."""
    result = Result()
    _frames(setting, result)
    _growth(setting, result)
    return result


def _frames(setting: Setting, result: Result) -> None:
    rows, medians = [], []
    chosen = sorted(frames(), key=lambda frame: frame.valid())
    for number, frame in enumerate(chosen[-1:] if setting.quick else chosen):
        points = whole_frame(frame)
        time, ours = timed(lambda points=points: points.components(PARAMS), setting.choose(7, 3))  # type: ignore[misc]
        if number == 0 and not setting.quick:
            edges = peers.all_edges(points, PARAMS)
            checks.same_partition("SciPy", edges.partition(PARAMS.max_radius), ours.root)
            checks.deaths_agree("SciPy", peers.scipy_program(points, PARAMS).deaths, ours, 1e-12)
        medians.append(time.median)
        rows.append([frame.name, f"{len(points):,}", f"{time.best:,.0f}", f"{time.median:,.0f}"])
    sizes = f"{rows[0][1]} to {rows[-1][1]}" if len(rows) > 1 else rows[0][1]
    on = f"whole frames, {sizes} points, R = {PARAMS.max_radius:g} m; the slowest"
    result.at_most(f"core in at most {FRAME_LIMIT_MS:g} ms without thinning", on, max(medians), FRAME_LIMIT_MS, "ms", 0)
    result.tables.append(Table("Whole frames, the core alone", ["frame", "points", "best (ms)", "median (ms)"], rows))


def _growth(setting: Setting, result: Result) -> None:
    sizes = setting.choose(SIZES, QUICK_SIZES)
    medians, rows = [], []
    for n in sizes:
        points = synthetic.objects(n, SPACING)
        repeats = setting.choose(15 if n <= 100_000 else 5, 5)
        time, _ = timed(lambda points=points: points.components(PARAMS), repeats)  # type: ignore[misc]
        medians.append(time.median)
        per_point = time.median * 1e6 / n
        rows.append([f"{n:,}", f"{time.best:,.1f}", f"{time.median:,.1f}", f"{per_point:,.0f}"])
    exponent = float(np.polyfit(np.log(sizes), np.log(medians), 1)[0])
    on = f"made clouds, {sizes[0]:,} to {sizes[-1]:,} points {SPACING * 1e3:g} mm apart, R = {PARAMS.max_radius:g} m"
    result.at_most(f"time grows no steeper than N^{EXPONENT_LIMIT}: exponent", on, exponent, EXPONENT_LIMIT, "", 3)
    result.tables.append(Table("Growth", ["points", "best (ms)", "median (ms)", "ns per point"], rows))
    result.data["growth"] = {"points": list(sizes), "median_ms": medians, "exponent": exponent}
