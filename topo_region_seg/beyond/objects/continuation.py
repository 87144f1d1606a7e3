# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Which region's surface a point in a groove continues."""

from __future__ import annotations

import numpy as np

from topo_region_seg.compiled.boxes import box_of_point
from topo_region_seg.compiled.dialect import kernel
from topo_region_seg.compiled.kd_tree import Tree
from topo_region_seg.compiled.nearest import comes_before
from topo_region_seg.compiled.walks import new_walk, next_leaf
from topo_region_seg.data import FloatArray, IntArray


@kernel
def regions_along(
    tree: Tree,
    xyz: FloatArray,
    normals: FloatArray,
    region: IntArray,
    uniform: IntArray,
    nobody: int,
    reach: float,
    across: float,
    points: IntArray,
    first: int,
    end: int,
    found: IntArray,
) -> None:
    """Write into `found` (N,) the region whose surface ``points[first:end]`` continue best.

    It is that of the point up to `reach` (m) away with the smallest distance, of which what lies along its own normal
    (N, 3) counts `across` times more. `region` (N,) is that of each point and `uniform` (K,) that of all points of a
    node, or -1; points in region `nobody` are no candidates. Where there are none, `found` keeps what it has.
    """
    walk = new_walk()
    for point in points[first:end]:
        best, choice = np.inf, -1
        box = box_of_point(xyz, point)
        walk.node[0], walk.gap[0], top = 0, 0.0, 1
        while True:
            leaf, top = next_leaf(tree, box, 0, min(best, reach * reach), True, walk, top)
            if leaf < 0:
                break
            if uniform[leaf] == nobody:
                continue
            for row in range(tree.start[leaf], tree.stop[leaf]):
                other = tree.order[row]
                d2, rise = 0.0, 0.0
                for c in range(3):
                    d2 += (xyz[point, c] - xyz[other, c]) ** 2
                    rise += (xyz[point, c] - xyz[other, c]) * normals[other, c]
                if region[other] == nobody or d2 > reach * reach:
                    continue
                d2 += (across * rise) ** 2
                if d2 < best or (d2 == best and comes_before(xyz, other, choice)):
                    best, choice = d2, other
        if choice >= 0:
            found[point] = region[choice]
