# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Noise of a structured-light RGB-D camera (first Kinect).

The camera triangulates against a projector `baseline` metres beside it and measures the disparity d = f b / z to
1/8 pixel. Noise and rounding of d become errors of the depth that grow with z^2 (Khoshelham and Oude Elberink, 2012).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy import ndimage

from topo_region_seg.data import BoolArray, FloatArray
from topo_region_seg.offline.simulation.sensor import colors_with_noise


@dataclass(frozen=True)
class DepthNoise:
    """Parameters of the noise; the defaults are a first Kinect's.

    Parameters
    ----------
    baseline : float
        Distance of the projector from the camera, metres.
    focal : float
        Focal length of the infrared camera, its own pixels (not those of the delivered image).
    disparity_sigma : float
        Standard deviation of the disparity, pixels.
    disparity_step : float
        Rounding of the disparity, pixels; 0 = none.
    grazing_from, grazing_to : float
        Angles of incidence between which the share of lost points rises from 0 to 1, degrees.
    edge_jump : float
        Depth difference between neighboring pixels that counts as an edge, as a share of the depth.
    edge_loss, random_loss : float
        Share of points lost at depth edges and everywhere.
    color_sigma : float
        Standard deviation of the color channels, 8-bit levels.
    """

    baseline: float = 0.075
    focal: float = 580.0
    disparity_sigma: float = 0.0625
    disparity_step: float = 0.125
    grazing_from: float = 75.0
    grazing_to: float = 87.0
    edge_jump: float = 0.02
    edge_loss: float = 0.5
    random_loss: float = 0.002
    color_sigma: float = 2.0

    def depth_sigma(self, depth: npt.ArrayLike) -> FloatArray:
        """Return the standard deviation of the depth, rounding included, metres."""
        disparity = np.hypot(self.disparity_sigma, self.disparity_step / np.sqrt(12.0))
        sigma: FloatArray = np.square(depth) * disparity / (self.focal * self.baseline)
        return sigma

    def observed(self, depth: FloatArray, cosine: FloatArray, focal: float, rng: np.random.Generator) -> FloatArray:
        """Return the depth (H, W) that the camera delivers, NaN where it has none; see :meth:`lost`."""
        lost = self.lost(depth, cosine, focal, rng)
        return np.where(lost, np.nan, self.measured(depth, rng))

    def measured(self, depth: FloatArray, rng: np.random.Generator) -> FloatArray:
        """Return `depth` (any shape, metres) as measured: noise and rounding in disparity."""
        scale = self.focal * self.baseline
        disparity = scale / depth + rng.normal(0.0, self.disparity_sigma, depth.shape)
        if self.disparity_step:
            disparity = np.round(disparity / self.disparity_step) * self.disparity_step
        return np.where(disparity > 0, scale / np.where(disparity > 0, disparity, 1.0), np.nan)

    def lost(self, depth: FloatArray, cosine: FloatArray, focal: float, rng: np.random.Generator) -> BoolArray:
        """Return which pixels have no depth.

        Parameters
        ----------
        depth, cosine : (H, W) float64
            True depth (metres, NaN without a surface) and cosine of the angle of incidence.
        focal : float
            Focal length of the delivered image, its pixels.
        rng : numpy.random.Generator
            Source of randomness.
        """
        nothing = np.isnan(depth)
        angle = np.degrees(np.arccos(np.clip(np.where(nothing, 1.0, cosine), 0.0, 1.0)))
        grazing = np.clip((angle - self.grazing_from) / (self.grazing_to - self.grazing_from), 0.0, 1.0)
        filled = np.where(nothing, 1e3, depth)
        jump = ndimage.maximum_filter(filled, 3) - ndimage.minimum_filter(filled, 3)
        steep = depth / np.maximum(cosine, 0.05) / focal * 4  # a slanted plane changes by this over three pixels
        edge = jump > np.maximum(self.edge_jump * filled, np.where(nothing, 0.0, steep))
        chance = np.maximum(np.maximum(grazing, self.edge_loss * edge), self.random_loss)
        lost: BoolArray = nothing | (rng.random(depth.shape) < chance) | self.shadowed(depth, focal)
        return lost

    def shadowed(self, depth: FloatArray, focal: float) -> BoolArray:
        """Return which pixels of `depth` (H, W) the projector, to the right of the camera, does not illuminate."""
        return hidden_from_the_right(depth, focal * self.baseline, self.edge_jump)

    def colored(self, rgb: FloatArray, rng: np.random.Generator) -> npt.NDArray[np.uint8]:
        """Return `rgb` (N, 3) with noise, as 8-bit levels."""
        return colors_with_noise(rgb, self.color_sigma, rng)


def hidden_from_the_right(depth: FloatArray, scale: float, jump: float) -> BoolArray:
    """Return which pixels a projector or a second camera to the right does not see.

    Parameters
    ----------
    depth : (H, W) float64
        True depth, metres; NaN without a surface.
    scale : float
        Focal length of the image times the distance of the two, pixels times metres.
    jump : float
        How much nearer a surface has to be to hide another, as a share of the depth.
    """
    height, width = depth.shape
    valid = np.isfinite(depth)
    disparity: FloatArray = scale / np.where(valid, depth, np.inf)
    margin = int(np.ceil(np.max(disparity))) + 1
    column = np.round(np.arange(width) - disparity).astype(np.int64) + margin
    row = np.broadcast_to(np.arange(height)[:, None], depth.shape)
    nearest = np.full((height, width + margin + 1), np.inf)
    np.minimum.at(nearest, (row[valid], column[valid]), depth[valid])
    hidden: BoolArray = valid & (depth > nearest[row, column] * (1.0 + jump))
    return hidden
