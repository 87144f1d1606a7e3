# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Grooves: where surfaces meet at a concave edge, normals turn to the inside within a short distance.

Objects that touch meet in a groove. A sensor, and the neighborhoods of normals, round it off: from point to point the
normals change so little that regions climb from one object to the other. Over a larger distance the turn is plain.
"""

from __future__ import annotations

import math

import numpy as np

from topo_region_seg.beyond.objects.curvature import mean_curvatures
from topo_region_seg.compiled.kd_tree import Tree
from topo_region_seg.compiled.leaf_blocks import leaf_blocks
from topo_region_seg.compiled.threads import in_parts, side_by_side
from topo_region_seg.data import BoolArray, FloatArray
from topo_region_seg.params import Params


def find_grooves(xyz: FloatArray, normals: FloatArray, tree: Tree, params: Params) -> BoolArray:
    """Return which points lie in a groove.

    Parameters
    ----------
    xyz, normals : (N, 3) float64
        Positions, metres, and unit normals; NaN for points without one, which lie in none.
    tree : Tree
        Tree over the positions.
    params : Params
        Uses `object_border_radius` and `object_groove_angle`.

    Returns
    -------
    (N,) bool
        Where the normals turn to the inside by more than the angle over the radius, on the mean of all directions.
    """
    curvature = np.empty(len(xyz))
    blocks, radius = leaf_blocks(tree, xyz, normals), params.object_border_radius
    parts = in_parts(len(tree.start))
    side_by_side(mean_curvatures, [(tree, blocks, radius, first, end, curvature) for first, end in parts])
    return curvature < -math.radians(params.object_groove_angle)
