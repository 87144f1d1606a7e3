# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The data of a message as bytes, whatever library made it."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from topo_region_seg.cloud.layout import CloudFormatError


def bytes_of(data: Any) -> npt.NDArray[np.uint8]:
    """View any buffer as bytes, without a copy where it is contiguous."""
    if isinstance(data, np.ndarray):
        return np.ascontiguousarray(data).reshape(-1).view(np.uint8)
    try:
        return np.frombuffer(data, np.uint8) if len(data) else np.empty(0, np.uint8)
    except (TypeError, ValueError, BufferError) as error:
        raise CloudFormatError("bad_data", f"data of type {type(data).__name__} is not a buffer: {error}") from None
