# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The color of every point: its own, or that of its region."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from topo_region_seg.cloud.label_colors import colors
from topo_region_seg.data import Cloud, LabelArray
from topo_region_seg.offline.figures.projection import valid_points


def own_colors(cloud: Cloud) -> npt.NDArray[np.uint8]:
    """Return the colors of a cloud, (N, 3) uint8; gray levels, brighter for nearer points, if it has none."""
    return cloud.rgb if cloud.rgb is not None else _shade_of_depth(cloud)


def region_colors(own: npt.NDArray[np.uint8], labels: LabelArray) -> npt.NDArray[np.uint8]:
    """Return the color of the region of every point, (N, 3) uint8; points without a region are dim gray."""
    dim = (own.astype(np.float32) @ np.array([0.3, 0.59, 0.11], dtype=np.float32)) * 0.35 + 30.0
    return np.where(labels[:, None] > 0, colors(labels), dim[:, None].astype(np.uint8))


def _shade_of_depth(cloud: Cloud) -> npt.NDArray[np.uint8]:
    distance = np.linalg.norm(np.where(valid_points(cloud)[:, None], cloud.xyz, np.nan), axis=1)
    known = distance[np.isfinite(distance)]
    near, far = np.percentile(known, (1, 99)) if len(known) else (0.0, 1.0)
    level = 230.0 - 170.0 * np.clip((distance - near) / max(far - near, 1e-9), 0.0, 1.0)
    gray = np.nan_to_num(level).astype(np.uint8)
    return np.repeat(gray[:, None], 3, axis=1)
