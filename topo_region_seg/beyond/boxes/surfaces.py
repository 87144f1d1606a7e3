# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Boxes around the surfaces that were set aside: the support of the things, and walls and the like."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from topo_region_seg.beyond.boxes.extents import extents
from topo_region_seg.beyond.boxes.oriented import quaternions
from topo_region_seg.beyond.boxes.rectangles import smallest_rectangle
from topo_region_seg.data import BoolArray, Cloud, FloatArray, Plane
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
    scene, found = seg.filtered.scene, []
    if scene is not None:
        found = [_footprint(scene, surface, seg.filtered.sensor) for surface in seg.surfaces]
    elif seg.plane is not None:
        found = [_on_plane(cloud, seg, seg.plane)]
    support = np.arange(len(found)) < (1 if scene is None or scene.support is not None else 0)
    center, axes, size = (np.array([box[part] for box in found]) for part in range(3))
    return SurfaceBoxes(support, center.reshape(-1, 3), axes.reshape(-1, 3, 3), size.reshape(-1, 3))


def _footprint(scene: Scene, surface: Surface, sensor: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    corners = corners_of(surface.hull)
    low, high, sides = _rectangle(corners)
    middle = surface.center + surface.axes @ (sides.T @ ((low + high) / 2))
    # The mean of noisy points lies on the plane; what is seen from its camera counts as depth.
    depth = float(middle @ scene.axes[2])
    noise = 0.0 if scene.margin is None else _at_depth(scene, depth)
    size = np.append(high - low, 2.0 * max(SLAB, noise))
    return middle + sensor, _axes(surface.axes @ sides.T, surface.normal), size


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


def _on_plane(cloud: Cloud, seg: Segmentation, plane: Plane) -> tuple[FloatArray, FloatArray, FloatArray]:
    normal = np.array(plane.normal)
    slab = float(seg.filtered.growth.floor_distance)
    with np.errstate(invalid="ignore", over="ignore"):  # points without depth
        height = cloud.xyz @ normal.astype(cloud.xyz.dtype) + plane.offset
        on = np.flatnonzero((np.abs(height) <= slab) & (seg.labels == 0) & cloud.xyz.any(axis=1))
    on = on[:: max(1, len(on) // FITTED)]
    points = cloud.xyz[on].astype(np.float64)
    a = np.cross(normal, np.eye(3)[int(np.argmin(np.abs(normal)))])
    a /= np.linalg.norm(a)
    plane_axes = np.column_stack([a, np.cross(normal, a)])
    if len(points) == 0:  # nothing of it is left in the cloud
        return -plane.offset * normal, np.column_stack([plane_axes, normal]), np.array([0.0, 0.0, 2 * slab])
    _, _, sides = _rectangle(points @ plane_axes)
    axes = _axes(plane_axes @ sides.T, normal)
    low, high = (ends[0] for ends in extents(points, np.array([0, len(points)]), axes.T[None].copy()))
    low[2], high[2] = -plane.offset - slab, -plane.offset + slab
    size = high - low
    center = axes @ ((low + high) / 2)
    if size[0] < size[1]:
        axes, size = np.column_stack([axes[:, 1], -axes[:, 0], axes[:, 2]]), size[[1, 0, 2]]
    return center, axes, size


def _rectangle(points: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the ends (2,) of the smallest rectangle around points (K, 2), and its axes as rows, the longer first."""
    x, y, _ = smallest_rectangle(outline(points), 0.0)
    sides = np.array([[x, y], [-y, x]])
    low, high = (points @ sides.T).min(axis=0), (points @ sides.T).max(axis=0)
    if high[0] - low[0] < high[1] - low[1]:
        sides = np.array([sides[1], -sides[0]])
        low, high = np.array([low[1], -high[0]]), np.array([high[1], -low[0]])
    return low, high, sides


def outline(points: FloatArray) -> FloatArray:
    """Return the points (K, 2) that lie outermost in some directions, among them the corners of any rectangle."""
    angle = np.arange(16) * np.pi / 16
    along = points @ np.stack([np.cos(angle), np.sin(angle)])
    return np.ascontiguousarray(points[np.concatenate([along.argmin(axis=0), along.argmax(axis=0)])])


def _axes(plane_axes: FloatArray, normal: FloatArray) -> FloatArray:
    """Return a rotation: the first axis in the plane, the one a quarter turn about the normal further, the normal."""
    x = plane_axes[:, 0]
    return np.column_stack([x, np.cross(normal, x), normal])
