# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""A camera whose motion is known: where what it saw in the frame before is in the frame of now."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import numpy.typing as npt

from topo_region_seg.beyond.tracking.overlap import Seen
from topo_region_seg.cloud.placing import AT_ORIGIN, PosePart, Transform
from topo_region_seg.data import Cloud, FloatArray, IntArray
from topo_region_seg.steps.view.resection import projection

AT_REST = 0.001
"""Motion up to which a camera is at rest, metres and radians: transforms tremble."""

Poses = tuple[PosePart | None, PosePart | None]
"""Where sensor and base were in the frame of a cloud."""
Place = IntArray | slice
"""Where each point (N,) was among the B of the frame before, B if nowhere; EVERY if all are where they were."""
EVERY = slice(None)


def camera_motion(before: Poses, now: Poses) -> Transform | None:
    """Return what takes positions of things at rest from the frame of the cloud before to that of now.

    Things are at rest in the frame of the clouds if the sensor moves in it. Else that is a camera's frame, and things
    are at rest in the base's. None where the camera has not moved, or it is not known.
    """
    (sensor_before, base_before), (sensor, base) = before, now
    if (base is None) != (base_before is None) or (sensor is None) != (sensor_before is None):
        return None
    eye, eye_before = (Transform.of_pose(pose or AT_ORIGIN) for pose in (sensor, sensor_before))
    if not _at_rest(eye_before, eye):
        return Transform(np.eye(3), np.zeros(3))
    if base is None or base_before is None:
        return None
    motion = Transform.of_pose(base).after(inverse(Transform.of_pose(base_before)))
    return None if _at_rest(motion.after(eye), eye) else motion


def _at_rest(before: Transform, now: Transform) -> bool:
    turned = inverse(now).after(before)
    off = max(float(np.abs(turned.rotation - np.eye(3)).max()), float(np.abs(turned.position).max()))
    return off <= AT_REST


def inverse(transform: Transform) -> Transform:
    """Return what takes positions back."""
    return Transform(transform.rotation.T, -transform.rotation.T @ transform.position)


def seen_from_here(seen: Seen, cloud: Cloud, labeled: IntArray, motion: Transform, reach: float) -> tuple[Seen, Place]:
    """Return the frame before as the camera would have seen it from where it is now, and where each point was in it.

    Parameters
    ----------
    seen : Seen
        The frame before; an image of the same size if `cloud` is one.
    cloud : Cloud
        The frame of now.
    labeled : int64 array
        Those of its points that are in a region; of the others nothing is known before.
    motion : Transform
        From the frame of the cloud before to that of now.
    reach : float
        Distance up to which two points are of the same place, metres: farther ones hide one another.
    """
    xyz = moved_points(seen.xyz, motion)
    matrix = projection(Cloud(seen.cloud_xyz, None, cloud.height, cloud.width)) if cloud.organized else None
    if matrix is None:
        return replace(seen, xyz=xyz, cloud_xyz=moved_points(seen.cloud_xyz, motion)), EVERY
    back = moved_points(cloud.xyz[labeled], inverse(motion))
    u, v, w = matrix[:, :3] @ back.T + matrix[:, 3:]
    with np.errstate(divide="ignore", invalid="ignore"):
        column, row = np.round(u / w), np.round(v / w)
    inside = (column >= 0) & (column < cloud.width) & (row >= 0) & (row < cloud.height)
    pixel = (row[inside] * cloud.width + column[inside]).astype(np.int64)
    way = back[inside] - seen.cloud_xyz[pixel]
    same = (way * way).sum(axis=1) <= reach * reach
    place = np.full(len(cloud), len(cloud))
    place[labeled[inside][same]] = pixel[same]
    known = place < len(cloud)
    cloud_xyz = np.full((len(cloud), 3), np.nan)
    cloud_xyz[known] = moved_points(seen.cloud_xyz[place[known]], motion)
    return replace(seen, row=np.append(seen.row, np.int32(0))[place], xyz=xyz, cloud_xyz=cloud_xyz), place


def moved_points(xyz: npt.NDArray[np.floating], motion: Transform) -> FloatArray:
    """Return positions (N, 3) in the other frame, float64."""
    found: FloatArray = xyz @ motion.rotation.T + motion.position
    return found
