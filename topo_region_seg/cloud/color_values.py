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
        return np.ascontiguousarray(values)
    is_float = values.dtype.kind == "f"
    numbers = np.nan_to_num(values.astype(np.float64), nan=0.0, posinf=0.0, neginf=0.0)
    largest = float(numbers.max(initial=0.0))
    if is_float and largest <= LARGEST_SHARE:
        numbers = np.rint(255.0 * numbers)
    elif largest > 255.0:
        # The upper byte: right for 8 bits that were shifted to 16 as well as for those that were repeated.
        numbers = np.floor(numbers / 256.0)
    else:
        numbers = np.rint(numbers)
    return np.clip(numbers, 0.0, 255.0).astype(np.uint8)
