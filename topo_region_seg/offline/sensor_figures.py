# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""What a cloud tells of its camera, as plain numbers for texts, records and reports."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from topo_region_seg.beyond.objects.image import sensor_model_of
from topo_region_seg.data import Cloud
from topo_region_seg.params import Params


@dataclass(frozen=True)
class DepthFigures:
    """The noise of a depth and the step in which depths come there, metres; None where no step can be told."""

    depth: float
    noise: float
    step: float | None


@dataclass(frozen=True)
class SensorFigures:
    """Figures of a camera.

    Parameters
    ----------
    pixel_rad : float
        Angle between neighboring pixels, radians.
    valid : float
        Share of the pixels that have a depth.
    noise : list of DepthFigures
        At the nearest, the middle and the farthest depth.
    """

    pixel_rad: float
    valid: float
    noise: list[DepthFigures]

    @property
    def pixels_text(self) -> str:
        """Say how far pixels are apart, and how many have a depth."""
        return f"pixels {math.degrees(self.pixel_rad):.3f} deg apart, {100 * self.valid:.1f} % valid"

    @property
    def noise_text(self) -> str:
        """Say how noisy depths are."""
        return ", ".join(f"{1e3 * at.noise:.2f} mm at {at.depth:.2f} m" for at in self.noise)

    @property
    def steps_text(self) -> str:
        """Say in what steps depths come."""
        known = [f"{1e3 * at.step:.2f} mm at {at.depth:.2f} m" for at in self.noise if at.step is not None]
        return ", ".join(known) or "none that can be told"


def sensor_figures(cloud: Cloud, params: Params | None = None) -> SensorFigures | None:
    """Return what a cloud tells of its camera; None where no camera made it."""
    model = sensor_model_of(cloud, params)
    if model is None:
        return None
    depths = np.array([model.depths[0], model.middle, model.depths[-1]])
    columns = (values.tolist() for values in (depths, model.noise_at(depths), model.step_at(depths)))
    rows = zip(*columns, strict=True)
    noise = [DepthFigures(depth, noise, step if math.isfinite(step) else None) for depth, noise, step in rows]
    return SensorFigures(model.pixel, model.valid, noise)
