# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""sRGB to CIELAB (paper, section IV.C, eq. (5))."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from topo_region_seg.compiled.dialect import inlined, kernel
from topo_region_seg.data import FloatArray

WHITE_X, WHITE_Z = 0.95047, 1.08883  # D65, 2 degree observer, Y = 1
EPSILON = (6.0 / 29.0) ** 3


def _linear_light() -> FloatArray:
    """IEC 61966-2-1: linear light of each 8-bit sRGB value."""
    encoded = np.arange(256) / 255.0
    linear: FloatArray = np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)
    return linear


LINEAR_LIGHT = _linear_light()


def srgb_to_lab(rgb: npt.NDArray[np.uint8]) -> FloatArray:
    """Convert 8-bit sRGB (N, 3) to CIELAB (N, 3) float64 under D65, 2 degree observer."""
    return rgb_to_lab(np.ascontiguousarray(rgb), LINEAR_LIGHT)


@kernel
def rgb_to_lab(rgb: npt.NDArray[np.uint8], linear_light: FloatArray) -> FloatArray:
    """Convert rows of 8-bit sRGB, given the linear light (256,) of each value."""
    lab = np.empty((len(rgb), 3))
    for i in range(len(rgb)):
        r, g, b = linear_light[rgb[i, 0]], linear_light[rgb[i, 1]], linear_light[rgb[i, 2]]
        x = lightness((0.4124564 * r + 0.3575761 * g + 0.1804375 * b) / WHITE_X)
        y = lightness(0.2126729 * r + 0.7151522 * g + 0.0721750 * b)
        z = lightness((0.0193339 * r + 0.1191920 * g + 0.9503041 * b) / WHITE_Z)
        lab[i, 0] = 116.0 * y - 16.0
        lab[i, 1] = 500.0 * (x - y)
        lab[i, 2] = 200.0 * (y - z)
    return lab


@inlined
def lightness(t):  # type: ignore[no-untyped-def]
    """CIE f(t) for t up to 1: cube root, linear near black.

    The root is a parabola, within 14 % of it, and three of Halley's steps, each of which cubes the error: unlike the C
    library's, a loop of it becomes vector code.
    """
    root = 0.21721539 + t * (2.08819396 - t * 1.43361548)
    for _ in range(3):
        cube = root * root * root
        root -= root * (cube - t) / (2.0 * cube + t)
    return root if t > EPSILON else t * (841.0 / 108.0) + 4.0 / 29.0
