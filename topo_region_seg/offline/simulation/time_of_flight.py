# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""A time-of-flight camera, such as an Azure Kinect or a Kinect v2.

Each pixel measures how far light has traveled, from its phase. Noise falls with the light that comes back, which falls
with the square of the distance and with the angle of incidence. A pixel that sees two surfaces mixes their light and
reports a depth between them: flying pixels along outlines. The phase errs periodically with the depth, the same in
every frame (Tölgyessy et al., "Evaluation of the Azure Kinect and Its Comparison to Kinect V1 and Kinect V2", 2021).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy import ndimage

from topo_region_seg.data import FloatArray
from topo_region_seg.offline.simulation.sensor import averaged, colors_with_noise


@dataclass(frozen=True)
class TimeOfFlight:
    """Parameters of the camera; the defaults are like an Azure Kinect's.

    Parameters
    ----------
    sigma : float
        Standard deviation of the depth of a surface that is seen straight on at 1 m, metres.
    blur : float
        Standard deviation of the spot that a pixel sees, pixels.
    wiggle : tuple of float
        Amplitude and period over depth of the periodic error, metres.
    dimmest : float
        Light that comes back, in that of a surface that is seen straight on at 1 m, below which there is no depth.
    flying : float
        Change of the depth from pixel to pixel, as a share of it, above which the camera drops `dropped` of the pixels.
    dropped : float
        Share of such pixels that it drops.
    color_sigma : float
        Standard deviation of the color channels, 8-bit levels.
    """

    sigma: float = 0.0012
    blur: float = 0.6
    wiggle: tuple[float, float] = (0.0015, 0.75)
    dimmest: float = 0.01
    flying: float = 0.03
    dropped: float = 0.5
    color_sigma: float = 2.0

    def observed(self, depth: FloatArray, cosine: FloatArray, focal: float, rng: np.random.Generator) -> FloatArray:
        """Return the depth (H, W) that the camera delivers, NaN where it has none."""
        seen = np.isfinite(depth)
        near = np.where(seen, depth, 1.0)
        light = np.where(seen, np.clip(cosine, 0.0, 1.0) / near**2, 0.0)
        mixed = averaged(near, light, self.blur)
        amplitude, period = self.wiggle
        mixed += amplitude * np.sin(2.0 * np.pi * mixed / period)
        received = ndimage.gaussian_filter(light, self.blur, mode="nearest")
        mixed += self.sigma / np.sqrt(np.maximum(received, 1e-6)) * rng.normal(size=depth.shape)
        filled = np.where(np.isfinite(mixed), mixed, 0.0)
        change = ndimage.maximum_filter(filled, 3) - ndimage.minimum_filter(filled, 3)
        slope = 2.0 * near / focal / np.maximum(np.where(seen, cosine, 1.0), 0.1)  # of a plane at that angle
        flying = change > self.flying * near + slope
        lost = ~seen | (received < self.dimmest) | (flying & (rng.random(depth.shape) < self.dropped))
        return np.where(lost, np.nan, mixed)

    def colored(self, rgb: FloatArray, rng: np.random.Generator) -> npt.NDArray[np.uint8]:
        """Return `rgb` (N, 3) with noise, as 8-bit levels."""
        return colors_with_noise(rgb, self.color_sigma, rng)
