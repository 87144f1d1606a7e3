# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Normals from the points within a radius, or the nearest ones where these are few, by pairs of tree leaves."""

from __future__ import annotations

import numpy as np

from topo_region_seg.compiled.dialect import borrowed, index, inlined, kernel, summing
from topo_region_seg.compiled.kd_tree import LEAF, Tree
from topo_region_seg.compiled.moments import NO_MOMENTS, with_point
from topo_region_seg.compiled.near_lists import NearLists, keep_list
from topo_region_seg.compiled.nearest import Near, near_distance2, near_point, nearest_of_leaf
from topo_region_seg.compiled.walks import new_walk, next_leaf
from topo_region_seg.data import FloatArray, IndexArray
from topo_region_seg.steps.normals.fit import fit_normal, heights_of

CHUNK = 512  # candidates gathered before they are summed; a multiple of LEAF
CERTAIN = 1.0 + 1e-9  # a squared distance that is larger than another by this factor is so however it is rounded
SEARCH_FIRST, SUM, SEARCH, DONE = range(4)  # what is done for the points of a leaf, in turn


@kernel
def fill_normals(
    tree: Tree,
    blocks: FloatArray,
    alone: IndexArray,
    xyz: FloatArray,
    radius: FloatArray,
    wider: FloatArray,
    min_neighbors: int,
    near: Near,
    lists: NearLists,
    first_node: int,
    end_node: int,
    normals: FloatArray,
    planes: FloatArray,
) -> int:
    """Fill the rows of `normals` (N, 3), towards the origin, of the points in the leaves of some nodes.

    They come from all neighbors within `radius` (N,), m, where these are at least `min_neighbors`, the point itself
    included; else from so many nearest points within `wider` (N,), m. Points with fewer than two others there keep what
    they have, and so do those whose radius is below 0. `alone` (N + LEAF,) counts the rows of the tree. `near` has room
    for `min_neighbors` less one at least. Where there are `lists` those of points with too few neighbors are filled.

    `planes` (N, 2) takes, of points with enough neighbors, the height over their plane, m, and the variance of the
    neighbors' heights, m². Return how many leaves were visited for nearest points.
    """
    tree, blocks, alone, xyz = borrowed(tree), borrowed(blocks), borrowed(alone), borrowed(xyz)
    radius, wider, near, lists = borrowed(radius), borrowed(wider), borrowed(near), borrowed(lists)
    listed = len(lists.row) > 0
    reach, waits = np.zeros(LEAF), np.zeros(LEAF, np.bool_)
    candidates, moments = np.empty((3, CHUNK)), np.zeros((LEAF, 10))
    walk, visited, sparse = new_walk(), 0, False
    for leaf in range(first_node, end_node):
        if tree.right[index(leaf)]:
            continue
        first, size = tree.start[index(leaf)], tree.stop[index(leaf)] - tree.start[index(leaf)]
        farthest, waiting, lacking = -1.0, 0, 0
        for i in range(size):
            own_radius = radius[tree.order[index(first + i)]]
            waits[index(i)] = own_radius >= 0.0
            waiting += waits[index(i)]
            farthest = max(farthest, own_radius**2 if own_radius >= 0.0 else -1.0)
        # Where the leaf before was sparse the nearest points come first: often they show that there are too few.
        for turn in range(SEARCH_FIRST if sparse else SUM, DONE):
            if waiting == 0:
                break
            if turn == SUM:
                for i in range(LEAF):
                    reach[index(i)] = -1.0
                for i in range(size):
                    if waits[index(i)]:
                        reach[index(i)] = radius[tree.order[index(first + i)]] ** 2
                moments[:] = 0.0
                sum_neighbors(tree, blocks, leaf, farthest, reach, candidates, moments, walk)
                for i in range(size):
                    if waits[index(i)] and int(moments[i, 0]) >= min_neighbors:
                        point, own = tree.order[index(first + i)], index(first // LEAF)
                        fit_normal(moments[i], blocks[own, 0, i], blocks[own, 1, i], blocks[own, 2, i], normals[point])
                        heights_of(moments[i], normals[point], planes[point])
                        waits[index(i)] = False
                        waiting -= 1
                continue
            for i in range(size):
                point = tree.order[index(first + i)]
                near.within[index(i)] = max(wider[point], lists.reach) ** 2 if waits[index(i)] else -1.0
            visited += nearest_of_leaf(tree, blocks, alone, xyz, leaf, near)
            for i in range(size):
                point = tree.order[index(first + i)]
                if not waits[index(i)]:
                    continue
                if listed:
                    lists.row[index(point)] = point
                    keep_list(lists, point, near, i)
                # Sums may round distances otherwise, and they decide.
                if turn == SEARCH_FIRST and not too_few(near, i, min_neighbors, radius[point]):
                    continue
                waits[index(i)] = False
                waiting -= 1
                lacking += 1
                fit_to_nearest(xyz, point, near, i, min_neighbors - 1, wider[point] ** 2, normals)
        sparse = 2 * lacking >= size
    return visited


@inlined
def too_few(near, i, min_neighbors, radius):  # type: ignore[no-untyped-def]
    """Whether of the neighbors that are wanted, the i-th itself included, one is certainly outside of the radius."""
    return near_distance2(near, i, min_neighbors - 2) > CERTAIN * radius**2


@inlined
def fit_to_nearest(xyz, point, near, i, wanted, within, normals):  # type: ignore[no-untyped-def]
    """Fit the normal of a point, the i-th, to itself and as many as are `wanted` of those near it, `within` (m²)."""
    x, y, z = xyz[point]
    m = with_point(NO_MOMENTS, True, 0.0, 0.0, 0.0)
    found = 0
    while found < wanted and near_distance2(near, i, found) <= within:
        other = index(near_point(near, i, found))
        m = with_point(m, True, xyz[other, 0] - x, xyz[other, 1] - y, xyz[other, 2] - z)
        found += 1
    if found >= 2:
        fit_normal(m, x, y, z, normals[point])


@inlined
def sum_neighbors(tree, blocks, leaf, farthest, reach, candidates, moments, walk):  # type: ignore[no-untyped-def]
    """Add up the moments of the neighbors of a leaf's points, up to `farthest` (m², squared) away."""
    own = index(tree.start[index(leaf)] // LEAF)
    gathered = 0
    walk.node[0], walk.gap[0], top = 0, 0.0, 1
    while True:
        other, top = next_leaf(tree, tree.boxes, leaf, farthest, False, walk, top)
        if other < 0:
            break
        place = index(tree.start[index(other)] // LEAF)
        for c in range(3):
            for j in range(LEAF):
                candidates[index(c), index(gathered + j)] = blocks[place, index(c), index(j)]
        gathered += LEAF
        if gathered == CHUNK:
            add_neighbors(blocks, own, candidates, gathered, reach, moments)
            gathered = 0
    add_neighbors(blocks, own, candidates, gathered, reach, moments)


@summing
def add_neighbors(blocks, leaf, candidates, n, reach, moments):  # type: ignore[no-untyped-def]
    """Add to `moments` (LEAF, 10) of a leaf's points those of the candidates within reach: count, sums, products.

    `reach` (LEAF,) is the square of each point's radius; below 0: of points that get none.

    Offsets are from the point itself, which keeps the sums small and so exact.
    """
    for i in range(LEAF):
        x, y, z = blocks[leaf, 0, i], blocks[leaf, 1, i], blocks[leaf, 2, i]
        within = reach[i]
        if within < 0.0:
            continue
        found = NO_MOMENTS
        for j in range(n):
            dx = candidates[0, index(j)] - x
            dy = candidates[1, index(j)] - y
            dz = candidates[2, index(j)] - z
            found = with_point(found, dx * dx + dy * dy + dz * dz <= within, dx, dy, dz)
        for k in range(10):
            moments[i, k] += found[k]
