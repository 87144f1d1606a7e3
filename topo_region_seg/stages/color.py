# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""sRGB to CIELAB (paper, section IV.C, eq. (5))."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from topo_region_seg.data import FloatArray
from topo_region_seg.kernels.lab import rgb_to_lab


def _linear_light() -> FloatArray:
    """IEC 61966-2-1: linear light of each 8-bit sRGB value."""
    encoded = np.arange(256) / 255.0
    linear: FloatArray = np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)
    return linear


LINEAR_LIGHT = _linear_light()


def srgb_to_lab(rgb: npt.NDArray[np.uint8]) -> FloatArray:
    """Convert 8-bit sRGB (N, 3) to CIELAB (N, 3) float64 under D65, 2 degree observer."""
    return rgb_to_lab(np.ascontiguousarray(rgb), LINEAR_LIGHT)
