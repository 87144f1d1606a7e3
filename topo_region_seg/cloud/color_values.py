# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Colors of any number type as bytes: drivers and files have them from 0 to 1, to 255 and to 65,535."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

LARGEST_SHARE = 1.004
"""Floats up to this are shares of full brightness: a little more than 1, for what was computed."""


def as_bytes(values: npt.NDArray[Any]) -> npt.NDArray[np.uint8]:
    """Return red, green and blue as bytes.

    Bytes are returned as they are. Whole numbers are taken for bytes while none is greater than 255, else for 16 bits;
    floats for shares of 1 while none is greater, else as whole numbers are.

    Parameters
    ----------
    values : (N, 3) ndarray
        Of integers or floats, in either byte order. What is not a number becomes 0.

    Returns
    -------
    (N, 3) uint8 ndarray
    """
    if values.dtype == np.uint8:
        return np.ascontiguousarray(values, np.uint8)
    is_float = values.dtype.kind == "f"
    numbers = values.astype(np.float64)
    numbers[~np.isfinite(numbers)] = 0.0
    largest = float(np.max(numbers, initial=0.0))
    if is_float and largest <= LARGEST_SHARE:
        numbers *= 255.0
    elif largest > 255.0:
        # The upper byte: right for 8 bits that were shifted to 16 as well as for those that were repeated.
        numbers //= 256.0
    np.rint(numbers, out=numbers)
    return np.clip(numbers, 0.0, 255.0, out=numbers).astype(np.uint8)
