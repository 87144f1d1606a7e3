# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Pinhole cameras in the optical convention: x right, y down, z forward."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from topo_region_seg.data import FloatArray

TABLE_CENTER = (0.0, 0.0, 0.72)
_EYE = (-0.66, 0.0, 1.28)


@dataclass(frozen=True)
class Camera:
    """A pinhole camera with a pose in the world (z up).

    Parameters
    ----------
    width, height : int
        Size of the image, pixels.
    fx, fy, cx, cy : float
        Focal lengths and principal point, pixels.
    eye, target : (x, y, z)
        Position of the camera and the point it looks at, metres; not exactly above one another.
    """

    width: int
    height: int
    fx: float
    fy: float
    cx: float
    cy: float
    eye: tuple[float, float, float] = _EYE
    target: tuple[float, float, float] = TABLE_CENTER

    @classmethod
    def kinect(cls, width: int = 640, height: int = 480) -> Camera:
        """Return a camera with the field of view of a Kinect, in front of the table, looking at its middle."""
        focal = 525.0 * width / 640
        return cls(width, height, focal, focal, (width - 1) / 2, (height - 1) / 2)

    def look(self, eye: tuple[float, float, float], target: tuple[float, float, float] = TABLE_CENTER) -> Camera:
        """Return the same camera with another pose."""
        return replace(self, eye=eye, target=target)

    @property
    def rotation(self) -> FloatArray:
        """Matrix (3, 3) from the camera's frame to the world."""
        forward = np.subtract(self.target, self.eye)
        forward = forward / np.linalg.norm(forward)
        right = np.cross(forward, (0.0, 0.0, 1.0))
        right /= np.linalg.norm(right)
        return np.stack([right, np.cross(forward, right), forward], axis=1)

    def rays(self) -> FloatArray:
        """Return the viewing rays of all pixels in the camera's frame with z = 1, shape (height * width, 3)."""
        u, v = np.meshgrid(np.arange(self.width), np.arange(self.height))
        x, y = (u - self.cx) / self.fx, (v - self.cy) / self.fy
        return np.stack([x, y, np.ones_like(x)], axis=-1).reshape(-1, 3)


def orbit(camera: Camera, count: int, sweep: float = math.radians(40.0)) -> list[Camera]:
    """Return `count` cameras on an arc of `sweep` radians about the vertical through the target."""
    turned = []
    for angle in np.linspace(-sweep / 2, sweep / 2, count) if count > 1 else (0.0,):
        c, s = math.cos(angle), math.sin(angle)
        x, y = camera.eye[0] - camera.target[0], camera.eye[1] - camera.target[1]
        eye = (camera.target[0] + c * x - s * y, camera.target[1] + s * x + c * y, camera.eye[2])
        turned.append(camera.look(eye, camera.target))
    return turned
