# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The parts of two results that are not the same, bit for bit."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[Any]


def differences(base: Mapping[str, Array], present: Mapping[str, Array]) -> list[str]:
    """Return one short text for each array that differs: its name, and what or how many elements.

    Elements are compared as bytes: NaN equals NaN, 0.0 and -0.0 differ.
    """
    found = [f"{name} is missing" for name in base if name not in present]
    found += [f"{name} is new" for name in present if name not in base]
    for name in base:
        if name in present and (text := _difference(base[name], present[name])):
            found.append(f"{name} {text}")
    return found


def _difference(base: Array, present: Array) -> str:
    if base.dtype != present.dtype:
        return f"is {present.dtype}, was {base.dtype}"
    if base.shape != present.shape:
        return f"has shape {present.shape}, had {base.shape}"
    changed = int(np.count_nonzero(np.any(_as_bytes(base) != _as_bytes(present), axis=1)))
    return f"{changed} of {base.size}" if changed else ""


def _as_bytes(array: Array) -> npt.NDArray[np.uint8]:
    return np.frombuffer(array.tobytes(), np.uint8).reshape(array.size, array.dtype.itemsize)
