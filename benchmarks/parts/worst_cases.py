# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The core on clouds that make neighborhood searches slow: time and memory beside an ordinary cloud's."""

from __future__ import annotations

import numpy as np

from benchmarks import checks, child, peers, synthetic
from benchmarks.hostile import CLOUDS
from benchmarks.points import Points
from benchmarks.results import Result, Setting, Table
from benchmarks.timing import timed
from topo_region_seg.params import Params
from topo_region_seg.pipeline import warm_up

TITLE = "3. Worst cases"
PARAMS = Params(max_radius=0.03)
ORDINARY = "ordinary"
SIZE, LARGE = 26_000, 200_000
CHECKED = 3_000
"""Points up to which SciPy's list of all pairs fits into memory even where all points are within reach."""

LIMIT = 10.0
BYTES_PER_POINT = 250
FIXED_BYTES = 50e6


def measure(setting: Setting) -> Result:
    """Measure every case in a process of its own."""
    result = Result()
    for name, make in CLOUDS.items():
        _check(make(CHECKED, PARAMS.max_radius), name)
    rows = []
    for n in setting.choose((SIZE, LARGE), (SIZE,)):
        found = {
            name: child.call("parts.worst_cases", "run", name=name, n=n, repeats=setting.choose(7, 3))
            for name in (ORDINARY, *CLOUDS)
        }
        usual = found[ORDINARY]["median_ms"]
        for name, figures in found.items():
            times = figures["median_ms"] / usual
            megabytes = figures["peak_bytes"] / 1e6
            rows.append(
                [figures["name"], f"{n:,}", f"{figures['median_ms']:,.1f}", f"{times:.2f}", f"{megabytes:,.0f}"]
            )
            if name != ORDINARY:
                on = f"{figures['name']}, {n:,} points"
                result.at_most(f"at most {LIMIT:g} times the ordinary time per point", on, times, LIMIT, "times", 2)
                limit = (BYTES_PER_POINT * n + FIXED_BYTES) / 1e6
                result.at_most(f"memory to {BYTES_PER_POINT} bytes per point + 50 MB", on, megabytes, limit, "MB", 0)
        result.data[str(n)] = found
    columns = ["cloud", "points", "median (ms)", "times the ordinary", "peak memory (MB)"]
    result.tables.append(Table("Worst cases", columns, rows))
    result.notes.append(f"Components and deaths of each case are compared with SciPy's on {CHECKED:,} points.")
    return result


def run(name: str, n: int, repeats: int) -> dict[str, float | str]:
    """Time the core on one cloud, and find how much memory it takes beyond the cloud itself."""
    warm_up()
    points = synthetic.objects(n, 0.002) if name == ORDINARY else CLOUDS[name](n, PARAMS.max_radius)
    child.reset_peak()
    before, _ = child.memory()
    points.components(PARAMS)
    _, peak = child.memory()
    time, _ = timed(lambda: points.components(PARAMS), repeats, 0)
    title = "ordinary: made objects" if name == ORDINARY else points.name
    return {"name": title, "median_ms": time.median, "best_ms": time.best, "peak_bytes": peak - before}


def _check(points: Points, name: str) -> None:
    ours = points.components(PARAMS)
    edges = peers.all_edges(points, PARAMS)
    checks.same_partition(f"SciPy, {name}", edges.partition(PARAMS.max_radius), ours.root)
    if name == "identical":
        # A sparse matrix has no place for edges of length zero.
        if np.isfinite(ours.death).sum() != len(points) - 1 or ours.death[np.isfinite(ours.death)].any():
            raise checks.DisagreementError("identical points: the deaths are not zero")
    else:
        checks.deaths_agree(f"SciPy, {name}", peers.scipy_program(points, PARAMS).deaths, ours, 1e-12)
