# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""A cloud after its filtration: all that the regions of any scale are made from."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from topo_region_seg.compiled.kd_tree import Tree, position_tree
from topo_region_seg.compiled.near_lists import NearLists
from topo_region_seg.data import Components, Features, FloatArray, IndexArray, IntArray, LabelArray, Plane
from topo_region_seg.growth import Growth
from topo_region_seg.steps.view.lengths import AS_GIVEN, Lengths
from topo_region_seg.steps.view.scene import Scene


class InRange(NamedTuple):
    """Where the points in range came from, before the support was removed.

    Parameters
    ----------
    row, pixel : (I,) int64
        Their input rows, and their pixels where there is a scene.
    kept : (K,) int64 or None
        Which of them are left without the support and other surfaces; None: all.
    """

    row: IntArray
    pixel: IntArray
    kept: IntArray | None


@dataclass(frozen=True)
class FilteredCloud:
    """The preprocessed points, their features and their merge tree.

    Parameters
    ----------
    xyz : (N, 3) float64
        The preprocessed points, metres, seen from the sensor at the origin.
    sensor : (3,) float64
        Where the sensor is in the frame of the input, metres.
    weight, index : (N,) int64
        How many input points each of them stands for, and the row of the first.
    rows : (K,) int64
        The input rows that are not cropped.
    stand_in : (K,) int64 or None
        The preprocessed point of each of these; None if they are the same.
    given : int
        Number of input points.
    in_range : InRange
        Which of these are in range, and which were removed with the support.
    channels : (N, 9) float64
        Positions, colors and normals as the criterion compares them. Positions are metres, unless `max_radius` is
        auto: then they are coordinates in which the spacing of points is the same everywhere.
    known_tree : Tree or None
        Tree over the positions in `channels`; None: it is made when it is asked for.
    grow : callable
        Returns the components of the whole filtration, up to its last scale, from `channels` and the tree.
    features : Features
        Features of the preprocessed points.
    plane : Plane or None
        The removed support plane, in the frame of the input.
    growth : Growth
        How the regions grow.
    scene : Scene or None
        What is known of the frame, where objects are told apart on its image grid.
    pixel : (N,) int64 or None
        The pixels of the points where there is a scene.
    lengths : Lengths
        How lengths grow with the depth there.
    near : NearLists or None
        The points near some of the points, which small regions need too.
    blocks : (H, W) int32 or None
        Point of each block of pixels, -1 for none, where supervoxels grow on the image grid.
    """

    xyz: FloatArray
    sensor: FloatArray
    weight: IntArray
    index: IntArray
    rows: IntArray
    stand_in: IntArray | None
    given: int
    in_range: InRange
    channels: FloatArray
    known_tree: Tree | None
    grow: Callable[[FloatArray, Tree], Components]
    features: Features
    plane: Plane | None
    growth: Growth
    scene: Scene | None = None
    pixel: IntArray | None = None
    lengths: Lengths = AS_GIVEN
    near: NearLists | None = None
    blocks: IndexArray | None = None

    @cached_property
    def tree(self) -> Tree:
        """Tree over the positions in `channels`."""
        if self.known_tree is not None:
            return self.known_tree
        return position_tree(np.ascontiguousarray(self.channels[:, :3]))

    @cached_property
    def components(self) -> Components:
        """The whole filtration, up to its last scale; it runs when it is first asked for."""
        return self.grow(self.channels, self.tree)


def labels_of_input(filtered: FilteredCloud, labels: LabelArray) -> LabelArray:
    """Return the labels of all input points from those of the preprocessed ones (N,); 0 where a point was cropped."""
    full = np.zeros(filtered.given, np.uint32)
    full[filtered.rows] = labels if filtered.stand_in is None else labels[filtered.stand_in]
    return full


def positions_of_input(filtered: FilteredCloud, xyz: FloatArray) -> FloatArray:
    """Return positions (M, 3), metres, that are seen from the sensor in the frame of the input."""
    return xyz + filtered.sensor if filtered.sensor.any() else xyz


def components_at(filtered: FilteredCloud, radius: float) -> Components:
    """Return the components at a scale, metres."""
    whole = filtered.components
    return whole if radius == whole.max_radius else whole.cut(radius)
