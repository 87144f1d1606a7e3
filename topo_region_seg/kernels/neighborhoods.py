# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Normals from the points within a fixed radius, by pairs of tree leaves."""

from __future__ import annotations

import math

import numpy as np

from topo_region_seg.data import FloatArray, IntArray
from topo_region_seg.kernels.borrow import borrowed
from topo_region_seg.kernels.compile import index, kernel, summing
from topo_region_seg.kernels.nearest import nearest_outside
from topo_region_seg.kernels.tree import LEAF, Tree, box_gap

CHUNK = 512  # candidates gathered before they are summed; a multiple of LEAF


@kernel
def leaf_blocks(tree: Tree, xyz: FloatArray) -> FloatArray:
    """Return positions (N, 3) leaf after leaf, coordinate after coordinate; padding is inf."""
    n = len(xyz)
    blocks = np.full((n + LEAF - 1) // LEAF * 3 * LEAF, np.inf)
    for row in range(n):
        leaf = row // LEAF
        for c in range(3):
            blocks[(leaf * 3 + c) * LEAF + row - leaf * LEAF] = xyz[index(tree.order[row]), c]
    return blocks


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
) -> None:
    """Fill `normals` (N, 3), towards the origin, and `counts` (N,) of neighbors for the leaves of some nodes.

    Both are by point id, and so is `radius` (N,), metres. The point itself counts as a neighbor; a point with fewer
    than `min_neighbors` of them keeps the normal it has.
    """
    tree, blocks, radius = borrowed(tree), borrowed(blocks), borrowed(radius)
    normals, counts = borrowed(normals), borrowed(counts)
    reach = np.zeros(LEAF)
    candidates = np.empty(3 * CHUNK)
    moments = np.zeros((LEAF, 10))
    stack = np.empty(128, np.int64)
    for a in range(first_node, end_node):
        if tree.right[index(a)]:
            continue
        moments[:] = 0.0
        farthest = 0.0
        for i in range(tree.stop[a] - tree.start[a]):
            reach[i] = radius[tree.order[tree.start[a] + i]] ** 2
            farthest = max(farthest, reach[i])
        base = tree.start[a] * 3
        gathered = 0
        top = 1
        stack[0] = 0
        while top:
            top -= 1
            b = stack[top]
            if box_gap(tree.boxes, 3, a, b, 0) > farthest:
                continue
            right = tree.right[index(b)]
            if right:
                stack[top], stack[top + 1] = right, b + 1
                top += 2
                continue
            first = np.int64(tree.start[index(b)]) * 3
            for c in range(3):
                for j in range(LEAF):
                    candidates[index(c * CHUNK + gathered + j)] = blocks[index(first + c * LEAF + j)]
            gathered += LEAF
            if gathered == CHUNK:
                add_neighbors(blocks, base, candidates, gathered, reach, moments)
                gathered = 0
        add_neighbors(blocks, base, candidates, gathered, reach, moments)
        for i in range(tree.stop[a] - tree.start[a]):
            point = tree.order[tree.start[a] + i]
            counts[point] = int(moments[i, 0])
            if counts[point] >= min_neighbors:
                fit_normal(
                    moments[i],
                    blocks[base + i],
                    blocks[base + LEAF + i],
                    blocks[base + 2 * LEAF + i],
                    normals[point],
                )


@summing
def add_neighbors(blocks, base, candidates, n, reach, moments):  # type: ignore[no-untyped-def]
    """Add to `moments` (LEAF, 10) of a leaf's points those of the candidates within reach: count, sums, products.

    `reach` (LEAF,) is the square of each point's radius.

    Offsets are from the point itself, which keeps the sums small and so exact.
    """
    for i in range(LEAF):
        x, y, z = blocks[base + i], blocks[base + LEAF + i], blocks[base + 2 * LEAF + i]
        within = reach[i]
        count, sx, sy, sz = 0.0, 0.0, 0.0, 0.0
        sxx, sxy, sxz, syy, syz, szz = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        for j in range(n):
            dx = candidates[index(j)] - x
            dy = candidates[index(CHUNK + j)] - y
            dz = candidates[index(2 * CHUNK + j)] - z
            near = dx * dx + dy * dy + dz * dz <= within
            dx, dy, dz = dx if near else 0.0, dy if near else 0.0, dz if near else 0.0
            count += 1.0 if near else 0.0
            sx += dx
            sy += dy
            sz += dz
            sxx += dx * dx
            sxy += dx * dy
            sxz += dx * dz
            syy += dy * dy
            syz += dy * dz
            szz += dz * dz
        m = moments[i]
        m[0] += count
        m[1] += sx
        m[2] += sy
        m[3] += sz
        m[4] += sxx
        m[5] += sxy
        m[6] += sxz
        m[7] += syy
        m[8] += syz
        m[9] += szz


@kernel
def add_offset(m, dx, dy, dz):  # type: ignore[no-untyped-def]
    """Add one offset to the ten moments `m`."""
    m[0] += 1.0
    m[1] += dx
    m[2] += dy
    m[3] += dz
    m[4] += dx * dx
    m[5] += dx * dy
    m[6] += dx * dz
    m[7] += dy * dy
    m[8] += dy * dz
    m[9] += dz * dz


@kernel
def nearest_normals(
    tree: Tree, xyz: FloatArray, points: IntArray, k: int, reach: FloatArray, normals: FloatArray
) -> None:
    """Fill rows `points` of `normals` (N, 3) from the `k` nearest points, themselves included, within `reach` (N,), m.

    Points with fewer than three of them keep what they have.
    """
    m = np.empty(10)
    near_d2, near = np.empty(k), np.empty(k, np.int64)
    one_region, no_node = np.zeros(len(xyz), np.int64), np.full(len(tree.start), -1)
    for point in points:
        x, y, z = xyz[point]
        m[:] = 0.0
        found = nearest_outside(tree, xyz, one_region, one_region, no_node, point, -1, near_d2, near)
        for n in range(found):
            if near_d2[n] <= reach[point] * reach[point]:
                add_offset(m, xyz[near[n], 0] - x, xyz[near[n], 1] - y, xyz[near[n], 2] - z)
        if m[0] >= 3.0:
            fit_normal(m, x, y, z, normals[point])


@kernel
def fit_normal(m, x, y, z, normal):  # type: ignore[no-untyped-def]
    """Write the unit eigenvector of the smallest eigenvalue of the covariance, turned towards the origin.

    Where the eigenvector is not unique (collinear or coinciding points) the direction of the admissible
    plane that looks most towards the origin is taken, so that the result is finite and always the same.
    """
    mx, my, mz = m[1] / m[0], m[2] / m[0], m[3] / m[0]
    xx = m[4] / m[0] - mx * mx
    xy = m[5] / m[0] - mx * my
    xz = m[6] / m[0] - mx * mz
    yy = m[7] / m[0] - my * my
    yz = m[8] / m[0] - my * mz
    zz = m[9] / m[0] - mz * mz
    scale = xx + yy + zz
    u, v, w = 0.0, 0.0, 0.0
    if scale > 0.0:
        u, v, w = smallest_axis(xx / scale, xy / scale, xz / scale, yy / scale, yz / scale, zz / scale)
    if u == 0.0 and v == 0.0 and w == 0.0:
        u, v, w = facing_axis(xx, xy, xz, yy, yz, zz, x, y, z)
    if u * x + v * y + w * z > 0.0:
        u, v, w = -u, -v, -w
    normal[0], normal[1], normal[2] = u, v, w


@kernel
def smallest_axis(xx, xy, xz, yy, yz, zz):  # type: ignore[no-untyped-def]
    """Return the unit eigenvector of the smallest eigenvalue of a matrix of trace 1; zeros where not unique."""
    q = 1.0 / 3.0
    p2 = (xx - q) ** 2 + (yy - q) ** 2 + (zz - q) ** 2 + 2.0 * (xy * xy + xz * xz + yz * yz)
    p = math.sqrt(p2 / 6.0)
    if p < 1e-12:
        return 0.0, 0.0, 0.0
    a, b, c = (xx - q) / p, (yy - q) / p, (zz - q) / p
    d, e, f = xy / p, xz / p, yz / p
    half_det = 0.5 * (a * (b * c - f * f) - d * (d * c - f * e) + e * (d * f - b * e))
    phi = math.acos(min(1.0, max(-1.0, half_det))) / 3.0
    smallest = q + 2.0 * p * math.cos(phi + 2.0 * math.pi / 3.0)
    # Rows of (matrix - eigenvalue) span the plane across the eigenvector: the longest cross product is it.
    ax, by, cz = xx - smallest, yy - smallest, zz - smallest
    best, u, v, w = 0.0, 0.0, 0.0, 0.0
    u0, v0, w0 = xy * yz - xz * by, xz * xy - ax * yz, ax * by - xy * xy
    u1, v1, w1 = xy * cz - xz * yz, xz * xz - ax * cz, ax * yz - xy * xz
    u2, v2, w2 = by * cz - yz * yz, yz * xz - xy * cz, xy * yz - by * xz
    n0, n1, n2 = u0 * u0 + v0 * v0 + w0 * w0, u1 * u1 + v1 * v1 + w1 * w1, u2 * u2 + v2 * v2 + w2 * w2
    best = max(n0, n1, n2)
    if best < 1e-24:
        return 0.0, 0.0, 0.0
    if n0 == best:
        u, v, w = u0, v0, w0
    elif n1 == best:
        u, v, w = u1, v1, w1
    else:
        u, v, w = u2, v2, w2
    length = math.sqrt(best)
    return u / length, v / length, w / length


@kernel
def facing_axis(xx, xy, xz, yy, yz, zz, x, y, z):  # type: ignore[no-untyped-def]
    """Return the unit direction towards the origin, across the line that the covariance spans (if it spans one)."""
    u, v, w = -x, -y, -z
    lx, ly, lz = xx, xy, xz
    if yy > xx and yy >= zz:
        lx, ly, lz = xy, yy, yz
    elif zz > xx and zz > yy:
        lx, ly, lz = xz, yz, zz
    length2 = lx * lx + ly * ly + lz * lz
    if length2 > 0.0:
        along = (u * lx + v * ly + w * lz) / length2
        u, v, w = u - along * lx, v - along * ly, w - along * lz
    length = math.sqrt(u * u + v * v + w * w)
    if length > 0.0:
        return u / length, v / length, w / length
    # The line passes through the sensor: any direction across it will do, as long as it is always the same.
    if length2 == 0.0:
        return 0.0, 0.0, -1.0
    if abs(lx) <= abs(ly) and abs(lx) <= abs(lz):
        u, v, w = 0.0, lz, -ly
    elif abs(ly) <= abs(lz):
        u, v, w = -lz, 0.0, lx
    else:
        u, v, w = ly, -lx, 0.0
    length = math.sqrt(u * u + v * v + w * w)
    return u / length, v / length, w / length


@kernel
def put_unit(vectors: FloatArray, channels: FloatArray) -> None:
    """Write `vectors` (N, 3) in unit length into the last of `channels` (N, 9); NaN where there is no direction."""
    for i in range(len(vectors)):
        x, y, z = vectors[i, 0], vectors[i, 1], vectors[i, 2]
        length = math.sqrt(x * x + y * y + z * z)
        if not (length > 0.0 and length < np.inf):
            length = np.nan
        channels[i, 6], channels[i, 7], channels[i, 8] = x / length, y / length, z / length
