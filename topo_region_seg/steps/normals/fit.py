# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The normal of a neighborhood: the eigenvector of the smallest eigenvalue of its covariance (paper, section IV.C)."""

from __future__ import annotations

import math

from topo_region_seg.compiled.dialect import kernel

ROUNDING = 1e-6
"""Share of a point's distance by which a line may pass beside the sensor and still be taken to pass through it."""
LINE = 1e-7
"""Difference of the two smaller eigenvalues, as a share of their sum, below which a neighborhood is a line: rounding of
their computation is a tenth of it."""
ALIKE = 1.0 + ROUNDING
"""Factor up to which coordinates count as equal, so that the same axis is chosen for all points of a line."""


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
    elif u * x + v * y + w * z > 0.0:
        u, v, w = -u, -v, -w
    normal[0], normal[1], normal[2] = u, v, w


@kernel
def heights_of(m, normal, plane):  # type: ignore[no-untyped-def]
    """Write into `plane` the height of the point that offsets are from, and the variance of all heights, unbiased.

    Heights are those over the plane through the middle of the neighborhood, metres.
    """
    u, v, w = normal[0], normal[1], normal[2]
    mean = (u * m[1] + v * m[2] + w * m[3]) / m[0]
    squares = u * u * m[4] + v * v * m[7] + w * w * m[9] + 2.0 * (u * v * m[5] + u * w * m[6] + v * w * m[8])
    plane[0] = -mean
    plane[1] = max(squares - m[0] * mean * mean, 0.0) / max(m[0] - 3.0, 1.0)


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
    if p * math.sin(phi) < LINE:  # the smallest eigenvalue is double
        return 0.0, 0.0, 0.0
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
    if length > ROUNDING * math.sqrt(x * x + y * y + z * z):
        return u / length, v / length, w / length
    # The line passes through the sensor: any direction across it will do, as long as it is always the same.
    if length2 == 0.0:
        return 0.0, 0.0, -1.0
    if abs(lx) <= ALIKE * abs(ly) and abs(lx) <= ALIKE * abs(lz):
        u, v, w = 0.0, lz, -ly
    elif abs(ly) <= ALIKE * abs(lz):
        u, v, w = -lz, 0.0, lx
    else:
        u, v, w = ly, -lx, 0.0
    length = math.sqrt(u * u + v * v + w * w)
    return u / length, v / length, w / length
