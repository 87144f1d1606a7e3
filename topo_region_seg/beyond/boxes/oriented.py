# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Oriented boxes of the regions of a segmentation; made when they are asked for."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from topo_region_seg.beyond.boxes.extents import extents, sorted_by_row
from topo_region_seg.beyond.boxes.frames import free_frames, upright_frames
from topo_region_seg.data import FloatArray, LabelArray
from topo_region_seg.segmentation import Segmentation


@dataclass(frozen=True)
class OrientedBoxes:
    """Boxes in any direction, one row each; lengths in metres, frame of the input.

    Parameters
    ----------
    label : (M,) uint32
        Label of the region, as in the table of regions and in its order.
    center : (M, 3) float64
        Middle of the box.
    axes : (M, 3, 3) float64
        A rotation: its columns are the axes of the box in the frame of the input.
    size : (M, 3) float64
        Whole lengths along the axes.
    """

    label: LabelArray
    center: FloatArray
    axes: FloatArray
    size: FloatArray

    def __len__(self) -> int:
        return len(self.label)

    @property
    def quaternion(self) -> FloatArray:
        """The rotations as unit quaternions x, y, z, w, with w not below 0, (M, 4) float64."""
        return quaternions(self.axes)


def oriented_boxes(seg: Segmentation, up: npt.ArrayLike | None = None) -> OrientedBoxes:
    """Return the oriented box of each region.

    Where `up` is known, the boxes are upright: their z axes point there, and of all such boxes each has the smallest
    base; x is along its longer side. Elsewhere the boxes have the smallest volume that is found; x is along their
    longest side, y along the next one, and z points to the side of the sensor. At either end of each axis up to 0.2 %
    of a region's points may stay outside, as sensors make strays. Points that were thinned count as one, which makes a
    box up to half a voxel smaller at each end.

    Parameters
    ----------
    seg : Segmentation
        Result for a cloud; tracked labels are kept.
    up : (3,) array of float, optional
        Direction that is up in the frame of the input, of any length; unless given, the normal of the removed support
        plane where there is one.

    Raises
    ------
    ValueError
        If `up` is not three finite numbers that differ from 0, 0, 0.
    """
    if up is None and seg.plane is not None:
        up = seg.plane.normal
    vertical = None if up is None else _unit(up)
    table = seg.regions
    row = np.full(int(np.max(table.label, initial=0)) + 1, -1)
    row[table.label] = np.arange(len(table))
    points, start = sorted_by_row(seg.points, row[seg.point_labels], len(table))
    frames = free_frames(points, start) if vertical is None else upright_frames(points, start, vertical)
    low, high = extents(points, start, frames)
    center, axes, size = boxes_between(low, high, frames, seg.filtered.sensor, upright=vertical is not None)
    return OrientedBoxes(table.label, center, axes, size)


def boxes_between(
    low: FloatArray, high: FloatArray, frames: FloatArray, sensor: FloatArray, *, upright: bool
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return center (M, 3), axes as columns (M, 3, 3) and size (M, 3) of boxes, with the axes in their order.

    `low` and `high` (M, 3) are the ends along the rows of `frames` (M, 3, 3).
    """
    center = np.einsum("ma,mac->mc", (low + high) / 2, frames)
    size = high - low
    order = np.argsort(-size, axis=1, kind="stable")
    if upright:
        order = np.where(size[:, :1] < size[:, 1:2], [[1, 0, 2]], [[0, 1, 2]])
    size = np.take_along_axis(size, order, axis=1)
    frames = np.take_along_axis(frames, order[:, :, None], axis=1)
    x, z = frames[:, 0], frames[:, 2]
    # An axis may point either way; these are the same for equal boxes, whatever they were found from.
    largest = np.take_along_axis(x, np.argmax(np.abs(x), axis=1)[:, None], axis=1)
    x = np.where(largest < 0.0, -x, x)
    if not upright:
        away = np.einsum("mc,mc->m", z, center - sensor)
        z = np.where(away[:, None] > 0.0, -z, z)
    return center, np.stack([x, np.cross(z, x), z], axis=2), size


def quaternions(axes: FloatArray) -> FloatArray:
    """Return rotations (M, 3, 3) as unit quaternions x, y, z, w, with w not below 0, (M, 4) float64."""
    xx, yy, zz = (axes[:, a, a] for a in range(3))
    squares = np.stack([1 + xx - yy - zz, 1 - xx + yy - zz, 1 - xx - yy + zz, 1 + xx + yy + zz], axis=1)
    products = np.empty((len(axes), 4, 4))  # 4 times the product of each two components
    products[:, range(4), range(4)] = squares
    for a, b in ((0, 1), (0, 2), (1, 2)):
        products[:, a, b] = products[:, b, a] = axes[:, a, b] + axes[:, b, a]
    for c, (a, b) in enumerate(((1, 2), (2, 0), (0, 1))):
        products[:, c, 3] = products[:, 3, c] = axes[:, b, a] - axes[:, a, b]
    largest = np.argmax(squares, axis=1)
    found = products[np.arange(len(axes)), largest]
    found /= np.linalg.norm(found, axis=1)[:, None]
    turned: FloatArray = np.where(found[:, 3:] < 0.0, -found, found)
    return turned


def _unit(up: npt.ArrayLike) -> FloatArray:
    direction = np.asarray(up, np.float64)
    length = float(np.linalg.norm(direction)) if direction.shape == (3,) else 0.0
    if not (np.isfinite(length) and length > 0.0):
        raise ValueError(f"up is {up!r}, must be three finite numbers that are not all 0")
    unit: FloatArray = direction / length
    return unit


def warm_up_boxes() -> None:
    """Compile the kernels of boxes, or load them from the cache."""
    square = np.array([[0.0, 0.0, 1.0], [0.1, 0.0, 1.1], [0.0, 0.1, 1.2], [0.1, 0.1, 1.0]])
    points, start = sorted_by_row(square, np.zeros(len(square), np.int64), 1)
    upright_frames(points, start, np.array([0.0, 0.0, 1.0]))
    extents(points, start, free_frames(points, start))
