# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The homogeneity criterion: which points may be joined (paper, section IV.C)."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from topo_region_seg.compiled.dialect import kernel
from topo_region_seg.compiled.predicate import CHANNELS, Criterion
from topo_region_seg.data import FloatArray
from topo_region_seg.growth import Growth


def homogeneity_channels(
    xyz: npt.ArrayLike, lab: npt.ArrayLike | None, normals: npt.ArrayLike | None, growth: Growth
) -> FloatArray:
    """Return position, color and unit normal in one array (N, 9); what the criterion does not use is zero."""
    xyz = _checked("xyz", xyz, None)
    channels = np.zeros((len(xyz), CHANNELS))
    channels[:, 0:3] = xyz
    if growth.uses_color:
        channels[:, 3:6] = _checked("lab", lab, len(xyz))
    if growth.uses_normals:
        put_unit(_checked("normals", normals, len(xyz), finite=False), channels)
    return channels


def criterion(growth: Growth, radius: float) -> Criterion:
    """Return limits of squared differences for edges up to `radius` (m); angles become chords of the unit sphere.

    What is not compared is zero in all points, and has no lower limit.
    """
    color_low, color_high = growth.color if growth.uses_color else (0.0, growth.color[1])
    angle_low, angle_high = growth.angle if growth.uses_normals else (0.0, growth.angle[1])
    return Criterion(
        reach=_square_within(radius),
        color_low=_square_from(color_low),
        color_high=_square_within(color_high),
        chord_low=_square_chord(angle_low),
        chord_high=_square_chord(angle_high) if angle_high < 180.0 else math.inf,
    )


def _checked(name: str, values: npt.ArrayLike | None, n: int | None, *, finite: bool = True) -> FloatArray:
    if values is None:
        raise ValueError(f"{name} is missing, and the criterion needs it")
    array = np.ascontiguousarray(values, dtype=np.float64)
    if array.ndim != 2 or array.shape[1] != 3 or (n is not None and len(array) != n):
        wanted = "(N, 3)" if n is None else f"({n}, 3)"
        raise ValueError(f"{name} has shape {array.shape}, must be {wanted}")
    if finite and not np.isfinite(array).all():
        raise ValueError(f"{name} holds values that are not finite; drop those points first")
    return array


def _square_within(limit: float) -> float:
    """Largest square whose root, as computed, is at most `limit`."""
    square = limit * limit
    while math.sqrt(square) > limit:
        square = math.nextafter(square, 0.0)
    while math.sqrt(math.nextafter(square, math.inf)) <= limit:
        square = math.nextafter(square, math.inf)
    return square


def _square_from(limit: float) -> float:
    """Smallest square whose root, as computed, is at least `limit`."""
    square = limit * limit
    while math.sqrt(square) < limit:
        square = math.nextafter(square, math.inf)
    while square > 0.0 and math.sqrt(math.nextafter(square, 0.0)) >= limit:
        square = math.nextafter(square, 0.0)
    return square


def _square_chord(degrees: float) -> float:
    return 2.0 - 2.0 * math.cos(math.radians(degrees))


@kernel
def put_unit(vectors: FloatArray, channels: FloatArray) -> None:
    """Write `vectors` (N, 3) in unit length into the last of `channels` (N, 9); NaN where there is no direction."""
    for i in range(len(vectors)):
        x, y, z = vectors[i, 0], vectors[i, 1], vectors[i, 2]
        length = math.sqrt(x * x + y * y + z * z)
        if not (length > 0.0 and length < np.inf):
            length = np.nan
        channels[i, 6], channels[i, 7], channels[i, 8] = x / length, y / length, z / length
