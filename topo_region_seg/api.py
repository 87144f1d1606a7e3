# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Segmentation of plain arrays."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from topo_region_seg.data import Cloud, Components
from topo_region_seg.growth import growth_of_regions
from topo_region_seg.params import Params
from topo_region_seg.pipeline import Pipeline
from topo_region_seg.segmentation import Segmentation
from topo_region_seg.steps.filtration.persistence import filtration
from topo_region_seg.steps.homogeneity import criterion, homogeneity_channels


def segment(xyz: npt.ArrayLike, rgb: npt.ArrayLike | None = None, params: Params | None = None) -> Segmentation:
    """Segment one cloud.

    Parameters
    ----------
    xyz : (N, 3) or (H, W, 3) array of float
        Positions in the sensor frame, metres; points that are not finite, or (0, 0, 0), get label 0.
    rgb : (N, 3) or (H, W, 3) array of uint8, optional
        8-bit sRGB; may be left out if ``params.features`` is ``normals``.
    params : Params, optional
        Parameters; the defaults suit a tabletop scene.

    Returns
    -------
    Segmentation
        `labels` has one entry for each point, in the order of ``xyz.reshape(-1, 3)``.

    Raises
    ------
    ValueError
        If a shape or dtype does not fit.
    MissingColorError
        If color is needed and `rgb` was left out.
    """
    points = np.asarray(xyz)
    if points.dtype != np.float32:
        points = points.astype(np.float64)
    if points.ndim not in (2, 3) or points.shape[-1] != 3:
        raise ValueError(f"xyz has shape {points.shape}, must be (N, 3) or (H, W, 3)")
    height, width = points.shape[:2] if points.ndim == 3 else (1, len(points))
    colors = None
    if rgb is not None:
        colors = np.asarray(rgb)
        if colors.shape != points.shape or colors.dtype != np.uint8:
            raise ValueError(f"rgb is {colors.dtype} {colors.shape}, must be uint8 {points.shape}")
        colors = np.ascontiguousarray(colors.reshape(-1, 3))
    cloud = Cloud(np.ascontiguousarray(points.reshape(-1, 3)), colors, height, width)
    return Pipeline(params).run(cloud)


def persistent_components(
    xyz: npt.ArrayLike, lab: npt.ArrayLike | None, normals: npt.ArrayLike | None, params: Params
) -> Components:
    """Compute H0 of the Vietoris-Rips filtration whose edges satisfy the homogeneity criterion.

    Parameters
    ----------
    xyz : (N, 3) array of float
        Positions, metres; all finite.
    lab : (N, 3) array of float or None
        CIELAB colors; needed unless ``params.features`` is ``normals``.
    normals : (N, 3) array of float or None
        Normals; needed unless ``params.features`` is ``color``. They are scaled to unit length. A row of
        NaN marks a point without a normal: it takes part by color alone, and not at all where
        ``params.features`` is ``normals``.
    params : Params
        Uses `max_radius`, `features`, and the color and angle thresholds.

    Returns
    -------
    Components
        `root`, `parent` and exact `death` of every point; a death is the length of an edge of the minimum
        spanning forest of the graph at `max_radius`.

    Raises
    ------
    ValueError
        If a needed array is missing, has the wrong shape, or holds values that are not finite.
    """
    growth = growth_of_regions(params)
    channels = homogeneity_channels(xyz, lab, normals, growth)
    limits = criterion(growth, growth.max_radius)
    return filtration(channels, limits, growth.max_radius, needs_normals=not growth.uses_color)
