# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""What a depth camera makes of the true depth."""

from __future__ import annotations

from typing import Protocol

import numpy as np
import numpy.typing as npt
from scipy import ndimage

from topo_region_seg.data import FloatArray


class Sensor(Protocol):
    """A model of a depth camera."""

    def observed(self, depth: FloatArray, cosine: FloatArray, focal: float, rng: np.random.Generator) -> FloatArray:
        """Return the depth (H, W) that the camera delivers, NaN where it has none.

        Parameters
        ----------
        depth, cosine : (H, W) float64
            True depth (metres) and cosine of the angle of incidence; NaN without a surface.
        focal : float
            Focal length of the image, pixels.
        rng : numpy.random.Generator
            Source of randomness.
        """

    def colored(self, rgb: FloatArray, rng: np.random.Generator) -> npt.NDArray[np.uint8]:
        """Return `rgb` (N, 3) with noise, as 8-bit levels."""


def colors_with_noise(rgb: FloatArray, sigma: float, rng: np.random.Generator) -> npt.NDArray[np.uint8]:
    """Return colors (N, 3) with noise of a standard deviation, 8-bit levels."""
    return np.clip(np.round(rgb + rng.normal(0.0, sigma, rgb.shape)), 0, 255).astype(np.uint8)


def smooth_field(shape: tuple[int, ...], size: float, rng: np.random.Generator) -> FloatArray:
    """Return normal noise of unit variance (H, W) that is alike over about `size` pixels."""
    field: FloatArray = ndimage.gaussian_filter(rng.normal(size=shape), size, mode="wrap")
    return field / field.std()


def averaged(values: FloatArray, weight: FloatArray, size: float) -> FloatArray:
    """Return the mean of values (H, W) under a Gaussian window of standard deviation `size`; NaN without weight."""
    total = ndimage.gaussian_filter(weight, size, mode="nearest", truncate=2.5)
    mean = ndimage.gaussian_filter(np.where(weight > 0, values, 0.0) * weight, size, mode="nearest", truncate=2.5)
    with np.errstate(divide="ignore", invalid="ignore"):
        result: FloatArray = np.where(total > 0, mean / total, np.nan)
    return result
