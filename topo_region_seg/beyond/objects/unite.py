# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""From regions to objects: regions whose borders are convex are faces of one body.

What is convex is told by the pairs of points at a border (Stein et al., Object Partitioning using Local Convexity,
CVPR 2014). The surest border is opened first, and the borders of what it unites are judged again, with the pairs of
both. Fragments at edges, where normals are mixed, then go to what is nearest, unless that border is plainly concave,
and so, in the end, do the points in grooves, which are in no region.
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from topo_region_seg.beyond.objects.continuation import regions_along
from topo_region_seg.beyond.objects.convexity import TOLERANCE, Borders, find_borders
from topo_region_seg.beyond.objects.uniting import ENOUGH, unite_convex
from topo_region_seg.compiled.kd_tree import Tree
from topo_region_seg.compiled.leaf_blocks import leaf_blocks
from topo_region_seg.compiled.partition import count_off, uniform_regions
from topo_region_seg.compiled.threads import in_parts, side_by_side
from topo_region_seg.data import BoolArray, FloatArray, IntArray
from topo_region_seg.params import Params

ACROSS = 3.0  # how much more distance off the plane of a neighbor counts than distance along it, for points in grooves
NONE = -1


def unite_objects(
    xyz: FloatArray,
    normals: FloatArray,
    loose: BoolArray,
    tree: Tree,
    root: IntArray,
    weight: IntArray,
    params: Params,
) -> IntArray:
    """Unite the regions that make up an object.

    Parameters
    ----------
    xyz, normals : (N, 3) float64
        Positions, metres, and unit normals; NaN for points without one.
    loose : (N,) bool
        Points that are in no region: those in grooves, and all that have no normal.
    tree : Tree
        Tree over the positions.
    root : (N,) int64
        Smallest point id of each point's component.
    weight : (N,) int64
        Number of input points that each point stands for.
    params : Params
        Uses `object_border_radius`, `object_convexity` and `min_region_size`.

    Returns
    -------
    (N,) int64
        Object of each point, counted from 0 in no particular order; -1 where too few points are left alone.
    """
    region, size = count_off(root, weight)
    borders = _borders(tree, leaf_blocks(tree, xyz, normals), np.where(loose, NONE, region), params)
    body = size >= params.min_region_size
    group = _unite_convex(borders, body, params.object_convexity)
    group = _take_in_fragments(borders, group, size, body, params)
    large = np.bincount(group, weights=size, minlength=len(size)) >= params.min_region_size
    number = np.where(large, np.cumsum(large) - 1, NONE)
    return _take_in_points(xyz, normals, tree, number[group[region]], np.flatnonzero(loose), params)


def _borders(tree: Tree, blocks: FloatArray, region: IntArray, params: Params) -> Borders:
    """Find the borders between all regions, in the halves of the tree and between them."""
    right = int(tree.right[0]) if len(tree.right) else 0
    nodes = [(1, 1), (right, right), (1, right)] if right else [(0, 0)]
    given = tree, blocks, region[tree.order], uniform_regions(tree, region), params.object_border_radius, TOLERANCE
    found = side_by_side(find_borders, [(*given, *pair) for pair in nodes])
    together = Borders(*(np.concatenate(column) for column in zip(*found, strict=True)))
    return Borders(*_between_groups(together, np.arange(int(np.max(region, initial=-1)) + 1)))


def _unite_convex(borders: Borders, body: BoolArray, share: float) -> IntArray:
    """Unite bodies across their convex borders; return the group of each region."""
    between = body[borders.first] & body[borders.second]
    pairs = np.where(between, borders.pairs, 0.0)
    return unite_convex(borders._replace(pairs=pairs, convex=np.where(between, borders.convex, 0.0)), len(body), share)


def _take_in_fragments(borders: Borders, group: IntArray, size: IntArray, body: BoolArray, params: Params) -> IntArray:
    """Unite each fragment with the nearest group, again and again; return the group of each region.

    Fragments that have grown to `min_region_size` together stay apart from what they meet concavely.
    """
    total, whole, step, group = size.astype(np.float64), body, group, np.arange(len(group))
    while True:
        # From here on, groups are what regions were before: there are ever fewer of them.
        step = np.unique(step, return_inverse=True)[1]
        group = step[group]
        total = np.bincount(step, weights=total)
        whole = np.bincount(step, weights=whole) > 0
        borders = Borders(*_between_groups(borders, step))
        a, b, pairs, convex, nearest = borders
        concave = (pairs >= ENOUGH) & (convex < (1.0 - params.object_convexity) * pairs)
        grown = total >= params.min_region_size
        open_ = ~(whole[a] & whole[b]) & ~(concave & grown[a] & grown[b])
        start, end = np.concatenate([a[open_], b[open_]]), np.concatenate([b[open_], a[open_]])
        distance = np.concatenate([nearest[open_], nearest[open_]])
        moves = ~whole[start]
        if not moves.any():
            return group
        start, end, distance = start[moves], end[moves], distance[moves]
        order = np.lexsort((end, -total[end], distance, start))
        chosen = order[np.append(True, np.diff(start[order]) > 0)]
        edges = coo_array((np.ones(len(chosen)), (start[chosen], end[chosen])), (len(total), len(total)))
        step = connected_components(edges, directed=False)[1]


def _take_in_points(
    xyz: FloatArray, normals: FloatArray, tree: Tree, group: IntArray, points: IntArray, params: Params
) -> IntArray:
    """Give each of some points, ids, the group whose surface it continues best, up to `object_border_radius` away.

    In wide grooves those further in follow, until what is left is out of reach of any group.
    """
    nobody = int(np.max(group, initial=NONE)) + 1
    group = np.where(group == NONE, nobody, group)
    group[points] = nobody
    while len(points):
        found, uniform, reach = group.copy(), uniform_regions(tree, group), params.object_border_radius
        given = tree, xyz, normals, group, uniform, nobody, reach, ACROSS, points
        side_by_side(regions_along, [(*given, first, end, found) for first, end in in_parts(len(points))])
        group, left = found, points[found[points] == nobody]
        if len(left) == len(points):
            break
        points = left
    return np.where(group == nobody, NONE, group)


def _between_groups(borders: Borders, group: IntArray) -> tuple[IntArray, IntArray, FloatArray, FloatArray, FloatArray]:
    """Return the borders between groups of regions: the groups, and the sums of what is known of the borders."""
    a, b = group[borders.first], group[borders.second]
    key = np.minimum(a, b) * len(group) + np.maximum(a, b)
    order = np.argsort(key, kind="stable")
    order = order[a[order] != b[order]]
    first = np.flatnonzero(np.diff(key[order], prepend=-1))
    if len(first) == 0:
        return a[:0], b[:0], borders.pairs[:0], borders.convex[:0], borders.nearest[:0]
    low, high = np.divmod(key[order][first], len(group))
    pairs, convex = (np.add.reduceat(column[order], first) for column in (borders.pairs, borders.convex))
    return low, high, pairs, convex, np.minimum.reduceat(borders.nearest[order], first)
