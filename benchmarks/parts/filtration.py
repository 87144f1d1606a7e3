# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The core against other programs: from positions, colors and normals to components and deaths at ten scales."""

from __future__ import annotations

import importlib
from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt

from benchmarks import checks, pcl_peers, peers, synthetic
from benchmarks.points import Points
from benchmarks.recordings import objects_cut
from benchmarks.results import Result, Setting, Table
from benchmarks.timing import Timing, timed
from topo_region_seg.data import Components
from topo_region_seg.params import Params

TITLE = "1. The core against its peers"
PARAMS = Params(max_radius=0.03, color_threshold=10.0, angle_threshold=5.0, filtration_steps=10)
SPACING = 0.002
DENSE = 0.0008
MANY_EDGES = 10_000_000
"""Edges above which the programs that no goal names are left out: they take minutes."""

NEIGHBORS = 30

CORE = "the core"
SCIPY = "the SciPy program"
PCL = "PCL ConditionalEuclideanClustering, ten runs"
ORGANIZED = "the same, organized search"
PCL_NORMALS = f"PCL NormalEstimationOMP, k = {NEIGHBORS}"

NOTES = (
    f"R = {PARAMS.max_radius} m, dE to {PARAMS.color_threshold:g}, angles to {PARAMS.angle_threshold:g} degrees. "
    "The core and NormalEstimationOMP use two threads; the other programs use one.",
    "SciPy: `query_pairs`, mask, `minimum_spanning_tree`, `connected_components` at each scale. ripser.py and GUDHI "
    "are given the finished list of edges. HDBSCAN and Open3D's DBSCAN answer other questions, from positions alone; "
    "they are here for scale.",
    "PCL's components are compared at every scale, up to the rounding of its single precision. Its search in "
    "organized clouds misses neighbors; the goal is measured against its kd-tree, whose components are the same.",
)


def measure(setting: Setting) -> Result:
    """Measure on made and real clouds of about 10,000 and 26,000 points."""
    result = Result()
    clouds = [(synthetic.objects(10_000, SPACING), 100.0), (objects_cut(10_000), 100.0)]
    if not setting.quick:
        clouds += [(synthetic.objects(26_000, SPACING), 100.0), (objects_cut(28_000), 100.0)]
        clouds += [(synthetic.objects(26_000, DENSE), 250.0)]
    for points, wanted in clouds:
        _measure(points, wanted, setting, result)
    result.notes += NOTES
    return result


def _measure(points: Points, wanted: float, setting: Setting, result: Result) -> None:
    def time_core() -> tuple[Timing, Components]:
        return timed(lambda: points.components(PARAMS), setting.choose(15, 5), 3)

    # Again and again between the others, as the machine's pace changes from one minute to the next.
    core, ours = time_core()
    repeats = setting.choose(3, 1)
    times: dict[str, Timing | str] = {CORE: core}
    edges = _scipy(points, ours, repeats, times)
    core += time_core()[0]
    if len(edges.pairs) <= MANY_EDGES:
        _same_edges(edges, ours, repeats, times)
        _for_scale(points, repeats, times)
    core += time_core()[0]
    _pcl(points, edges, setting, times)
    core += time_core()[0]
    times[CORE] = core

    name = points.name
    for peer, limit in ((SCIPY, wanted), (PCL, 50.0)):
        goal = f"at least {limit:g} times faster than {peer}"
        time = times[peer]
        if isinstance(time, Timing):
            result.at_least(goal, name, time.median / core.median, limit, "times")
        else:
            result.missing(goal, name, time)
    goal, time = f"at most half of {PCL_NORMALS}", times[PCL_NORMALS]
    if isinstance(time, Timing):
        result.at_most(goal, name, core.median / time.median, 0.5, "of it", 2)
    else:
        result.missing(goal, name, time)
    result.tables.append(_table(points, times, ours))
    result.data[name] = {
        peer: time.as_dict() if isinstance(time, Timing) else {"missing": time} for peer, time in times.items()
    }


def _scipy(points: Points, ours: Components, repeats: int, times: dict[str, Timing | str]) -> peers.Edges:
    """Time the SciPy program if it agrees; return the list of all edges."""
    edges = peers.all_edges(points, PARAMS)
    checks.same_partition("SciPy", edges.partition(PARAMS.max_radius), ours.root)
    times[SCIPY], found = timed(lambda: peers.scipy_program(points, PARAMS), repeats, 0)
    checks.counts_agree("SciPy", found.counts, ours.counts(PARAMS.filtration_steps))
    checks.deaths_agree("SciPy", found.deaths, ours, 1e-12)
    return edges


def _same_edges(edges: peers.Edges, ours: Components, repeats: int, times: dict[str, Timing | str]) -> None:
    for name, module, work, rounding in (
        ("ripser.py, edges given", "ripser", peers.ripser_deaths, checks.FLOAT32_ROUNDING),
        ("GUDHI, edges given", "gudhi", peers.gudhi_deaths, 1e-12),
    ):
        found = _try(module, lambda work=work: work(edges), repeats)
        if isinstance(found, str):
            times[name] = found
        else:
            times[name], deaths = found
            checks.deaths_agree(name, deaths, ours, rounding)


def _for_scale(points: Points, repeats: int, times: dict[str, Timing | str]) -> None:
    for name, module, work in (
        ("scikit-learn HDBSCAN, positions only", "sklearn.cluster", peers.hdbscan_labels),
        ("Open3D DBSCAN, positions only, one scale", "open3d", peers.open3d_clusters),
    ):
        found = _try(module, lambda work=work: work(points, PARAMS), repeats)
        if isinstance(found, str):
            times[name] = found
            continue
        times[name], labels = found
        if work is peers.open3d_clusters:
            anything = PARAMS.replace(color_threshold=500.0, angle_threshold=180.0)
            checks.same_partition(name, labels, points.components(anything).root)


def _pcl(points: Points, edges: peers.Edges, setting: Setting, times: dict[str, Timing | str]) -> None:
    try:
        times[PCL], labels = pcl_peers.clusters(points, PARAMS, setting.choose(3, 1), setting.folder)
        for scale, found in zip(peers.scales_of(PARAMS), labels, strict=True):
            if not _equal(found, edges.partition(scale)):
                checks.between(f"PCL at {scale * 1e3:.1f} mm", found, *_rounding_apart(edges, scale))
        times[PCL_NORMALS] = pcl_peers.normals(points, NEIGHBORS, setting.choose(15, 5), setting.folder)
        if points.grid is not None and not setting.quick:
            time, labels = pcl_peers.clusters(points, PARAMS, setting.choose(3, 1), setting.folder, organized=True)
            times[f"{ORGANIZED}{_misses(edges, labels)}"] = time
    except pcl_peers.NoPclError as error:
        times[PCL] = times[PCL_NORMALS] = str(error)


def _misses(edges: peers.Edges, labels: npt.NDArray[np.int32]) -> str:
    """Say what PCL's search in organized clouds, which may miss neighbors, misses."""
    for scale, found in zip(peers.scales_of(PARAMS), labels, strict=True):
        if not _equal(found, exact := edges.partition(scale)):
            n_found, n = len(np.unique(found)), len(np.unique(exact))
            return f" ({n_found} components at {scale * 1e3:.0f} mm, not {n})"
    return ""


def _equal(found: npt.NDArray[np.int32], exact: npt.NDArray[np.int32]) -> bool:
    return checks.refines(found, exact) and checks.refines(exact, found)


def _rounding_apart(edges: peers.Edges, scale: float) -> tuple[npt.NDArray[np.int32], npt.NDArray[np.int32]]:
    low, high = (edges.partition(scale * (1.0 + sign * checks.FLOAT32_ROUNDING)) for sign in (-1.0, 1.0))
    return low, high


def _try(module: str, work: Callable[[], Any], repeats: int) -> tuple[Timing, Any] | str:
    """Time a program, or say that it is not installed."""
    try:
        importlib.import_module(module)
    except (ImportError, OSError) as error:  # a library of the system may be missing too
        return f"not installed: {str(error).splitlines()[0]}"
    return timed(work, repeats, 0)


def _table(points: Points, times: dict[str, Timing | str], ours: Components) -> Table:
    core = times[CORE]
    assert isinstance(core, Timing)
    rows = []
    for name, time in times.items():
        if isinstance(time, Timing):
            rows.append(
                [
                    name,
                    str(len(time.times_ms)),
                    f"{time.best:,.1f}",
                    f"{time.median:,.1f}",
                    f"{time.median / core.median:,.1f}",
                ]
            )
        else:
            rows.append([name, time, "", "", ""])
    counts = ", ".join(map(str, ours.counts(PARAMS.filtration_steps)))
    title = f"{points.name[0].upper()}{points.name[1:]} (components at the ten scales: {counts})"
    return Table(title, ["program", "runs", "best (ms)", "median (ms)", "times the core"], rows)
