# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Segmentation of plain arrays."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from topo_region_seg.data import Cloud, Segmentation
from topo_region_seg.params import Params
from topo_region_seg.pipeline import Pipeline


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
