# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Image grids of made planes and of simulated scenes, with normal noise of the depth that is known."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from topo_region_seg.data import Cloud
from topo_region_seg.offline.simulation import Body, Box, Camera, Paint, Scene
from topo_region_seg.offline.simulation.camera import TABLE_CENTER
from topo_region_seg.offline.simulation.raycast import render
from topo_region_seg.offline.simulation.tabletop import room_of_table
from topo_region_seg.steps.view.grid import ImageGrid, image_grid
from topo_region_seg.steps.view.model import SensorModel, sensor_model
from topo_region_seg.steps.view.table import KNOTS, DepthTable

Array = npt.NDArray[np.float64]
Sigma = Callable[[Array], Array]
Z = np.array([0.0, 0.0, 1.0])
TOP = TABLE_CENTER[2]
GRAY = Paint((120, 120, 120))


@dataclass(frozen=True)
class Frame:
    """A frame of a camera that looks along z: points (P, 3), and the number of the body that each shows."""

    xyz: Array
    body: npt.NDArray[np.int64]
    height: int
    width: int

    @property
    def cloud(self) -> Cloud:
        return Cloud(self.xyz.astype(np.float32), None, self.height, self.width)

    @property
    def grid(self) -> ImageGrid:
        return grid_of(self.xyz, self.height, self.width)

    @property
    def model(self) -> SensorModel:
        model = sensor_model(self.grid)
        assert model is not None
        return model


def constant(value: float) -> DepthTable:
    """Return a table that is the same at every depth."""
    return DepthTable(0.1, 10.0, np.full(KNOTS, value))


def grid_of(xyz: Array, height: int, width: int) -> ImageGrid:
    """Return the image grid of positions (P, 3), NaN where there is none."""
    rows = np.flatnonzero(np.isfinite(xyz).all(axis=1))
    return image_grid(np.asfortranarray(xyz[rows]), rows, height, width, Z)


def plane(height: int, width: int, pixel: float, slopes: tuple[float, float], far: float, sigma: Sigma, seed: int):
    """Return points (P, 3) of a plane, ``far`` in the middle of the image, and their true depths (P,)."""
    v, u = (np.mgrid[0:height, 0:width].reshape(2, -1).T - [(height - 1) / 2, (width - 1) / 2]).T * pixel
    true = far / (1.0 + slopes[0] * u + slopes[1] * v)
    depth = true + sigma(true) * np.random.default_rng(seed).normal(size=true.shape)
    return np.column_stack([u * depth, v * depth, depth]), true


def kinect(z: Array) -> Array:
    """Noise of a structured-light camera: 1 mm at 1 m."""
    return 0.001 * z * z


def looking(camera: Camera, scene: Scene, sigma: Sigma = kinect, seed: int = 0) -> Frame:
    """Return the frame of a scene; bodies count from 0, the background first; -1 where nothing is seen."""
    seen = render(scene, camera)
    labels = seen.labels.astype(np.int64)
    background = len(scene.background)
    body = np.where(labels >= 20, labels // 10 - 2 + background, labels - 1)
    depth = seen.depth + sigma(seen.depth) * np.random.default_rng(seed).normal(size=seen.depth.shape)
    return Frame(camera.rays() * depth[:, None], body, camera.height, camera.width)


def on_table(*things: Body) -> Scene:
    """Return a table in a room, with things."""
    return Scene(room_of_table(), things)


def box(x: float, y: float, size: tuple[float, float, float] = (0.1, 0.12, 0.12), lift: float = 0.0) -> Body:
    """Return a box on the table, its middle at x (away from the camera) and y (to the left)."""
    return Body(Box(size), GRAY, (x, y, TOP + size[2] / 2 + lift), 0.4)
