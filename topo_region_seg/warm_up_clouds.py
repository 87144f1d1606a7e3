# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Small made clouds, in whose segmentation all kernels are compiled."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from topo_region_seg.data import FloatArray

SIDE = 40
"""Points along each side of what the made cloud holds."""


def made_cloud() -> tuple[FloatArray, npt.NDArray[np.uint8]]:
    """Return points (2 SIDE² + 1, 3) of a table and a thing on it, and colors without order."""
    side = np.linspace(0.0, 0.5, SIDE)
    x, y = (grid.ravel() for grid in np.meshgrid(side, side))
    table = np.column_stack([x, y, np.full(x.size, 1.0)])
    thing = np.column_stack([0.2 * x, 0.2 * y, np.full(x.size, 0.9)])
    xyz = np.concatenate([table, thing, [[0.9, 0.9, 0.5]]])
    # Such colors leave much to do, so that also what makes room for it is compiled.
    return xyz, np.random.default_rng(0).integers(0, 256, xyz.shape).astype(np.uint8)


def made_frame() -> npt.NDArray[np.float32]:
    """Return an image grid (60, 80, 3) of a table, a box and a cup on it, and a wall, seen from above."""
    y, x = np.mgrid[-0.3:0.3:60j, -0.4:0.4:80j]
    depth = np.full(x.shape, 1.0)
    depth[:, :8] = 0.8 + 0.5 * (x[:, :8] + 0.4)
    depth[20:40, 30:50] = 0.9
    cup = np.hypot(x - 0.25, y) < 0.08
    depth[cup] = 0.85 + 5.0 * (x[cup] - 0.25) ** 2
    depth += np.random.default_rng(0).normal(scale=1e-3, size=depth.shape)
    depth[:2, :2] = np.nan
    return np.stack([x * depth, y * depth, depth], axis=2).astype(np.float32)
