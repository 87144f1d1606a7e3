# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Colors for labels: far apart in CIELAB, also as red-green blind people see them."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import numpy.typing as npt

from topo_region_seg.data import FloatArray

UNLABELED = (48, 48, 48)
SIZE = 64
_GRID = 13  # sRGB levels a channel among which the colors are chosen
_LIGHTNESS = (42.0, 92.0)  # readable on the dark gray of unlabeled points and on white paper
_CHROMA = 30.0  # no grays: they mean "unlabeled"
_BLIND_WEIGHT = 1.8
# Machado, Oliveira and Fernandes (2009), severity 1.0, on linear RGB.
_PROTANOPIA = np.array(
    [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216], [-0.003882, -0.048116, 1.051998]]
)
_DEUTERANOPIA = np.array(
    [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.011820, 0.042940, 0.968881]]
)
_TO_XYZ = np.array(
    [[0.4124564, 0.3575761, 0.1804375], [0.2126729, 0.7151522, 0.0721750], [0.0193339, 0.1191920, 0.9503041]]
)


def colors(labels: npt.ArrayLike) -> npt.NDArray[np.uint8]:
    """Return a color for every label; equal labels get equal colors.

    Parameters
    ----------
    labels : (N,) integers
        Labels of points; 0 means no region and is dark gray. The colors repeat after ``SIZE`` labels.

    Returns
    -------
    (N, 3) uint8
        8-bit sRGB.
    """
    wanted = np.asarray(labels).astype(np.uint32, copy=False)
    index = (wanted - np.uint32(1)) & np.uint32(SIZE - 1)
    index += np.uint32(1)
    index *= wanted != 0
    # Rows of 3 bytes taken as one item each: several times as quick as indexing an (n, 3) table.
    table = palette().view("V3").ravel()
    rows: npt.NDArray[np.uint8] = table.take(index, mode="clip").view(np.uint8)
    return rows.reshape(*wanted.shape, 3)


@lru_cache(maxsize=1)
def palette() -> npt.NDArray[np.uint8]:
    """Return the table of colors, (SIZE + 1, 3) uint8: row 0 for unlabeled points, then the cycle.

    Each color is the one farthest from all before it (greedy farthest-point choice over the saturated part of the sRGB
    cube), where the distance of two colors is the smaller of their CIE76 difference and ``_BLIND_WEIGHT`` times that
    under protan and deutan vision, in which there is less room.
    """
    level = np.linspace(0.0, 255.0, _GRID).round()
    cube = np.stack(np.meshgrid(level, level, level, indexing="ij"), axis=-1).reshape(-1, 3)
    lab = _seen(cube, np.eye(3))
    cube = cube[
        (lab[:, 0] >= _LIGHTNESS[0]) & (lab[:, 0] <= _LIGHTNESS[1]) & (np.hypot(lab[:, 1], lab[:, 2]) > _CHROMA)
    ]
    chosen = [np.array(UNLABELED, dtype=np.float64), np.array([0.0, 105.0, 255.0])]  # a blue that all tell apart
    visions = (np.eye(3), _PROTANOPIA, _DEUTERANOPIA)
    seen = [_seen(cube, vision) for vision in visions]

    def difference(color: FloatArray) -> FloatArray:
        per_vision = [
            np.linalg.norm(lab - _seen(color[None], vision), axis=1) for lab, vision in zip(seen, visions, strict=True)
        ]
        return np.minimum(per_vision[0], _BLIND_WEIGHT * np.minimum(per_vision[1], per_vision[2]))

    white = np.array([255.0, 255.0, 255.0])
    nearest = np.min([difference(color) for color in (white, *chosen)], axis=0)
    while len(chosen) <= SIZE:
        chosen.append(cube[np.argmax(nearest)])
        nearest = np.minimum(nearest, difference(chosen[-1]))
    table = np.ascontiguousarray(chosen, dtype=np.uint8)
    table.flags.writeable = False
    return table


def _seen(srgb: FloatArray, vision: FloatArray) -> FloatArray:
    """Return CIELAB (D65) of (N, 3) sRGB in 0..255 as seen through a linear-RGB `vision` matrix."""
    value = srgb / 255.0
    linear = np.where(value <= 0.04045, value / 12.92, ((value + 0.055) / 1.055) ** 2.4)
    xyz = np.clip(linear @ vision.T, 0.0, 1.0) @ _TO_XYZ.T / np.array([0.95047, 1.0, 1.08883])
    f = np.where(xyz > 216 / 24389, np.cbrt(xyz), (24389 / 27 * xyz + 16) / 116)
    return np.stack([116 * f[:, 1] - 16, 500 * (f[:, 0] - f[:, 1]), 200 * (f[:, 1] - f[:, 2])], axis=1)
