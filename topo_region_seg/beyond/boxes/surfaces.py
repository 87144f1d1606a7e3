# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Boxes around the surfaces that were set aside: the support of the things, and walls and the like."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from topo_region_seg.beyond.boxes.extents import extents
from topo_region_seg.beyond.boxes.frames import upright_frames
from topo_region_seg.beyond.boxes.oriented import boxes_between, quaternions
from topo_region_seg.compiled.dialect import kernel
from topo_region_seg.data import BoolArray, Cloud, FloatArray, LabelArray, Plane
from topo_region_seg.segmentation import Segmentation
from topo_region_seg.steps.view.scene import Scene, Surface

FITTED = 20_000
"""About how many points of a plane its rectangle is laid around."""
SLAB = 0.004
"""Distance, metres, within which points belong to a surface of an image where its noise tells nothing else."""


@dataclass(frozen=True)
class SurfaceBoxes:
    """Flat boxes, one row each; lengths in metres, frame of the input.

    Parameters
    ----------
    support : (M,) bool
        Whether things stand on it; the one that they do comes first. False: other structure, such as a wall.
    center : (M, 3) float64
        Middle of the box.
    axes : (M, 3, 3) float64
        A rotation whose columns are the axes: x along the longer side, z along the normal, which points to the side of
        the sensor.
    size : (M, 3) float64
        Whole lengths along the axes; the last one is the slab within which points belong to the surface.
    """

    support: BoolArray
    center: FloatArray
    axes: FloatArray
    size: FloatArray

    def __len__(self) -> int:
        return len(self.support)

    @property
    def quaternion(self) -> FloatArray:
        """The rotations as unit quaternions x, y, z, w, with w not below 0, (M, 4) float64."""
        return quaternions(self.axes)


def surface_boxes(cloud: Cloud, seg: Segmentation) -> SurfaceBoxes:
    """Return a box for each surface that a segmentation found and set aside, that of the support first.

    Objects of organized clouds know the footprint of each surface. Elsewhere there is the removed support plane alone,
    and the box is laid around the points on it that have no label.

    Parameters
    ----------
    cloud : Cloud
        What was segmented.
    seg : Segmentation
        The result.
    """
    scene, sensor = seg.filtered.scene, seg.filtered.sensor
    found = []
    if scene is not None:
        found = [_flat_box(*_footprint(scene, surface), sensor) for surface in seg.surfaces]
    elif seg.plane is not None:
        found = [_flat_box(*_on_plane(cloud, seg, seg.plane), np.zeros(3))]
    support = np.arange(len(found)) < (1 if scene is None or scene.support is not None else 0)
    center, axes, size = (np.array([box[part] for box in found]) for part in range(3))
    return SurfaceBoxes(support, center.reshape(-1, 3), axes.reshape(-1, 3, 3), size.reshape(-1, 3))


def _flat_box(
    points: FloatArray, normal: FloatArray, offset: float, slab: float, sensor: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return center, axes and size of the box around points (N, 3), as thick as the slab on either side of a plane."""
    start = np.array([0, len(points)])
    frames = upright_frames(points, start, normal)
    low, high = extents(points, start, frames)
    low[:, 2], high[:, 2] = -offset - slab, -offset + slab
    center, axes, size = boxes_between(low, high, frames, np.zeros(3), upright=True)
    return center[0] + sensor, axes[0], size[0]


def _footprint(scene: Scene, surface: Surface) -> tuple[FloatArray, FloatArray, float, float]:
    corners = surface.center + corners_of(surface.hull) @ surface.axes.T
    slab = SLAB if scene.margin is None else max(SLAB, _at_depth(scene, float(surface.center @ scene.axes[2])))
    return corners, surface.normal, surface.offset, slab


def _at_depth(scene: Scene, depth: float) -> float:
    margin = scene.margin
    assert margin is not None
    return float(np.interp((depth - margin.near) * margin.density, np.arange(len(margin.value)), margin.value))


def corners_of(hull: FloatArray) -> FloatArray:
    """Return the corners (K, 2) of the convex region ``hull[:, :2] @ p + hull[:, 2] <= 0``; normals have length 1."""
    turn = np.argsort(np.arctan2(hull[:, 1], hull[:, 0]))
    side = hull[turn]
    # The same line may be there more than once.
    side = side[np.linalg.norm(side - np.roll(side, 1, axis=0), axis=1) > 1e-9]
    after = np.roll(side, -1, axis=0)
    determinant = side[:, 0] * after[:, 1] - side[:, 1] * after[:, 0]
    x = (side[:, 1] * after[:, 2] - after[:, 1] * side[:, 2]) / determinant
    y = (after[:, 0] * side[:, 2] - side[:, 0] * after[:, 2]) / determinant
    return np.column_stack([x, y])


def _on_plane(cloud: Cloud, seg: Segmentation, plane: Plane) -> tuple[FloatArray, FloatArray, float, float]:
    normal, slab = np.array(plane.normal), float(seg.filtered.growth.floor_distance)
    points = points_on(np.ascontiguousarray(cloud.xyz), seg.labels, normal, plane.offset, slab, FITTED)
    if len(points) == 0:  # nothing of it is left in the cloud
        points = -plane.offset * normal[None]
    return points, normal, plane.offset, slab


@kernel
def points_on(
    xyz: npt.NDArray[np.floating], labels: LabelArray, normal: FloatArray, offset: float, near: float, most: int
) -> FloatArray:
    """Return the points up to `near` (m) from a plane that have no label, or evenly about `most` of them, (K, 3)."""
    found = np.empty(len(xyz), np.int64)
    count = 0
    for i in range(len(xyz)):
        x, y, z = xyz[i, 0], xyz[i, 1], xyz[i, 2]
        height = x * normal[0] + y * normal[1] + z * normal[2] + offset
        if labels[i] == 0 and abs(height) <= near and (x != 0.0 or y != 0.0 or z != 0.0):
            found[count] = i
            count += 1
    step = max(1, count // most)
    points = np.empty(((count + step - 1) // step, 3))
    for k in range(len(points)):
        for c in range(3):
            points[k, c] = xyz[found[k * step], c]
    return points


def warm_up_surfaces() -> None:
    """Compile the kernel of surfaces, or load it from the cache."""
    points_on(np.zeros((1, 3), np.float32), np.zeros(1, np.uint32), np.array([0.0, 0.0, 1.0]), 1.0, 0.1, 1)
