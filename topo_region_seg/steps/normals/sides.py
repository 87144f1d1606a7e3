# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Normals from one side of a crease.

The neighborhood of a point near a crease holds points of both sides, so that normals turn over it little by little.
Here a point takes the normals of the neighborhoods around that are flat and that it lies on: those that do not reach
over the crease. It is what Kuwahara's filter does to images (here in the form of Papari, Petkov and Campisi,
Artistic edge and corner enhancing smoothing, IEEE TIP 2007), with planes in place of means.
"""

from __future__ import annotations

import numpy as np

from topo_region_seg.compiled.boxes import LOWER
from topo_region_seg.compiled.dialect import index, inlined, kernel, summing
from topo_region_seg.compiled.kd_tree import LEAF, Tree
from topo_region_seg.compiled.leaf_blocks import leaf_blocks
from topo_region_seg.compiled.near_lists import NearLists
from topo_region_seg.compiled.threads import in_parts, side_by_side
from topo_region_seg.compiled.walks import new_walk, next_leaf
from topo_region_seg.data import FloatArray
from topo_region_seg.steps.normals.estimate import fitted_planes

SHARPNESS = 6
"""Power of the flatness with which a neighborhood weighs. Noise makes the variance of 90 points differ by a sixth from
one neighborhood to the next, which weighs 2.5 times; across a crease it is several times as large."""
HOLDS = 2.0
"""Standard deviations of its heights up to which a plane holds a point."""
FLAT_SHARE, FLAT_PART = 0.25, 0.25
"""Flat is a neighborhood whose variance is at most this part of that below which this share of all lie: to be flatter
brings nothing."""
FLATTEST = 0.03
"""Deviation of heights, as a share of the radius, that is flat in any case. Without it normals of exact points would
all be taken from where a curved thing is seen least, its outline."""
LEAST_WEIGHT = 1e-30
"""Weight of the least flat neighborhoods, so that single precision can tell it from nothing."""
CHANNELS = 9  # position, normal, height, tolerance, weight
CHUNK = 512  # candidates gathered before they are summed; a multiple of LEAF


def sided_normals(
    xyz: FloatArray, tree: Tree, radius: float | FloatArray, min_neighbors: int, near: NearLists | None = None
) -> FloatArray:
    """Return the unit normals of the points, each from one side of a crease, turned towards the sensor at the origin.

    Arguments and result are those of :func:`topo_region_seg.steps.normals.estimate.estimate_normals`. The normal of a
    point p is the direction of ``sum(w_q * n_q)`` over the points q within the radius whose planes hold p: those of
    which p is no farther away than HOLDS ``sqrt(v_q + v_0)``. Here n_q is the normal of q's own neighborhood, v_q the
    variance of its heights over its plane, ``w_q = (v_0 / (v_q + v_0)) ** SHARPNESS``, and v_0 what counts as flat in
    the cloud. A point that no plane holds keeps the normal of its own neighborhood.
    """
    normals, planes = fitted_planes(xyz, tree, radius, min_neighbors, near)
    reach = np.ascontiguousarray(np.broadcast_to(np.float64(radius), len(xyz)))
    height, variance = planes.T
    known = np.isfinite(variance)
    if not known.any():
        return normals
    flat: FloatArray = flat_variance(variance[known]) + (FLATTEST * reach) ** 2
    tolerance = HOLDS * np.sqrt(variance + flat)
    weight = np.where(known, np.maximum((flat / (variance + flat)) ** SHARPNESS, LEAST_WEIGHT), 0.0)
    blocks = leaf_blocks(tree, xyz, normals, np.column_stack([height, tolerance, weight]))
    found: FloatArray = normals.copy()
    side_by_side(mean_of_sides, [(tree, blocks, reach, first, end, found) for first, end in in_parts(len(tree.start))])
    return found


def flat_variance(variance: FloatArray) -> float:
    """Return the variance of heights (K,), square metres, that counts as flat in the cloud."""
    place = int(FLAT_SHARE * (len(variance) - 1))
    return FLAT_PART * float(np.partition(variance, place)[place])


@kernel
def mean_of_sides(
    tree: Tree, blocks: FloatArray, radius: FloatArray, first_node: int, end_node: int, normals: FloatArray
) -> None:
    """Write the `normals` (N, 3) of the points in the leaves of some nodes, by point id.

    `blocks` (L, 9, LEAF) are positions, normals, heights, tolerances and weights by leaf; `radius` (N,), metres, is
    below 0 for points that keep what they have.
    """
    reach = np.empty(LEAF, np.float32)
    candidates = np.empty((CHANNELS, CHUNK), np.float32)
    own = np.empty((CHANNELS, LEAF), np.float32)
    middle = np.empty(3)
    sums = np.zeros((LEAF, 3))
    walk = new_walk()
    for a in range(first_node, end_node):
        if tree.right[index(a)]:
            continue
        farthest = np.float32(-1.0)
        reach[:] = -1.0
        start, size = tree.start[index(a)], tree.stop[index(a)] - tree.start[index(a)]
        for i in range(size):
            length = radius[index(tree.order[index(start + i)])]
            reach[i] = length * length if length >= 0.0 else -1.0
            farthest = max(farthest, reach[i])
        if farthest < 0.0:
            continue
        # Offsets from the leaf are short enough for float32.
        for c in range(3):
            middle[c] = tree.boxes[0, index(a), LOWER, index(c)]
            for i in range(LEAF):
                own[index(c), index(i)] = blocks[index(start // LEAF), index(c), index(i)] - middle[index(c)]
        sums[:] = 0.0
        gathered = 0
        walk.node[0], walk.gap[0], top = 0, 0.0, 1
        while True:
            b, top = next_leaf(tree, tree.boxes, a, farthest, False, walk, top)
            if b < 0:
                break
            copy_planes(blocks, tree.start[index(b)] // LEAF, middle, candidates, gathered)
            gathered += LEAF
            if gathered == CHUNK:
                add_sides(own, candidates, gathered, reach, sums)
                gathered = 0
        add_sides(own, candidates, gathered, reach, sums)
        for i in range(size):
            point, length = index(tree.order[index(start + i)]), 0.0
            facing = 0.0
            for c in range(3):
                length += sums[i, index(c)] ** 2
                facing += sums[i, index(c)] * blocks[index(start // LEAF), index(c), index(i)]
            if length > 0.0:
                length = np.sqrt(length) if facing <= 0.0 else -np.sqrt(length)
                for c in range(3):
                    normals[point, index(c)] = sums[i, index(c)] / length


@inlined
def copy_planes(blocks, leaf, middle, room, place):  # type: ignore[no-untyped-def]
    """Write a leaf into `room` (9, M) from `place` on, positions as offsets from `middle` (3,).

    What has no plane is put out of reach of all points.
    """
    k = index(leaf)
    for j in range(LEAF):
        at = index(place + j)
        weight = blocks[k, 8, index(j)]
        known = (weight > 0.0) & (weight <= 1.0)
        for c in range(3):
            room[index(c), at] = np.float32(blocks[k, index(c), index(j)] - middle[index(c)] if known else np.inf)
        for c in range(3, CHANNELS):
            room[index(c), at] = np.float32(blocks[k, index(c), index(j)] if known else 0.0)


@summing
def add_sides(own, candidates, n, reach, sums):  # type: ignore[no-untyped-def]
    """Add to `sums` (LEAF, 3) of a leaf's points the weighted normals of the candidates within reach that hold them."""
    nothing = np.float32(0.0)
    for i in range(LEAF):
        x, y, z, within = own[0, i], own[1, i], own[2, i], reach[i]
        u, v, w = nothing, nothing, nothing
        for j in range(n):
            at = index(j)
            dx, dy, dz = x - candidates[0, at], y - candidates[1, at], z - candidates[2, at]
            height = candidates[3, at] * dx + candidates[4, at] * dy + candidates[5, at] * dz + candidates[6, at]
            holds = (dx * dx + dy * dy + dz * dz <= within) & (abs(height) <= candidates[7, at])
            weight = candidates[8, at] if holds else nothing
            u += weight * candidates[3, at]
            v += weight * candidates[4, at]
            w += weight * candidates[5, at]
        sums[i, 0] += u
        sums[i, 1] += v
        sums[i, 2] += w
