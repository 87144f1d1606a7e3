# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""How well regions fit the objects of a frame, for all parts."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from topo_region_seg.data import Cloud, LabelArray
from topo_region_seg.offline.evaluation.measures import Measures, measure


def quality(truth: npt.NDArray[np.uint32], labels: LabelArray, cloud: Cloud) -> Measures:
    """Return the measures of a cloud's labels."""
    return measure(truth, labels, np.isfinite(cloud.xyz).all(axis=1))


def weighted_overlap(truth: npt.NDArray[np.uint32], labels: LabelArray, cloud: Cloud) -> float:
    """Return the weighted overlap alone; NaN where there is no object."""
    found = quality(truth, labels, cloud)["wov"]
    return found if found is not None else float("nan")
