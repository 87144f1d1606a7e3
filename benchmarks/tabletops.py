# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Frames of a simulated camera, as far from the table as to leave as many points of it as the recorded ones do."""

from __future__ import annotations

from topo_region_seg.data import Cloud
from topo_region_seg.offline.simulation import Camera, simulate, tabletop

FRAME = "camera_depth_optical_frame"
EYE = (-0.91, 0.0, 1.49)
"""1.2 m from the middle of the table."""


def camera(width: int, height: int) -> Camera:
    """Return a camera with so many pixels."""
    return Camera.kinect(width, height).look(EYE)


def seen(seed: int, width: int, height: int) -> Cloud:
    """Return what it sees of a tabletop, in its frame."""
    return simulate(tabletop(seed), camera(width, height), seed=seed).cloud
