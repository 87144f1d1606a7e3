# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""One simulated frame: an organized cloud as a sensor would deliver it, with ground truth."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from topo_region_seg.data import Cloud, FloatArray, LabelArray
from topo_region_seg.offline.simulation.camera import Camera
from topo_region_seg.offline.simulation.noise import DepthNoise
from topo_region_seg.offline.simulation.parts import PartNumbers
from topo_region_seg.offline.simulation.raycast import render
from topo_region_seg.offline.simulation.scene import Scene
from topo_region_seg.offline.simulation.sensor import Sensor


@dataclass(frozen=True)
class SimulatedFrame:
    """A cloud with its truth.

    Parameters
    ----------
    cloud : Cloud
        Organized, float32, NaN where the sensor has no depth (the color is present).
    labels : (N,) uint32
        Truth: 0 invalid, 1-9 background bodies, 20-29 parts of the first object, 30-39 of the second, ...
    xyz : (N, 3) float64
        True points in the camera's frame, metres; NaN where there is no surface.
    normals : (N, 3) float64
        True unit normals towards the camera; NaN where there is no surface.
    """

    cloud: Cloud
    labels: LabelArray
    xyz: FloatArray
    normals: FloatArray


KINECT = DepthNoise()


def simulate(
    scene: Scene,
    camera: Camera,
    seed: int = 0,
    noise: Sensor | None = KINECT,
    numbers: PartNumbers | None = None,
) -> SimulatedFrame:
    """Return the frame that `camera` delivers of `scene`; the same arguments always give the same frame.

    Parameters
    ----------
    scene : Scene
        The scene.
    camera : Camera
        Intrinsics and pose.
    seed : int
        Seed of the noise.
    noise : Sensor or None
        What the sensor makes of the depth and the colors; None gives exact points and colors.
    numbers : PartNumbers, optional
        One for all frames of a stream makes the true labels stay with the parts of objects; it remembers them. Without
        it, parts are numbered from the largest in each frame.
    """
    rng = np.random.default_rng(seed)
    seen = render(scene, camera, numbers)
    rays = camera.rays()
    depth = seen.depth
    labels = seen.labels
    if noise is None:
        rgb = np.clip(np.round(seen.rgb), 0, 255).astype(np.uint8)
    else:
        shape = (camera.height, camera.width)
        cosine = -np.einsum("ij,ij->i", rays, seen.normals) / np.linalg.norm(rays, axis=1)
        depth = noise.observed(depth.reshape(shape), cosine.reshape(shape), camera.fx, rng).ravel()
        labels = np.where(np.isnan(depth), 0, labels).astype(np.uint32)
        rgb = noise.colored(seen.rgb, rng)
    xyz = (rays * depth[:, None]).astype(np.float32)
    return SimulatedFrame(
        Cloud(xyz, rgb, camera.height, camera.width), labels, rays * seen.depth[:, None], seen.normals
    )
