# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Every kind of scene and every kind of camera, by name, to be combined."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from topo_region_seg.offline.simulation import room as furnished
from topo_region_seg.offline.simulation.camera import TABLE_CENTER, Camera
from topo_region_seg.offline.simulation.frame import KINECT, SimulatedFrame, simulate
from topo_region_seg.offline.simulation.heap import clutter, full_bin
from topo_region_seg.offline.simulation.scene import Scene
from topo_region_seg.offline.simulation.sensor import Sensor
from topo_region_seg.offline.simulation.shelf import shelf
from topo_region_seg.offline.simulation.stereo import ActiveStereo
from topo_region_seg.offline.simulation.tabletop import tabletop
from topo_region_seg.offline.simulation.time_of_flight import TimeOfFlight
from topo_region_seg.offline.simulation.vessels import vessels


@dataclass(frozen=True)
class Kind:
    """A kind of scene.

    Parameters
    ----------
    scene : callable
        Returns the scene of a seed.
    eye, target : (x, y, z)
        From where it is seen, metres.
    """

    scene: Callable[[int], Scene]
    eye: tuple[float, float, float] = (-0.66, 0.0, 1.28)
    target: tuple[float, float, float] = TABLE_CENTER


SCENES: Mapping[str, Kind] = {
    "tabletop": Kind(tabletop),
    "vessels": Kind(vessels, (-0.5, 0.0, 1.3)),
    "clutter": Kind(clutter, (-0.5, 0.1, 1.3)),
    "bin": Kind(full_bin, (-0.25, 0.0, 1.5), (0.0, 0.0, 0.8)),
    "shelf": Kind(shelf, (-0.75, 0.15, 0.95), (0.25, 0.0, 0.72)),
    "room": Kind(furnished.room, furnished.EYE, furnished.TARGET),
}
SENSORS: Mapping[str, Sensor] = {
    "structured light": KINECT,
    "active stereo": ActiveStereo(),
    "time of flight": TimeOfFlight(),
}


def simulated(scene: str, sensor: str, seed: int, width: int = 640, height: int = 480) -> SimulatedFrame:
    """Return the frame of a kind of scene and a kind of camera; the same arguments always give the same frame."""
    kind = SCENES[scene]
    camera = Camera.kinect(width, height).look(kind.eye, kind.target)
    return simulate(kind.scene(seed), camera, seed, SENSORS[sensor])
