# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""How much color and normals differ between neighboring points, as the pipeline sees them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.spatial import cKDTree

from topo_region_seg.compiled.kd_tree import position_tree
from topo_region_seg.data import Cloud, FloatArray
from topo_region_seg.offline.inspection.points import SAMPLE, known_median, nearest_distance, sample_rows
from topo_region_seg.params import Params
from topo_region_seg.steps.color import srgb_to_lab
from topo_region_seg.steps.crop import crop
from topo_region_seg.steps.normals.estimate import estimate_normals
from topo_region_seg.steps.sensor import known_sensor
from topo_region_seg.steps.support.removal import above
from topo_region_seg.steps.support.search import find_support
from topo_region_seg.steps.thinning.voxels import thin

NEIGHBORS = 4
"""Neighbors that each point is compared with: on a surface, those on its four sides."""


@dataclass(frozen=True)
class Foreground:
    """The points of a cloud that remain to be segmented, before thinning.

    Parameters
    ----------
    xyz : (M, 3) float64
        Positions, metres.
    rgb : (M, 3) uint8 or None
        Colors.
    cropped : int
        Number of points within range, including those on and behind the support plane.
    on_plane : bool
        Whether a support plane was found.
    """

    xyz: FloatArray
    rgb: npt.NDArray[np.uint8] | None
    cropped: int
    on_plane: bool

    def spacing(self) -> float:
        """Return the median distance to the nearest other point, metres; NaN without one."""
        if len(self.xyz) < 2:
            return float("nan")
        sample = self.xyz[sample_rows(len(self.xyz), SAMPLE, 0)]
        return known_median(nearest_distance(cKDTree(self.xyz), sample))


def foreground_of(cloud: Cloud, params: Params) -> Foreground:
    """Crop a cloud and remove its support plane, as the pipeline does."""
    sensor = known_sensor(cloud, params)
    origin = np.zeros(3) if sensor is None else sensor.position
    rows = crop(cloud.xyz, origin, params)
    xyz = cloud.xyz[rows].astype(np.float64) - origin
    cropped = len(xyz)
    plane = None
    if params.remove_floor:
        plane = find_support(xyz, params.floor_distance, params.floor_min_extent, params.floor_seed).plane
    if plane is not None:
        kept = above(xyz, plane, params.floor_distance)
        rows, xyz = rows[kept], np.ascontiguousarray(xyz[kept])
    return Foreground(xyz, None if cloud.rgb is None else cloud.rgb[rows], cropped, plane is not None)


def differences(found: Foreground, params: Params) -> tuple[FloatArray, FloatArray]:
    """Return dE between neighboring points, and the angle between their normals, degrees.

    Parameters
    ----------
    found : Foreground
        The points; they are thinned first.
    params : Params
        Uses `voxel_size`, `normal_radius` and `normal_min_neighbors`.

    Returns
    -------
    color, angle : (P,) and (Q,) float64
        Differences of a sample of points from their nearest neighbors; empty without color or with too few points.
    """
    xyz, rgb, none = found.xyz, found.rgb, np.empty(0)
    if params.voxel_size > 0.0 and len(xyz):
        thinned = thin(xyz, rgb, params.voxel_size)
        xyz, rgb = thinned.xyz, thinned.rgb
    if len(xyz) <= NEIGHBORS:
        return none, none
    chosen = sample_rows(len(xyz), SAMPLE, 0)
    _, neighbors = cKDTree(xyz).query(xyz[chosen], k=NEIGHBORS + 1)
    first, second = np.repeat(chosen, NEIGHBORS), neighbors[:, 1:].ravel()
    color = none
    if rgb is not None:
        color = np.linalg.norm(srgb_to_lab(rgb[first]) - srgb_to_lab(rgb[second]), axis=1)
    normals = estimate_normals(xyz, position_tree(xyz), params.normal_radius, params.normal_min_neighbors)
    cosine = np.einsum("ij,ij->i", normals[first], normals[second])
    return color, np.degrees(np.arccos(np.clip(cosine[np.isfinite(cosine)], -1.0, 1.0)))
