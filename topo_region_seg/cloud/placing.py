# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Clouds in other frames: where sensor and robot are in a cloud's frame, and the cloud in a frame of its user's."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
from scipy.spatial.transform import Rotation

from topo_region_seg.compiled.dialect import index, kernel
from topo_region_seg.compiled.threads import in_parts, side_by_side
from topo_region_seg.data import Cloud, FloatArray

FAR = 1000.0
"""Distance of a frame, metres, from which on single precision would move points by a tenth of a millimetre."""
AT_ORIGIN = (0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0)
"""The pose of a frame in itself: x, y, z (m) and the quaternion w, x, y, z."""
PosePart = tuple[float, ...]


@dataclass(frozen=True)
class Transform:
    """Takes positions of one frame to another: ``rotation @ x + position``.

    Parameters
    ----------
    rotation : (3, 3) float64
        Rotation matrix.
    position : (3,) float64
        Metres.
    """

    rotation: FloatArray
    position: FloatArray

    @classmethod
    def of_pose(cls, pose: PosePart) -> Transform:
        """Return what takes positions of a frame to the one in which it has a pose x, y, z (m), w, x, y, z.

        Raises
        ------
        ValueError
            The pose is not finite, or its quaternion is 0.
        """
        values = np.array(pose, np.float64)
        norm = float(np.linalg.norm(values[3:]))
        if values.shape != (7,) or not np.isfinite(values).all() or not norm > 0.0:
            raise ValueError(f"{list(pose)} is no pose")
        w, x, y, z = values[3:] / norm
        return cls(Rotation.from_quat([x, y, z, w]).as_matrix(), values[:3])

    @property
    def pose(self) -> PosePart:
        """The pose that it stands for."""
        x, y, z, w = Rotation.from_matrix(self.rotation).as_quat().tolist()
        return (*self.position.tolist(), w, x, y, z)

    def after(self, first: Transform) -> Transform:
        """Return what takes positions first through another transform, then through this one."""
        return Transform(self.rotation @ first.rotation, self.rotation @ first.position + self.position)


def moved(cloud: Cloud, to: Transform) -> Cloud:
    """Return a cloud in another frame, with the poses of sensor and base; one without a sensor's had it at the origin.

    Positions are float32, or float64 where the frame is so far that these would be too coarse.
    """
    far = float(np.linalg.norm(to.position)) > FAR
    xyz: npt.NDArray[np.floating] = np.empty(cloud.xyz.shape, np.float64 if far else np.float32)
    given = np.ascontiguousarray(cloud.xyz)
    parts = [(given, first, end, to.rotation, to.position, xyz) for first, end in in_parts(len(xyz))]
    side_by_side(move_points, parts)
    sensor = to.after(Transform.of_pose(cloud.sensor_pose or AT_ORIGIN)).pose
    base = None if cloud.base_pose is None else to.after(Transform.of_pose(cloud.base_pose)).pose
    return replace(cloud, xyz=xyz, sensor_pose=sensor, base_pose=base)


@kernel
def move_points(
    xyz: npt.NDArray[np.floating],
    first: int,
    end: int,
    rotation: FloatArray,
    position: FloatArray,
    result: npt.NDArray[np.floating],
) -> None:
    """Fill `result` (N, 3), from row `first` to `end`, with positions in another frame; NaN stays NaN."""
    for row in range(first, end):
        i = index(row)
        x, y, z = np.float64(xyz[i, 0]), np.float64(xyz[i, 1]), np.float64(xyz[i, 2])
        for a in range(3):
            result[i, a] = rotation[a, 0] * x + rotation[a, 1] * y + rotation[a, 2] * z + position[a]
