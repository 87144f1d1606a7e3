# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The sensor as one frame shows it: the angle between pixels, and how noisy depths are at each depth.

On a plane the inverse depth changes evenly from pixel to pixel, whatever the camera and the plane. What is left of
three inverse depths in a row, a bend, is noise on most of an image, so the median bend tells it, depth by depth.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from itertools import pairwise

import numpy as np

from topo_region_seg.compiled.dialect import kernel
from topo_region_seg.compiled.order import order_of
from topo_region_seg.data import FloatArray
from topo_region_seg.steps.view.depth_steps import depth_steps
from topo_region_seg.steps.view.grid import ImageGrid, Single
from topo_region_seg.steps.view.table import KNOTS, DepthTable

APART = 4
"""Pixels between the points of a bend: about as far as points in the neighborhood of a normal are apart, since cameras
smooth over a few pixels."""
BENDS = 40_000
"""About how many bends are looked at."""
BINS = 6
"""Depths at which noise is told, each from as many bends."""
FEWEST = 100
"""Bends that tell noise."""
LEAST = 2e-4
"""Least noise of a depth, metres: less is below what files and drivers round to."""
SIXTH = 0.6745 * np.sqrt(6.0)
"""Median of the absolute bend of points with normal noise of 1."""


@dataclass(frozen=True)
class SensorModel:
    """What a frame tells of its sensor.

    Parameters
    ----------
    pixel : float
        Angle between neighboring pixels, radians: points at depth z are ``pixel * z`` apart.
    noise : DepthTable
        Standard deviation of the depth, metres, by depth.
    middle : float
        Median depth, metres.
    valid : float
        Share of the pixels that have a depth.
    image : (P,) float32
        Depths of the pixels, metres.
    """

    pixel: float
    noise: DepthTable
    middle: float
    valid: float
    image: Single = field(repr=False, compare=False)

    @property
    def depths(self) -> FloatArray:
        """Depths of the table's entries, metres, (KNOTS,)."""
        return self.noise.near + np.arange(KNOTS) / self.noise.density

    def noise_at(self, depth: FloatArray | Single) -> FloatArray:
        """Return the standard deviation of depths, metres, of the same shape as `depth`, metres."""
        noise: FloatArray = np.interp(depth, self.depths, self.noise.value)
        return noise

    @cached_property
    def steps(self) -> tuple[FloatArray, FloatArray]:
        """Depths and the step in which depths come there, as `depth_steps` tells them when they are asked for."""
        return depth_steps(self.image)

    def step_at(self, depth: FloatArray | Single) -> FloatArray:
        """Return the step of depths, metres, of the same shape as `depth`, metres; NaN where it cannot be told.

        Nearer and farther than it is told anywhere, it is taken to be that of the last depth where it is.
        """
        at, step = self.steps
        known = np.isfinite(at)
        if not known.any():
            return np.full(np.shape(depth), np.nan)
        found: FloatArray = np.interp(depth, at[known], step[known])
        return found


def sensor_model(grid: ImageGrid) -> SensorModel | None:
    """Return the model of a frame's sensor; None where the image grid is too sparse to tell one."""
    step = max(1, int(np.sqrt(2.0 * grid.height * grid.width / BENDS)))
    angles, bends, depths, valid = grid_bends(grid.xyz, grid.depth, grid.height, grid.width, APART, step)
    if len(bends) < FEWEST or len(angles) < FEWEST:
        return None
    order = order_of(depths)
    bends, depths = bends[order], depths[order]
    bounds = np.linspace(0, len(bends), BINS + 1).astype(int)
    # The middle of a bin, and not its median: what most points lie at must not stand for the whole bin.
    at = np.array([(depths[a] + depths[b - 1]) / 2.0 for a, b in pairwise(bounds)])
    bend = np.array([np.median(bends[a:b]) for a, b in pairwise(bounds)])
    noise = np.maximum(bend / SIXTH * at**2, LEAST)
    near, far = float(depths[0]), max(float(depths[-1]), float(depths[0]) + 1e-3)
    table = DepthTable(near, (KNOTS - 1) / (far - near), np.interp(np.linspace(near, far, KNOTS), at, noise))
    return SensorModel(float(np.median(angles)), table, float(np.median(depths)), valid, grid.depth)


@kernel
def grid_bends(
    xyz: Single, depth: Single, height: int, width: int, apart: int, step: int
) -> tuple[FloatArray, FloatArray, FloatArray, float]:
    """Return angles between pixels (A,), absolute bends of the inverse depth (B,), 1/m, and their depths (B,), metres.

    In addition the share of pixels with a depth. Every `step`-th pixel of every `step`-th row is looked at, with those
    right of it and below.
    """
    room = (height // step + 1) * (width // step + 1)
    angles, bends, depths = np.empty(room), np.empty(2 * room), np.empty(2 * room)
    n_angles, n_bends, n_valid, seen = 0, 0, 0, 0
    for y in range(0, height, step):
        for x in range(0, width, step):
            p = y * width + x
            seen += 1
            z = np.float64(depth[p])
            if not z > 0.0:
                continue
            n_valid += 1
            if x + 1 < width and abs(depth[p + 1] - z) < 0.02 * z:
                dx, dy = xyz[p + 1, 0] / depth[p + 1] - xyz[p, 0] / z, xyz[p + 1, 1] / depth[p + 1] - xyz[p, 1] / z
                dz = xyz[p + 1, 2] / depth[p + 1] - xyz[p, 2] / z
                angles[n_angles] = np.sqrt(dx * dx + dy * dy + dz * dz)
                n_angles += 1
            for stride, room_left in ((1, width - 1 - x), (width, height - 1 - y)):
                if room_left < 2 * apart:
                    continue
                middle, last = np.float64(depth[p + apart * stride]), np.float64(depth[p + 2 * apart * stride])
                if middle > 0.0 and last > 0.0:
                    bends[n_bends] = abs(1.0 / z - 2.0 / middle + 1.0 / last)
                    # Their mean: unlike the depth of one of the points, it has nothing to do with the bend.
                    depths[n_bends] = (z + middle + last) / 3.0
                    n_bends += 1
    return angles[:n_angles].copy(), bends[:n_bends].copy(), depths[:n_bends].copy(), n_valid / max(seen, 1)
