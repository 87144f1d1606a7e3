# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Background subtraction: invalid points and points out of range or out of the box (paper, section V)."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from scipy.spatial.transform import Rotation

from topo_region_seg.compiled.dialect import kernel
from topo_region_seg.data import BoolArray, FloatArray, IntArray
from topo_region_seg.params import Params


def crop(
    xyz: npt.NDArray[np.floating],
    sensor: FloatArray,
    params: Params,
    *,
    any_range: bool = False,
    base: tuple[float, ...] | None = None,
) -> IntArray:
    """Return the rows of `xyz` (N, 3), metres, that are valid, within range and inside the crop box.

    Parameters
    ----------
    xyz : (N, 3) float32 or float64
        Positions; invalid ones are not finite, or (0, 0, 0) if `drop_zeros`.
    sensor : (3,) float64
        Where the sensor is, metres, in their frame.
    params : Params
        Uses `min_range`, `max_range`, `drop_zeros`, `crop_box` and `crop_box_pose`.
    any_range : bool
        Whether points at any distance are kept.
    base : tuple of 7 floats, optional
        Pose of the frame that the crop box is in, as :class:`~topo_region_seg.data.Cloud` has it; without it that of
        the positions.

    Returns
    -------
    (M,) int64
        Kept rows, ascending.
    """
    near, far = (0.0, np.inf) if any_range else (params.min_range, params.max_range)
    rows = rows_in_range(xyz, sensor, near, far, params.drop_zeros)
    return rows[_inside_box(xyz[rows], params, base)] if params.crop_box else rows


def _inside_box(xyz: npt.NDArray[np.floating], params: Params, base: tuple[float, ...] | None) -> BoolArray:
    points = xyz.astype(np.float64)
    if base is not None:
        w, x, y, z = base[3:]
        points = Rotation.from_quat([x, y, z, w]).inv().apply(points - np.array(base[:3]))
    if params.crop_box_pose:
        position, angles = params.crop_box_pose[:3], params.crop_box_pose[3:]
        points = Rotation.from_euler("xyz", angles).inv().apply(points - np.array(position))
    low, high = np.array(params.crop_box[:3]), np.array(params.crop_box[3:])
    inside: BoolArray = ((points >= low) & (points <= high)).all(axis=1)
    return inside


@kernel
def rows_in_range(
    xyz: npt.NDArray[np.floating], sensor: FloatArray, near: float, far: float, drop_zeros: bool
) -> IntArray:
    """Return the rows (M,) at a distance from `sensor` (3,) within [near, far], metres; what is not finite is not."""
    rows = np.empty(len(xyz), np.int64)
    count = 0
    for i in range(len(xyz)):
        x, y, z = np.float64(xyz[i, 0]), np.float64(xyz[i, 1]), np.float64(xyz[i, 2])
        dx, dy, dz = x - sensor[0], y - sensor[1], z - sensor[2]
        range2 = dx * dx + dy * dy + dz * dz
        rows[count] = i
        zero = (x == 0.0) & (y == 0.0) & (z == 0.0)
        # False for NaN and infinities.
        keep = (range2 <= far * far) & (range2 >= near * near) & (range2 < np.inf) & (not (zero & drop_zeros))
        count += 1 if keep else 0
    kept: IntArray = rows[:count].copy()
    return kept
