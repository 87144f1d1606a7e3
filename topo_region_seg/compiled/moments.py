# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Count, sums and sums of products of points: all that a plane through them needs."""

from __future__ import annotations

from topo_region_seg.compiled.dialect import inlined

NO_MOMENTS = (0.0,) * 10
"""Of no points. In order: count; sums of x, y, z; sums of xx, xy, xz, yy, yz, zz."""


@inlined
def with_point(moments, counts, x, y, z):  # type: ignore[no-untyped-def]
    """Return the ten moments with one more point where it `counts`, without a branch."""
    count, sx, sy, sz, sxx, sxy, sxz, syy, syz, szz = moments
    x, y, z = x if counts else 0.0, y if counts else 0.0, z if counts else 0.0
    return (
        count + (1.0 if counts else 0.0),
        sx + x,
        sy + y,
        sz + z,
        sxx + x * x,
        sxy + x * y,
        sxz + x * z,
        syy + y * y,
        syz + y * z,
        szz + z * z,
    )
