# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""A frame as it is seen: its image grid, its sensor, the surfaces in it, and what each pixel belongs to."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from topo_region_seg.compiled.dialect import inlined
from topo_region_seg.data import FloatArray
from topo_region_seg.steps.view.grid import ImageGrid
from topo_region_seg.steps.view.model import SensorModel
from topo_region_seg.steps.view.table import DepthTable

Classes = npt.NDArray[np.uint8]
NOTHING, SUPPORT, BEHIND, STRUCTURE, FREE = range(5)
"""Classes of pixels: without depth; on the support plane; behind it; on another surface, such as a wall; and what may
belong to things."""


@dataclass(frozen=True, eq=False)
class Surface:
    """A finite plane ``normal · x + offset = 0`` in the frame of the sensor, its normal towards it.

    Parameters
    ----------
    normal : (3,) float64
        Unit normal.
    offset : float
        Distance of the sensor, metres.
    share, front, through : float
        Shares of the points that are on it, in front of its footprint, and seen through it.
    side : float
        Its shorter side, metres.
    own : float
        Share of its outline where it hides what is beyond.
    center : (3,) float64
        Mean of its points, metres.
    axes : (3, 2) float64
        Orthonormal axes in the plane.
    hull : (K, 3) float64
        Its footprint: points `p` of the plane where ``hull[:, :2] @ ((p - center) @ axes) + hull[:, 2] <= 0``.
    """

    normal: FloatArray
    offset: float
    share: float
    front: float
    through: float
    side: float
    own: float
    center: FloatArray
    axes: FloatArray
    hull: FloatArray


@inlined
def within_footprint(xyz, p, center, axes, hull, near):  # type: ignore[no-untyped-def]
    """Return whether pixel `p` lies above a surface's footprint, or at most `near` (m) beside it."""
    a, b = 0.0, 0.0
    for c in range(3):
        d = xyz[p, c] - center[c]
        a += d * axes[c, 0]
        b += d * axes[c, 1]
    k = 0
    while k < len(hull) and hull[k, 0] * a + hull[k, 1] * b + hull[k, 2] <= near:
        k += 1
    return k == len(hull)


@dataclass(frozen=True, eq=False)
class Scene:
    """What is known of a frame before things are told apart in it.

    Parameters
    ----------
    grid : ImageGrid
        The pixels.
    model : SensorModel
        The sensor.
    classes : (P,) uint8
        Class of each pixel.
    support : Surface or None
        What carries the things.
    structure : tuple of Surface
        Other surfaces that are no things, such as walls.
    margin : DepthTable or None
        Height above the support within which points are on it, metres, by depth.
    axes : (3, 3) float64
        The camera's axes: the image's right, down, and the middle of the view.
    stands_for : (P,) int32 or None
        The pixel, counted from 1, whose normal and region each has; 0 where there is none. None: each has its own.
    """

    grid: ImageGrid
    model: SensorModel
    classes: Classes
    support: Surface | None = None
    structure: tuple[Surface, ...] = ()
    margin: DepthTable | None = None
    axes: FloatArray = field(default_factory=lambda: np.eye(3))
    stands_for: npt.NDArray[np.int32] | None = None
