# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The programs that find objects in a cloud: this package, and those of PCL.

PCL's values are those of a few that gave most on some of the recorded frames: the angles of RegionGrowing from 3 to 15
degrees, voxels of LCCP from 5 to 10 mm, clusters up to 6 to 20 mm.
"""

from __future__ import annotations

import tempfile
import time
import warnings
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path

import numpy as np

from benchmarks import pcl_peers
from topo_region_seg.data import Cloud, LabelArray
from topo_region_seg.params import Params
from topo_region_seg.pipeline import Pipeline

Found = tuple[LabelArray, float]
"""The label of each point, and milliseconds of the processor, all threads together."""

OURS = "topo_region_seg"


def ours(cloud: Cloud, params: Params, repeats: int) -> Found:
    """Segment a cloud; the time is the median of the repeats."""
    times = []
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        for _ in range(repeats):
            started = time.process_time()
            seg = Pipeline(params).run(cloud)
            times.append(1e3 * (time.process_time() - started))
    return seg.labels, float(np.median(times))


def of_pcl(method: str, value: float, plane: float, cloud: Cloud) -> Found:
    """Let PCL find objects, after it has removed a plane (m; 0: none); see :func:`benchmarks.pcl_peers.objects`."""
    labels = np.zeros(len(cloud), np.uint32)
    rows = np.flatnonzero(np.isfinite(cloud.xyz).all(axis=1))
    with tempfile.TemporaryDirectory(prefix="objects-") as folder:
        timing, found = pcl_peers.objects(cloud, rows, method, value, Path(folder), plane=plane)
    labels[rows] = found
    return labels, timing.median


PEERS: Mapping[str, Callable[[Cloud], Found]] = {
    "PCL LCCP": partial(of_pcl, "lccp", 0.005, 0.0),
    "PCL plane + LCCP": partial(of_pcl, "lccp", 0.005, 0.01),
    "PCL plane + RegionGrowing": partial(of_pcl, "region_growing", 10.0, 0.01),
    "PCL plane + Euclidean clusters": partial(of_pcl, "clusters", 0.01, 0.01),
}
