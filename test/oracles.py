# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Independent answers to what the core computes, by SciPy, GUDHI and brute force; and clouds to ask about."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components, minimum_spanning_tree
from scipy.spatial import cKDTree

from topo_region_seg.api import persistent_components
from topo_region_seg.beyond.objects.convexity import Borders
from topo_region_seg.params import Params

Array = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Points:
    """Positions (m), CIELAB colors and unit normals, all (N, 3)."""

    xyz: Array
    lab: Array
    normals: Array

    def __len__(self) -> int:
        return len(self.xyz)

    def take(self, rows: npt.NDArray[np.int64]) -> Points:
        return Points(self.xyz[rows], self.lab[rows], self.normals[rows])


def unit(vectors: Array) -> Array:
    return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)


def random_points(seed: int, n: int) -> Points:
    """A cloud of one of several shapes, with colors and normals that the criterion tells apart in part."""
    rng = np.random.default_rng(seed)
    kind = seed % 4
    if kind == 0:  # a filled cube
        xyz = rng.random((n, 3)) * 0.08
    elif kind == 1:  # a noisy wavy surface
        x, y = rng.random((2, n)) * 0.15
        xyz = np.column_stack([x, y, 0.8 + 0.01 * np.sin(50.0 * x) + rng.normal(0.0, 0.0005, n)])
    elif kind == 2:  # clusters of very different density
        centers = rng.random((8, 3)) * 0.1
        which = rng.integers(0, 8, n)
        xyz = centers[which] + rng.normal(size=(n, 3)) * (10.0 ** rng.uniform(-5.0, -2.0, 8))[which, None]
    else:  # a lattice, full of equal distances, with points that coincide
        xyz = rng.integers(0, 12, (n, 3)) * 0.004
    lab = np.array([50.0, 0.0, 0.0]) + rng.normal(size=(n, 3)) * 4.0 + 30.0 * rng.integers(0, 2, (n, 1))
    normals = unit(np.array([0.0, 0.0, -1.0]) + rng.normal(size=(n, 3)) * 0.05)
    return Points(xyz, lab, normals)


def homogeneous_edges(points: Points, params: Params) -> tuple[npt.NDArray[np.int64], Array]:
    """All edges (M, 2) of the graph at `max_radius`, and their lengths (M,), by a list of all pairs."""
    i, j = cKDTree(points.xyz).query_pairs(params.max_radius, output_type="ndarray").T
    keep = np.ones(len(i), bool)
    if params.features != "normals":
        difference = np.linalg.norm(points.lab[i] - points.lab[j], axis=1)
        keep &= (difference >= params.min_color_threshold) & (difference <= params.color_threshold)
    if params.features != "color":
        cosine = np.clip((points.normals[i] * points.normals[j]).sum(axis=1), -1.0, 1.0)
        angle = np.degrees(np.arccos(cosine))
        keep &= (angle >= params.min_angle_threshold) & (angle <= params.angle_threshold)
    pairs = np.column_stack([i, j])[keep]
    return pairs, np.linalg.norm(points.xyz[pairs[:, 0]] - points.xyz[pairs[:, 1]], axis=1)


def partition(n: int, pairs: npt.NDArray[np.int64]) -> npt.NDArray[np.int64]:
    """Smallest point id of each point's component (N,)."""
    graph = coo_matrix((np.ones(len(pairs)), pairs.T), shape=(n, n))
    _, label = connected_components(graph, directed=False)
    smallest = np.full(label.max(initial=-1) + 1, n)
    np.minimum.at(smallest, label, np.arange(n))
    return smallest[label]


def scipy_deaths(n: int, pairs: npt.NDArray[np.int64], lengths: Array) -> Array:
    """Sorted finite deaths: edge lengths of the minimum spanning forest."""
    # Explicit zeros would vanish from a sparse matrix: lengths are shifted, and shifted back.
    forest = minimum_spanning_tree(coo_matrix((lengths + 1.0, pairs.T), shape=(n, n)).tocsr())
    return np.sort(forest.data) - 1.0


def gudhi_deaths(n: int, pairs: npt.NDArray[np.int64], lengths: Array) -> Array:
    """Sorted finite H0 deaths of the edge-weighted graph, zero-length bars included, by GUDHI."""
    import gudhi

    complex_ = gudhi.SimplexTree()
    for vertex in range(n):
        complex_.insert([vertex], 0.0)
    complex_.insert_batch(pairs.T.copy(), lengths)
    complex_.compute_persistence(homology_coeff_field=2, min_persistence=-1.0, persistence_dim_max=False)
    bars = complex_.persistence_intervals_in_dimension(0)
    return np.sort(bars[np.isfinite(bars[:, 1]), 1])


def elder_rule_deaths(n: int, pairs: npt.NDArray[np.int64], lengths: Array) -> Array:
    """Death (N,) of every point by a plain Kruskal with the elder rule."""
    parent = list(range(n))
    death = np.full(n, np.inf)

    def find(point: int) -> int:
        while parent[point] != point:
            point = parent[point]
        return point

    for edge in np.argsort(lengths, kind="stable"):
        a, b = sorted(find(int(point)) for point in pairs[edge])
        if a != b:
            parent[b] = a
            death[b] = lengths[edge]
    return death


def same_partition(a: npt.NDArray[np.int64], b: npt.NDArray[np.int64]) -> bool:
    """Whether two labelings group the points alike, whatever the names of the groups."""
    pairs = np.unique(np.column_stack([a, b]), axis=0)
    return len(pairs) == len(np.unique(a)) == len(np.unique(b))


def check_against_oracles(points: Points, params: Params, steps: int = 10) -> None:
    """Assert that roots, exact deaths and the counts at all steps are what SciPy, GUDHI and a plain Kruskal find."""
    result = persistent_components(points.xyz, points.lab, points.normals, params)
    n = len(points)
    pairs, lengths = homogeneous_edges(points, params)
    finite = np.sort(result.death[np.isfinite(result.death)])
    np.testing.assert_array_equal(result.root, partition(n, pairs))
    np.testing.assert_allclose(finite, scipy_deaths(n, pairs, lengths), rtol=0, atol=1e-15)
    np.testing.assert_array_equal(finite, gudhi_deaths(n, pairs, lengths))
    np.testing.assert_array_equal(result.death, elder_rule_deaths(n, pairs, lengths))
    for scale, count in zip(result.scales(steps), result.counts(steps), strict=True):
        assert count == len(np.unique(partition(n, pairs[lengths <= scale])))


def unite_by_hand(borders: Borders, body: npt.NDArray[np.bool_], share: float) -> npt.NDArray[np.int64]:
    """Judge all borders of the present groups, unite those of the surest, and begin again."""
    group = np.arange(len(body))
    while True:
        sums: dict[tuple[int, int], Array] = {}
        for a, b, pairs, convex in zip(borders.first, borders.second, borders.pairs, borders.convex, strict=True):
            low, high = sorted((int(group[a]), int(group[b])))
            if body[a] and body[b] and low != high:
                sums[low, high] = sums.get((low, high), np.zeros(2)) + (pairs, convex)
        sure = []
        for border, (pairs, convex) in sums.items():
            if pairs >= 20.0 and convex / pairs > share:
                # Wilson's standard error, with twenty pairs for one that is independent.
                n, p = pairs / 20.0, convex / pairs
                sure.append((p - np.sqrt(p * (1.0 - p) / n + 1.0 / (4.0 * n * n)), border))
        if not sure:
            return group
        _, (a, b) = max(sure)
        group[group == b] = a
