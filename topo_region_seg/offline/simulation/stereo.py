# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""An active stereo camera, such as a RealSense D435: two infrared cameras and a projected pattern.

Windows of the two images are matched. So disparities are averages over a window: noise is alike over several pixels,
creases are rounded, and across the outline of an object depth is smeared from one surface to the other. Where a window
sees two surfaces the match often fails, which leaves rims without depth around objects, and what only one of the
cameras sees has none (Keselman et al., "Intel RealSense Stereoscopic Depth Cameras", 2017).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy import ndimage

from topo_region_seg.data import FloatArray
from topo_region_seg.offline.simulation.noise import hidden_from_the_right
from topo_region_seg.offline.simulation.sensor import averaged, colors_with_noise, smooth_field


@dataclass(frozen=True)
class ActiveStereo:
    """Parameters of the camera; the defaults are like a RealSense D435's.

    Parameters
    ----------
    baseline : float
        Distance of the cameras, metres.
    window : float
        Standard deviation of the window that is matched, pixels.
    disparity_sigma : float
        Standard deviation of the disparity, pixels.
    disparity_step : float
        Rounding of the disparity, pixels.
    rim_jump : float
        Range of the disparity within a window from which a match may fail, pixels.
    rim_loss, blob_loss : float
        Share of the pixels lost where a window sees two surfaces, and everywhere, in blobs.
    grazing : float
        Cosine of the angle of incidence below which nothing is matched.
    color_sigma : float
        Standard deviation of the color channels, 8-bit levels.
    """

    baseline: float = 0.05
    window: float = 1.6
    disparity_sigma: float = 0.06
    disparity_step: float = 1 / 32
    rim_jump: float = 1.0
    rim_loss: float = 0.6
    blob_loss: float = 0.01
    grazing: float = 0.12
    color_sigma: float = 2.0

    def observed(self, depth: FloatArray, cosine: FloatArray, focal: float, rng: np.random.Generator) -> FloatArray:
        """Return the depth (H, W) that the camera delivers, NaN where it has none."""
        scale = focal * self.baseline
        seen = np.isfinite(depth)
        disparity = np.where(seen, scale / np.where(seen, depth, 1.0), 0.0)
        matched = averaged(disparity, seen.astype(np.float64), self.window)
        matched += self.disparity_sigma * smooth_field(depth.shape, self.window, rng)
        matched = np.round(matched / self.disparity_step) * self.disparity_step
        reach = 2 * round(self.window) + 1
        spread = ndimage.maximum_filter(disparity, reach) - ndimage.minimum_filter(disparity, reach)
        rims = spread > self.rim_jump
        lost = ~seen | (cosine < self.grazing) | hidden_from_the_right(depth, scale, 0.02)
        for where, share in ((rims, self.rim_loss), (seen, self.blob_loss)):
            field = smooth_field(depth.shape, 1.5, rng)
            lost |= where & (field < np.quantile(field, share))
        with np.errstate(divide="ignore"):
            return np.where(lost | (matched <= 0), np.nan, scale / matched)

    def colored(self, rgb: FloatArray, rng: np.random.Generator) -> npt.NDArray[np.uint8]:
        """Return `rgb` (N, 3) with noise, as 8-bit levels."""
        return colors_with_noise(rgb, self.color_sigma, rng)
