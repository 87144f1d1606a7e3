# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The adjacency graph of regions, against a list of all pairs of points."""

from __future__ import annotations

import numpy as np
import pytest
from clouds import scene
from oracles import random_points

import topo_region_seg as trs
from topo_region_seg.beyond.adjacency import adjacency
from topo_region_seg.compiled.kd_tree import position_tree


def brute_force(xyz: np.ndarray, labels: np.ndarray, radius: float) -> dict[tuple[int, int], set[tuple[int, int]]]:
    """The pairs of near points of each pair of labels, from all distances; the smaller label first."""
    d2 = ((xyz[:, None] - xyz[None]) ** 2).sum(axis=2)
    found: dict[tuple[int, int], set[tuple[int, int]]] = {}
    for i, j in np.argwhere(d2 <= radius * radius).tolist():
        if 0 < labels[i] < labels[j]:
            found.setdefault((int(labels[i]), int(labels[j])), set()).add((i, j))
    return found


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize("n", [1, 7, 300])
def test_all_borders_are_found_once(seed: int, n: int) -> None:
    points, rng = random_points(seed, n), np.random.default_rng(seed)
    radius = 0.008
    # Half of the clouds in slabs, so that whole nodes have one label; some points without a region.
    labels = rng.integers(0, 5, n) if seed % 2 else 1 + (points.xyz[:, 0] * 60.0).astype(int) % 5
    labels[rng.random(n) < 0.1] = 0
    graph = adjacency(points.xyz, labels.astype(np.uint32), position_tree(points.xyz), radius)
    wanted = brute_force(points.xyz, labels, radius)
    assert [tuple(pair) for pair in graph.pairs.tolist()] == sorted(wanted)
    for place, pair in enumerate(sorted(wanted)):
        own = [tuple(rows) for rows in graph.points[graph.start[place] : graph.start[place + 1]].tolist()]
        assert len(own) == graph.counts[place] == len(wanted[pair])
        assert set(own) == wanted[pair]


def test_of_a_segmentation() -> None:
    xyz, rgb = scene()
    seg = trs.segment(xyz, rgb, trs.Params(remove_floor=False, features="color"))
    graph = seg.adjacency()
    assert graph.pairs.tolist() == [[1, 2]]  # two walls that meet
    assert (seg.labels[seg.index[graph.points]] == [1, 2]).all()
    assert len(seg.adjacency(1e-6)) == 0
    with pytest.raises(ValueError, match="radius is 0"):
        seg.adjacency(0.0)


def test_of_nothing() -> None:
    seg = trs.segment(np.zeros((5, 3)), np.zeros((5, 3), np.uint8))
    graph = seg.adjacency()
    assert graph.pairs.shape == (0, 2) and graph.points.shape == (0, 2) and graph.start.tolist() == [0]
