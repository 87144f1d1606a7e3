# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Lengths in units of the spacing and the noise that the sensor leaves, which grow with the distance.

A camera's points are as far apart as the pixel's angle times the depth. In the coordinates (x/z, y/z, ln z) that
spacing is the same everywhere, so one radius serves near and far things alike. Where points lie closer together
than REFERENCE_SPACING lengths stay metres: things nearby keep the regions that they have without `auto`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from topo_region_seg.beyond.auto_scale.neighbors import MOST, ROUNDING, image_neighbors, window_of
from topo_region_seg.compiled.sampling import sample_rows
from topo_region_seg.data import FloatArray, IntArray
from topo_region_seg.growth import REFERENCE_SPACING, Growth
from topo_region_seg.steps.view.camera import (
    NEAREST,
    STRAY,
    evened,
    grid_figures,
    growths,
    seen_from,
    strays_of,
)

SAMPLE = 2_000
"""About how many points show where the camera looks and, where there is no image grid, the spacing and the noise."""
PAIRS = 20_000
"""About how many points of an image grid tell them."""
APART = 4
"""Pixels between the points whose inverse depths tell the noise: as far as points in the neighborhood of a normal are
apart, since cameras smooth over a few pixels."""
AROUND = 48
"""Nearest points whose inverse depths tell the noise where there is no image grid: those up to three pixels away."""
WIDEN = 3.0
"""How many times as long noise may make the radius of normals. More would reach around most things on a table."""
CLEAR = 2.5
"""How many times the noise points must be from the support plane, or from a surface to be none of it."""
THICKEST = 0.05
"""Largest such distance, as a share of the depth: where there are no surfaces, all depth seems to be noise."""


@dataclass(frozen=True)
class LocalUnits:
    """How lengths grow with the distance, and the coordinates in which they do not.

    Parameters
    ----------
    axes : (3, 3) float64
        Orthonormal; rows are the image's right, down, and the middle of the view, in the sensor frame.
    depth : float
        Depth from which on lengths grow with it, metres: points are REFERENCE_SPACING apart there; inf: they do not.
    everywhere : float
        Factor by which lengths grow at least, whatever the depth; 1 unless `depth` is inf.
    noise : float
        Standard deviation of the inverse depth, 1/m. That of the depth is its square times as much.
    middle : float
        Median depth of the cloud, metres.
    """

    axes: FloatArray
    depth: float
    everywhere: float = 1.0
    noise: float = 0.0
    middle: float = 0.0

    def growth(self, xyz: FloatArray) -> FloatArray:
        """Return the factor by which lengths grow at positions (N, 3), metres; (N,), at least 1."""
        return growths(xyz, self.axes[2], self.depth, self.everywhere)

    @property
    def spacing(self) -> float:
        """How far points are apart at the middle depth, in the coordinates of :meth:`at`."""
        return REFERENCE_SPACING * min(1.0, self.growth_of_spacing)

    @property
    def growth_of_spacing(self) -> float:
        """How many times as far as REFERENCE_SPACING points are apart at the middle depth."""
        return self.everywhere if math.isinf(self.depth) else self.middle / self.depth

    @property
    def clear(self) -> float:
        """How far noise takes points from their surface at the middle depth, as a share of that depth."""
        return CLEAR * self.noise * self.middle

    def at(self, xyz: FloatArray) -> FloatArray:
        """Return positions (N, 3) in coordinates in which one length serves all; `xyz` itself if metres do."""
        if np.max(self.growth(xyz), initial=1.0) == 1.0:
            return xyz
        return xyz / self.everywhere if math.isinf(self.depth) else evened(xyz, self.axes, self.depth)

    def normal_radius(self, xyz: FloatArray, growth: Growth) -> FloatArray:
        """Return the radius of the neighborhood that gives each point (N, 3) its normal, (N,), metres.

        It grows as all lengths do, and as far as noise needs it.
        """
        radius = growth.normal_radius * self.growth(xyz)
        return np.maximum(radius, np.minimum(self.noise_radius(xyz, growth), WIDEN * radius))

    def noise_radius(self, xyz: FloatArray, growth: Growth) -> FloatArray:
        """Return the radius from which on noise turns normals by less than half of the largest angle, (N,), metres.

        So two normals of the same plane agree. A plane through n points of noise s, in a disk of radius r, is turned by
        2 s / (r sqrt(n)), where n = pi (r / spacing)^2. Thinning leaves that as it is: means of k points are farther
        apart by the root of k, and less noisy by as much.
        """
        allowed = math.radians(growth.angle[1]) / 2.0
        if self.noise == 0.0 or allowed == 0.0:
            return np.zeros(len(xyz))
        depth = self.depth * growths(xyz, self.axes[2], self.depth, 0.0)
        spacing = REFERENCE_SPACING / self.depth * depth
        radius: FloatArray = np.sqrt(2.0 / math.sqrt(math.pi) * self.noise * depth**2 * spacing / allowed)
        return radius

    def floor_distance(self, growth: Growth) -> float:
        """Return how near to the support plane points belong to it, metres: as far as noise takes them."""
        noisy = min(CLEAR * self.noise * self.middle**2, THICKEST * self.middle)
        return max(growth.floor_distance * self.everywhere, noisy)


def local_units(xyz: FloatArray, rows: IntArray, width: int, height: int, axes: FloatArray | None = None) -> LocalUnits:
    """Return the local units of a cloud.

    Parameters
    ----------
    xyz : (N, 3) float64
        Valid positions, metres, in the sensor frame.
    rows : (N,) int64
        Their pixels; neighbors in a row are neighbors in the image where `height` is above 1.
    width, height : int
        Size of the image grid.
    axes : (3, 3) float64, optional
        Those of the camera, where they are known. Rows: the image's right and down, and the middle of the view.
    """
    chosen = sample_rows(xyz, SAMPLE, 0) if len(xyz) > 1 else np.empty(0, np.int64)
    sample = xyz[chosen]
    if len(sample) < 2:
        return LocalUnits(np.eye(3), math.inf)
    axes, strays = strays_of(sample, axes)
    depth = seen_from(sample, axes)[:, 2]
    if np.mean(strays) > STRAY:
        spacing = float(np.median(cKDTree(xyz).query(sample, k=2)[0][:, 1]))
        return LocalUnits(np.eye(3), math.inf, max(1.0, spacing / REFERENCE_SPACING))
    seen = growths(xyz, axes[2], 1.0, -math.inf) >= NEAREST
    chosen = chosen[~strays & seen[chosen]]
    if not seen.all():
        xyz, rows, chosen = xyz[seen], rows[seen], np.cumsum(seen)[chosen] - 1
    angle, noise = _in_grid(xyz, rows, width, axes) if height > 1 else _in_list(xyz, chosen, axes)
    return LocalUnits(axes, REFERENCE_SPACING / angle if angle > 0.0 else math.inf, 1.0, noise, float(np.median(depth)))


def _in_grid(xyz: FloatArray, rows: IntArray, width: int, axes: FloatArray) -> tuple[float, float]:
    """Return the angle of a pixel, radians, and the noise of the inverse depth, 1/m, from neighbors in the image."""
    angles, bends = grid_figures(xyz, rows, width, axes, APART, max(1, len(xyz) // PAIRS))
    if len(angles) == 0 or len(bends) == 0:
        return float(np.median(angles)) if len(angles) else 0.0, 0.0
    # Of normal noise the median is 0.6745 times the deviation; that of a bend is sqrt(6) times that of a point. What is
    # no plane makes for wide bends, but by far not for half of them.
    return float(np.median(angles)), float(np.median(bends)) / 0.6745 / math.sqrt(6.0)


def _in_list(xyz: FloatArray, chosen: IntArray, axes: FloatArray) -> tuple[float, float]:
    """Return what `_in_grid` does, from planes through the points nearest to `chosen` ones (S,) in the image."""
    k = min(AROUND + 1, len(xyz))
    if k < 2 or len(chosen) == 0:
        return 0.0, 0.0
    seen = seen_from(xyz[chosen], axes)
    nearest, bends, looked = image_neighbors(xyz, axes, chosen, *window_of(seen[:, :2] / seen[:, 2:]), k)
    if looked > MOST * len(chosen):
        nearest, bends = _in_tree(xyz, chosen, axes, k)
    angle = float(np.median(nearest))
    if k <= AROUND or not angle > 0.0:
        return angle, 0.0
    return angle, math.sqrt(float(np.median(bends)) / (AROUND - 2))


def _in_tree(xyz: FloatArray, chosen: IntArray, axes: FloatArray, k: int) -> tuple[FloatArray, FloatArray]:
    """Return what `image_neighbors` does, however crowded the points are."""
    seen = seen_from(xyz, axes)
    image = seen[:, :2] / seen[:, 2:]
    near, found = cKDTree(image).query(image[chosen], k=k)
    unit = np.maximum(near[:, -1:, None], ROUNDING)
    offset = (image[found] - image[chosen][:, None]) / unit
    plane = np.concatenate([offset, np.ones_like(offset[:, :, :1])], axis=2)
    inverse = 1.0 / seen[found, 2:]
    rest = inverse - plane @ (np.linalg.pinv(plane) @ inverse)
    return near[:, 1], (rest**2).sum(axis=(1, 2))
