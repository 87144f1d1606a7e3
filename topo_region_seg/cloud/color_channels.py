# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Colors as files and drivers store them, made 8-bit sRGB: packed, or channels of 8 or 16 bits or of floats."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

Channels = npt.NDArray[Any]
Colors = npt.NDArray[np.uint8]


def to_8_bit(channels: Channels, relevant: npt.NDArray[np.bool_] | None = None) -> Colors | None:
    """Return red, green and blue as bytes; None where they are no colors.

    The scale is told by the largest value: floats up to 1 are shares, numbers up to 255 are 8-bit values whatever their
    type, and up to 65,535 they are 16-bit values.

    Parameters
    ----------
    channels : (N, 3) array
        Of any type of number.
    relevant : (N,) bool, optional
        Points whose color counts; others may hold anything.

    Returns
    -------
    (N, 3) uint8 or None
        None where a point that counts has a negative value, none at all (NaN), or one above 65,535.
    """
    if channels.dtype == np.uint8:
        return np.ascontiguousarray(channels)
    if channels.dtype == np.int8:  # what some call a byte
        return np.ascontiguousarray(channels).view(np.uint8)
    looked_at = channels if relevant is None else channels[relevant]
    largest = float(looked_at.max(initial=0))
    if not (looked_at.min(initial=0) >= 0 and largest <= 65_535):  # not so either where there is a NaN
        return None
    scale = 1.0 if largest <= 255 else 1 / 257
    if channels.dtype.kind == "f" and largest <= 1.0:
        scale = 255.0
    with np.errstate(invalid="ignore", over="ignore"):
        scaled = np.round(channels.astype(np.float64) * scale)
    return np.clip(np.nan_to_num(scaled), 0, 255).astype(np.uint8)


def unpacked(packed: Channels) -> Colors | None:
    """Return the colors of numbers 0xAARRGGBB, or of the floats of 4 bytes that hold such; None for other types.

    Parameters
    ----------
    packed : (N,) array
        Of 4 bytes, or of 8 with the same values.
    """
    if packed.ndim != 1 or packed.dtype.kind not in "fiu" or packed.dtype.itemsize not in (4, 8):
        return None
    if packed.dtype.itemsize == 8:
        with np.errstate(over="ignore", invalid="ignore"):
            packed = packed.astype(np.float32 if packed.dtype.kind == "f" else np.uint32)
    # Bytes, never floats: those with a full alpha are NaN. Blue, green, red, alpha in memory.
    quads = np.ascontiguousarray(packed).view(np.uint8).reshape(-1, 4)
    return np.ascontiguousarray(quads[:, 2::-1])
