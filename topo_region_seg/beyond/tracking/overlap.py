# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Which points the regions of a frame share with those of the frame before."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.spatial import cKDTree

from topo_region_seg.data import BoolArray, Cloud, FloatArray, IntArray, LabelArray
from topo_region_seg.segmentation import Segmentation

SAMPLES = 5_000
"""Points of a cloud without image grid that are looked up in the cloud before."""


@dataclass(frozen=True)
class Seen:
    """A frame, for the next one to be compared with. A row is that of the table of regions counted from 1; 0 = none.

    Parameters
    ----------
    row : (N,) int32
        Row of each input point.
    cloud_xyz : (N, 3) float
        Positions of the input points, metres.
    point_row : (M,) int32
        Row of each preprocessed point.
    xyz : (M, 3) float64
        Positions of the preprocessed points, metres.
    label : (R,) uint32
        Labels of the rows of the table.
    """

    row: npt.NDArray[np.int32]
    cloud_xyz: npt.NDArray[np.floating]
    point_row: npt.NDArray[np.int32]
    xyz: FloatArray
    label: LabelArray


def seen_in(cloud: Cloud, seg: Segmentation) -> Seen:
    """Return what the next frame needs to know of this one, as yet with the labels that it came with."""
    row = np.zeros(int(np.max(seg.regions.label, initial=0)) + 1, np.int32)
    row[seg.regions.label] = np.arange(1, len(seg.regions) + 1)
    return Seen(row[seg.labels], cloud.xyz, row[seg.point_labels], seg.points, seg.regions.label)


@dataclass(frozen=True)
class Common:
    """Points that two frames have in common, counted for all pairs (P,) of regions that share any.

    Parameters
    ----------
    now, before : (P,) int64
        Rows of the two regions, counted from 0, in rising order of `now`, then `before`.
    count : (P,) int64
        How many points they share.
    """

    now: IntArray
    before: IntArray
    count: IntArray


def common_points(now: npt.NDArray[np.integer], before: npt.NDArray[np.integer]) -> Common:
    """Count what regions share, from the rows (N,) of the same points in two frames; rows count from 1, 0 = none."""
    both = np.flatnonzero((now > 0) & (before > 0))
    width = int(np.max(before, initial=0)) + 1
    pair = now[both].astype(np.int64) * width + before[both]
    # Neighbors in an image mostly lie in the same two regions: sorting the runs is faster than sorting the points.
    begin = np.flatnonzero(np.diff(pair, prepend=-1))
    found, place = np.unique(pair[begin], return_inverse=True)
    count = np.zeros(len(found), np.int64)
    np.add.at(count, place, np.diff(np.append(begin, len(pair))))
    return Common(found // width - 1, found % width - 1, count)


def nearest_before(xyz: FloatArray, before: FloatArray, reach: float) -> tuple[IntArray, BoolArray]:
    """Return the nearest of the points of the frame before (B, 3), and whether one is in reach (m), for points (N, 3).

    Where none is, the place is B.
    """
    if not len(xyz) or not len(before):
        return np.full(len(xyz), len(before)), np.zeros(len(xyz), np.bool_)
    tree = cKDTree(before, balanced_tree=False, compact_nodes=False)
    _, place = tree.query(xyz, distance_upper_bound=reach)
    return place, place < len(before)


def same_place(seg: Segmentation) -> float:
    """Return the distance, metres, up to which points of two frames are of the same place."""
    return max(2.0 * seg.params.voxel_size, seg.filtered.growth.max_radius)


def same_points(
    cloud: Cloud, now: Seen, seg: Segmentation, before: Seen
) -> tuple[npt.NDArray[np.int32], npt.NDArray[np.int32]]:
    """Return the rows of the same points in both frames: of pixels, or without image grid of the nearest points."""
    if cloud.organized:
        return now.row, before.row
    every = max(1, len(now.xyz) // SAMPLES)
    xyz, row = now.xyz[::every], now.point_row[::every]
    if not len(before.xyz) or not len(xyz):
        return row, np.zeros_like(row)
    _, place = cKDTree(before.xyz).query(xyz, distance_upper_bound=same_place(seg))
    return row, np.append(before.point_row, np.int32(0))[place]
