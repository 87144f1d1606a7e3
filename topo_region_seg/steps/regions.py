# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Numbering of the regions and their properties (paper, section IV.F)."""

from __future__ import annotations

import numpy as np

from topo_region_seg.compiled.dialect import kernel
from topo_region_seg.compiled.partition import first_points, region_sizes
from topo_region_seg.data import Features, FloatArray, IntArray, LabelArray, RegionTable


def number_regions(xyz: FloatArray, region: IntArray, weight: IntArray) -> LabelArray:
    """Return labels (N,) from 1, largest region first (ties: smallest coordinate triple); 0 where `region` is -1.

    `weight` (N,) is the number of input points that each point stands for.
    """
    n_regions = int(np.max(region, initial=-1)) + 1
    size = region_sizes(region, weight, n_regions)
    first = xyz[first_points(xyz, region, n_regions)]
    order = np.lexsort((first[:, 2], first[:, 1], first[:, 0], -size))
    label = np.zeros(n_regions + 1, np.uint32)  # the last entry serves region -1
    label[order] = np.arange(1, n_regions + 1)
    return label[region]


def describe_regions(
    xyz: FloatArray, features: Features, labels: LabelArray, weight: IntArray, persistence: FloatArray
) -> RegionTable:
    """Compute size, centroid, box, mean color and mean normal of every region; its `persistence` (R,) is given."""
    n_regions = int(np.max(labels, initial=0))
    lab = np.full_like(xyz, np.nan) if features.lab is None else features.lab
    normals = np.full_like(xyz, np.nan) if features.normals is None else features.normals
    size, sums, low, high = region_sums(labels, weight, xyz, lab, normals, n_regions)
    # Points without a normal do not count in the mean; where none has one there is no direction.
    length = np.linalg.norm(sums[:, 6:9], axis=1, keepdims=True)
    with np.errstate(invalid="ignore"):
        direction = np.where(length > 0.0, sums[:, 6:9] / length, np.nan)
    return RegionTable(
        label=np.arange(1, n_regions + 1, dtype=np.uint32),
        size=size,
        centroid=sums[:, 0:3] / size[:, None],
        minimum=low,
        maximum=high,
        mean_lab=sums[:, 3:6] / size[:, None],
        mean_normal=direction,
        persistence=persistence,
        confidence=np.full(n_regions, np.nan),
    )


@kernel
def region_sums(
    labels: LabelArray,
    weight: IntArray,
    xyz: FloatArray,
    lab: FloatArray,
    normals: FloatArray,
    n_regions: int,
) -> tuple[IntArray, FloatArray, FloatArray, FloatArray]:
    """Return size (R,), weighted sums (R, 9) and box corners (R, 3) twice.

    Sums are of position, color and normal; normals that are NaN are left out.
    """
    size = np.zeros(n_regions, np.int64)
    sums = np.zeros((n_regions, 9))
    low = np.full((n_regions, 3), np.inf)
    high = np.full((n_regions, 3), -np.inf)
    for i in range(len(labels)):
        if labels[i] == 0:
            continue
        r = np.int64(labels[i]) - 1
        size[r] += weight[i]
        for c in range(3):
            sums[r, c] += weight[i] * xyz[i, c]
            sums[r, 3 + c] += weight[i] * lab[i, c]
            if not np.isnan(normals[i, c]):
                sums[r, 6 + c] += weight[i] * normals[i, c]
            low[r, c] = min(low[r, c], xyz[i, c])
            high[r, c] = max(high[r, c], xyz[i, c])
    return size, sums, low, high
