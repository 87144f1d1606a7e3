# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""RGB-D cameras of three kinds in front of tabletops, vessels, heaps, bins, shelves and rooms, with ground truth.

>>> from topo_region_seg.offline.simulation import Camera, simulate, tabletop
>>> frame = simulate(tabletop(seed=1), Camera.kinect(320, 240), seed=1)
>>> frame.cloud.height, frame.labels.dtype
(240, dtype('uint32'))
"""

from __future__ import annotations

from topo_region_seg.offline.simulation.camera import Camera, orbit
from topo_region_seg.offline.simulation.frame import SimulatedFrame, simulate
from topo_region_seg.offline.simulation.hollow import Compound, Cup
from topo_region_seg.offline.simulation.kinds import SCENES, SENSORS, simulated
from topo_region_seg.offline.simulation.noise import DepthNoise
from topo_region_seg.offline.simulation.parts import PartNumbers
from topo_region_seg.offline.simulation.scene import Body, Paint, Scene
from topo_region_seg.offline.simulation.shapes import Box, Cylinder, Sphere
from topo_region_seg.offline.simulation.stereo import ActiveStereo
from topo_region_seg.offline.simulation.tabletop import tabletop
from topo_region_seg.offline.simulation.time_of_flight import TimeOfFlight

__all__ = [
    "SCENES",
    "SENSORS",
    "ActiveStereo",
    "Body",
    "Box",
    "Camera",
    "Compound",
    "Cup",
    "Cylinder",
    "DepthNoise",
    "Paint",
    "PartNumbers",
    "Scene",
    "SimulatedFrame",
    "Sphere",
    "TimeOfFlight",
    "orbit",
    "simulate",
    "simulated",
    "tabletop",
]
