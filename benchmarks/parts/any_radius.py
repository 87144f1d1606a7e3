# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The core by position alone at radii from a few spacings to unbounded, beside a Euclidean minimum spanning tree.

What dies, and when, is the tree's edges up to the radius, so a program for such trees answers the same question at the
unbounded radius. Compared is CPU time: programs keep different numbers of threads busy.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from statistics import median
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from benchmarks import checks, peers
from benchmarks.points import FloatArray, single
from benchmarks.recordings import frames, whole_frame
from benchmarks.results import Result, Setting, Table
from topo_region_seg.data import Components
from topo_region_seg.growth import growth_of_regions
from topo_region_seg.params import Params
from topo_region_seg.steps.filtration.persistence import filtration
from topo_region_seg.steps.homogeneity import criterion, homogeneity_channels

TITLE = "10. Any radius, by position alone"
SPACINGS = (3.0, 30.0, 300.0)
"""Radii, as multiples of the median distance of nearest points; after them the unbounded one."""
SIZES = (30_000, 200_000, 1_000_000)
WORKING_LIMIT, LIMIT = 1.0, 2.0
GROWTH = growth_of_regions(Params(features="color"))
"""All points have the same color, so that positions alone are compared."""


def measure(setting: Setting) -> Result:
    """Time the core and the tree on a recorded frame and on made clouds that fill a volume."""
    result, rows = Result(), []
    for name, xyz in _clouds(setting.choose(SIZES, SIZES[:1])):
        spacing = float(np.median(cKDTree(xyz).query(xyz[:: max(1, len(xyz) // 5_000)], k=2)[0][:, 1]))
        radii = [factor * spacing for factor in SPACINGS] + [1e3 * float(np.ptp(xyz, axis=0).max())]
        repeats = setting.choose(5 if len(xyz) <= 200_000 else 3, 3)
        tree_ms, deaths = _cpu_ms(_tree_deaths, repeats, xyz)
        row, times = [name, f"{len(xyz):,}", f"{tree_ms:,.0f}"], []
        for radius in radii:
            ours_ms, found = _cpu_ms(components, repeats, xyz, radius)
            times.append(ours_ms / tree_ms)
            row.append(f"{ours_ms:,.0f} ({times[-1]:.2f})")
        checks.deaths_agree("quitefastmst", deaths, found, 1e-12)
        on = f"{name}, {len(xyz):,} points"
        text = f"CPU time at most {WORKING_LIMIT:g} times the tree's at {SPACINGS[0]:g} spacings"
        result.at_most(text, on, times[0], WORKING_LIMIT, "times", 2)
        result.at_most(f"at most {LIMIT:g} times at any radius", on, max(times), LIMIT, "times", 2)
        result.data[on] = {"tree_ms": tree_ms, "times": times, "radii_m": radii}
        rows.append(row)
    columns = ["cloud", "points", "tree (ms)", *(f"R = {factor:g} spacings" for factor in SPACINGS), "unbounded"]
    result.tables.append(Table("CPU time of quitefastmst and of the core (ms, and times the tree's)", columns, rows))
    result.notes.append("Deaths at the unbounded radius are compared with the lengths of the tree's edges.")
    return result


def components(xyz: FloatArray, radius: float) -> Components:
    """Run the core on positions (N, 3), metres, alone."""
    channels = homogeneity_channels(xyz, np.zeros_like(xyz), None, GROWTH)
    return filtration(channels, criterion(GROWTH, radius), radius)


def _tree_deaths(xyz: FloatArray) -> FloatArray:
    return peers.quitefastmst_lengths(xyz)


def _clouds(sizes: tuple[int, ...]) -> list[tuple[str, FloatArray]]:
    rng = np.random.default_rng(0)
    recorded = whole_frame(frames()[0])
    clouds = [(recorded.name, recorded.xyz)]
    for n in sizes:
        clouds += [("uniform", single(rng.random((n, 3)))), ("Gaussian", single(rng.normal(size=(n, 3))))]
    return clouds


def _cpu_ms(work: Callable[..., Any], repeats: int, *arguments: Any) -> tuple[float, Any]:
    """Return the median CPU time of some runs after one other, ms, and what the last one returned."""
    times, found = [], work(*arguments)
    for _ in range(repeats):
        start = time.process_time()
        found = work(*arguments)
        times.append(1e3 * (time.process_time() - start))
    return median(times), found
