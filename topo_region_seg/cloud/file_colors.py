# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The colors of PCD and PLY files: packed in one number, or red, green and blue of any number type."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from topo_region_seg.cloud.color_values import as_bytes
from topo_region_seg.cloud.layout import Warn

PACKED = ("rgb", "rgba")
CHANNELS = (("red", "green", "blue"), ("diffuse_red", "diffuse_green", "diffuse_blue"), ("r", "g", "b"))
"""Names that writers give to the colors where they are not packed."""
LARGEST = 65_535
Colors = npt.NDArray[np.uint8]


def read_colors(
    columns: Mapping[str, npt.NDArray[Any]], valid: npt.NDArray[np.bool_], is_text: bool, warn: Warn
) -> Colors | None:
    """Return the colors of a file; None where there are none, or where they cannot be known, which `warn` says.

    Parameters
    ----------
    columns : mapping of str to (N,) or (N, count) array
        The fields of the points.
    valid : (N,) bool
        Points that have a position; the others may have any color.
    is_text : bool
        Whether the numbers were written as text, which loses packed colors that are no number as floats.
    warn : callable
        Called with (code, text).

    Returns
    -------
    (N, 3) uint8 or None
        8-bit sRGB.
    """
    for name in (name for name in PACKED if name in columns):
        packed = columns[name]
        if is_text and packed.dtype.kind == "f" and (lost := int(np.isnan(packed[valid]).sum())):
            warn(
                "unreadable_color",
                f"{lost} packed colors are 'nan' in the text, which has lost them, so no color is used; "
                f"write the file in binary, or '{name}' as TYPE U",
            )
            return None
        rgb = _unpacked(packed)
        if rgb is None:
            warn("unreadable_color", f"'{name}' is of type {packed.dtype}, not of 4 bytes; it is not used")
        else:
            return rgb
    for names in CHANNELS:
        if all(name in columns and columns[name].ndim == 1 for name in names):
            return _from_channels(names, np.column_stack([columns[name] for name in names]), valid, warn)
    return None


def _from_channels(
    names: tuple[str, ...], channels: npt.NDArray[Any], valid: npt.NDArray[np.bool_], warn: Warn
) -> Colors | None:
    if channels.dtype == np.int8:  # what some call a byte
        channels = channels.view(np.uint8)
    odd = ~((channels >= 0) & (channels <= LARGEST))  # NaN among them
    if wrong := int((odd.any(axis=1) & valid).sum()):
        where = f"in {wrong} point{'' if wrong == 1 else 's'}"
        warn(
            "unreadable_color",
            f"{', '.join(names)} are below 0, above {LARGEST} or no numbers {where}; no color is used",
        )
        return None
    return as_bytes(np.where(odd, np.zeros((), channels.dtype), channels))


def _unpacked(packed: npt.NDArray[Any]) -> Colors | None:
    """Return the colors of numbers 0xAARRGGBB, of floats with the same bits, or of 3 or 4 bytes; else None."""
    if packed.ndim == 2:
        return np.ascontiguousarray(packed[:, :3]) if packed.dtype == np.uint8 and packed.shape[1] >= 3 else None
    if packed.dtype.itemsize == 8:
        with np.errstate(over="ignore", invalid="ignore"):
            packed = packed.astype(np.float32 if packed.dtype.kind == "f" else np.uint32)
    if packed.dtype.itemsize != 4:
        return None
    # Bytes, never floats: those with a full alpha are NaN. Blue, green, red, alpha in memory.
    quads = np.ascontiguousarray(packed).view(np.uint8).reshape(-1, 4)
    return np.ascontiguousarray(quads[:, 2::-1])
