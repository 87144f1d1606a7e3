# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""A compact sample of a cloud's points for the 3D view of the page."""

from __future__ import annotations

import base64
from typing import Any

import numpy as np
import numpy.typing as npt

from topo_region_seg.data import Cloud, LabelArray
from topo_region_seg.offline.figures.projection import valid_points, view_axes

BYTES_A_POINT = 13
_LEVELS = 65_535
_SEED = 0
_AROUND = 1.4


def packed_points(
    cloud: Cloud, own: npt.NDArray[np.uint8], labels: LabelArray, truth: LabelArray | None, most: int
) -> dict[str, Any]:
    """Return up to `most` points for the 3D view, seen as from the sensor.

    Parameters
    ----------
    cloud : Cloud
        The cloud; distant outliers are left out.
    own : (N, 3) uint8
        Their colors.
    labels : (N,) uint32
        Their regions.
    truth : (N,) uint32 or None
        The regions in whose colors the truth is shown.
    most : int
        Largest number of points.

    Returns
    -------
    dict
        `count`; `total` valid points; `extent`, metres from the center to the edge; and in base64, little-endian, `xyz`
        (count x 3 uint16 from -extent to extent: right, down, away), `rgb` (count x 3 uint8), `label` and, where it is
        known, `truth` (count uint16).
    """
    rows = np.flatnonzero(valid_points(cloud))
    total = len(rows)
    center, extent, axes = np.zeros(3), 1.0, np.eye(3)
    if total:
        # The regions with some of their surroundings; without regions, all points.
        inner = rows[labels[rows] > 0] if labels[rows].any() else rows
        xyz = np.asarray(cloud.xyz[inner], np.float64)
        center = (np.percentile(xyz, 2, axis=0) + np.percentile(xyz, 98, axis=0)) / 2
        extent = float(np.percentile(np.linalg.norm(xyz - center, axis=1), 98)) * _AROUND + 1e-6
        rows = rows[np.linalg.norm(cloud.xyz[rows] - center, axis=1) <= extent]
        away = float(np.linalg.norm(center))
        axes = view_axes(center / away if away > 1e-6 else np.array([0.0, 0.0, 1.0]))
    if len(rows) > most:
        rows = np.sort(np.random.default_rng(_SEED).choice(rows, most, replace=False))
    local = (np.asarray(cloud.xyz[rows], np.float64) - center) @ axes
    level = np.round((local / extent + 1.0) / 2.0 * _LEVELS).clip(0, _LEVELS)
    packed = {
        "count": len(rows),
        "total": total,
        "extent": extent,
        "xyz": _base64(level.astype("<u2")),
        "rgb": _base64(own[rows]),
        "label": _base64(np.minimum(labels[rows], _LEVELS).astype("<u2")),
    }
    if truth is not None:
        packed["truth"] = _base64(np.minimum(truth[rows], _LEVELS).astype("<u2"))
    return packed


def _base64(values: npt.NDArray[Any]) -> str:
    return base64.b64encode(np.ascontiguousarray(values).tobytes()).decode("ascii")
