# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Normals from the points within a fixed radius, by pairs of tree leaves."""

from __future__ import annotations

import numpy as np

from topo_region_seg.compiled.dialect import borrowed, index, kernel, summing
from topo_region_seg.compiled.kd_tree import LEAF, Tree
from topo_region_seg.compiled.moments import NO_MOMENTS, with_point
from topo_region_seg.compiled.nearest import Near, found_near, near_point, nearest_of_leaf
from topo_region_seg.compiled.walks import new_walk, next_leaf
from topo_region_seg.data import FloatArray, IndexArray, IntArray
from topo_region_seg.steps.normals.fit import fit_normal, heights_of

CHUNK = 512  # candidates gathered before they are summed; a multiple of LEAF


@kernel
def radius_normals(
    tree: Tree,
    blocks: FloatArray,
    radius: FloatArray,
    min_neighbors: int,
    first_node: int,
    end_node: int,
    normals: FloatArray,
    counts: IntArray,
    planes: FloatArray,
) -> None:
    """Fill `normals` (N, 3), towards the origin, and `counts` (N,) of neighbors for the leaves of some nodes.

    Both are by point id, and so is `radius` (N,), metres, which is below 0 for points that get none. The point itself
    counts as a neighbor; a point with fewer than `min_neighbors` of them keeps the normal it has. `planes` (N, 2) takes
    the point's height over its plane, m, and the variance of its neighbors' heights, m².
    """
    reach = np.zeros(LEAF)
    candidates = np.empty((3, CHUNK))
    moments = np.zeros((LEAF, 10))
    walk = new_walk()
    for a in range(first_node, end_node):
        if tree.right[index(a)]:
            continue
        moments[:] = 0.0
        farthest = -1.0
        for i in range(tree.stop[a] - tree.start[a]):
            own_radius = radius[tree.order[tree.start[a] + i]]
            reach[i] = own_radius**2 if own_radius >= 0.0 else -1.0
            farthest = max(farthest, reach[i])
        if farthest < 0.0:
            continue
        own = index(tree.start[a] // LEAF)
        gathered = 0
        walk.node[0], walk.gap[0], top = 0, 0.0, 1
        while True:
            b, top = next_leaf(tree, tree.boxes, a, farthest, False, walk, top)
            if b < 0:
                break
            leaf = index(tree.start[index(b)] // LEAF)
            for c in range(3):
                for j in range(LEAF):
                    candidates[index(c), index(gathered + j)] = blocks[leaf, index(c), index(j)]
            gathered += LEAF
            if gathered == CHUNK:
                add_neighbors(blocks, own, candidates, gathered, reach, moments)
                gathered = 0
        add_neighbors(blocks, own, candidates, gathered, reach, moments)
        for i in range(tree.stop[a] - tree.start[a]):
            point = tree.order[tree.start[a] + i]
            counts[point] = int(moments[i, 0])
            if counts[point] >= min_neighbors:
                fit_normal(moments[i], blocks[own, 0, i], blocks[own, 1, i], blocks[own, 2, i], normals[point])
                heights_of(moments[i], normals[point], planes[point])


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


@kernel
def nearest_normals(
    tree: Tree,
    blocks: FloatArray,
    alone: IndexArray,
    xyz: FloatArray,
    counts: IntArray,
    reach: FloatArray,
    near: Near,
    first_node: int,
    end_node: int,
    normals: FloatArray,
) -> int:
    """Fill the rows of `normals` (N, 3) of the points with too small `counts` (N,) in the leaves of some nodes.

    They come from each point and as many others as `near` has room for, the nearest ones within `reach` (N,), m: points
    with as many `counts`, themselves included, have enough. Points with fewer than two others keep what they have.
    `alone` (N + LEAF,) counts the rows of the tree. Return how many leaves were visited.
    """
    tree, blocks, alone, xyz = borrowed(tree), borrowed(blocks), borrowed(alone), borrowed(xyz)
    near, visited = borrowed(near), 0
    for leaf in range(first_node, end_node):
        if tree.right[index(leaf)]:
            continue
        first, size = tree.start[index(leaf)], tree.stop[index(leaf)] - tree.start[index(leaf)]
        for i in range(size):
            point = tree.order[index(first + i)]
            near.within[index(i)] = reach[point] ** 2 if counts[point] <= near.k and reach[point] >= 0.0 else -1.0
        visited += nearest_of_leaf(tree, blocks, alone, xyz, leaf, near)
        for i in range(size):
            point = tree.order[index(first + i)]
            found = found_near(near, i)
            if found < 2:
                continue
            x, y, z = xyz[point]
            m = with_point(NO_MOMENTS, True, 0.0, 0.0, 0.0)
            for n in range(found):
                other = index(near_point(near, i, n))
                m = with_point(m, True, xyz[other, 0] - x, xyz[other, 1] - y, xyz[other, 2] - z)
            fit_normal(m, x, y, z, normals[point])
    return visited
