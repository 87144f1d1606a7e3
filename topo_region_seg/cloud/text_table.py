# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Tables in text, as PCD and PLY files hold them: a line a point, numbers apart by any white space."""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Iterator
from typing import Any, BinaryIO

import numpy as np
import numpy.typing as npt

_WINDOWS_NAN = re.compile(rb"[+-]?\d\.#(?:QNAN|SNAN|IND|INF)\d*|[+-]?nan\(\w*\)", re.IGNORECASE)


class CutShortError(ValueError):
    """There are fewer points than the header says."""

    def __init__(self) -> None:
        super().__init__("it is cut short")


def claim(file: BinaryIO, rows: int, row_bytes: int, check_points: Callable[[int], None]) -> None:
    """Check that `rows` of at least `row_bytes` each can follow, and that they are not too many, before they are read.

    Raises
    ------
    CutShortError
        The file ends before. Whatever `check_points` raises comes after that.
    """
    if rows * row_bytes > bytes_left(file):
        raise CutShortError
    check_points(rows)


def bytes_left(file: BinaryIO) -> int:
    """Return how many bytes follow the place at which an open file is read."""
    return os.fstat(file.fileno()).st_size - file.tell()


def read_text(file: BinaryIO, record: np.dtype[Any], rows: int, skip: int = 0) -> npt.NDArray[Any]:
    """Read `rows` lines as a structured array, after `skip` others.

    Raises
    ------
    ValueError
        The lines are fewer, or are not such numbers.
    """
    if rows == 0:
        return np.empty(0, record)
    table: npt.NDArray[Any] = np.loadtxt(
        _lines(file), record, comments=None, skiprows=skip, max_rows=rows, ndmin=1, encoding="ascii"
    )
    if len(table) != rows:
        raise CutShortError
    return table


def _lines(file: BinaryIO) -> Iterator[str]:
    """Yield lines; what the C library of Windows prints for NaN becomes one."""
    for line in file:
        if b"#" in line or b"(" in line:
            line = _WINDOWS_NAN.sub(b"nan", line)
        yield line.decode("ascii", "replace")
