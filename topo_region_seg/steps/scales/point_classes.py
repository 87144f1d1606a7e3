# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""What became of each input point, so that nothing is dropped without a trace."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from topo_region_seg.data import BoolArray, LabelArray, PointClass
from topo_region_seg.steps.scales.filtered_cloud import FilteredCloud
from topo_region_seg.steps.view.scene import BEHIND, FREE, NOTHING, STRUCTURE, SUPPORT

PointClasses = npt.NDArray[np.uint8]


def point_classes(filtered: FilteredCloud, labels: LabelArray, unsure: BoolArray | None) -> PointClasses:
    """Return the :class:`PointClass` of every input point, (N,).

    Parameters
    ----------
    filtered : FilteredCloud
        The cloud after its filtration.
    labels : (N,) uint32
        Labels of the input points; 0 = none.
    unsure : (M,) bool or None
        Which preprocessed points are in segments that are not sure enough; None: none is.
    """
    row, pixel, kept = filtered.in_range
    if filtered.scene is not None:
        of_pixel = np.zeros(FREE + 1, np.uint8)
        of_pixel[NOTHING], of_pixel[SUPPORT] = PointClass.NOTHING, PointClass.SUPPORT
        of_pixel[BEHIND], of_pixel[STRUCTURE] = PointClass.BEHIND, PointClass.STRUCTURE
        of_pixel[FREE] = PointClass.LOOSE
        of_row = of_pixel[filtered.scene.classes[pixel]]
    else:
        of_row = np.full(len(row), PointClass.LOOSE if kept is None else PointClass.SUPPORT, np.uint8)
        if kept is not None:
            of_row[kept] = PointClass.LOOSE
    classes = np.zeros(filtered.given, np.uint8)
    classes[row] = of_row
    if unsure is not None:
        classes[filtered.index[unsure]] = PointClass.UNSURE
    classes[labels > 0] = PointClass.LABELED
    return classes
