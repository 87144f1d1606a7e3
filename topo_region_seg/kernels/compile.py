# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""How every kernel is compiled: without the GIL, cached on disk, and with IEEE arithmetic (NaN carries meaning)."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import numba
import numpy as np

F = TypeVar("F", bound=Callable[..., Any])

index = np.uint64
"""Makes an index unsigned: one that might be negative, and so count from the end, costs a test each time, and is not
loaded as a vector. To be taken last, as unsigned and signed integers together become floating-point numbers."""


def _digest_of_kernels() -> str:
    digest = hashlib.sha256()
    for source in sorted(Path(__file__).parent.glob("*.py")):
        digest.update(source.read_bytes())
    return digest.hexdigest()[:16]


_DIGEST = _digest_of_kernels()


def kernel(function: F) -> F:
    """Compile `function` at its first call, for the types it is called with."""
    return _compiled(function)


def summing(function: F) -> F:
    """Compile like a kernel, but let sums be taken in any order, so that they become vector code."""
    return _compiled(function, fastmath={"reassoc", "contract", "nsz"})


def _compiled(function: F, **options: Any) -> F:
    # Kernels are compiled into each other, but numba asks only for the file of the outer one whether its cached
    # code is fresh. The name of the cache file thus holds the sources of all of them.
    function.__qualname__ = f"{function.__qualname__}-{_DIGEST}"
    compiled: F = numba.njit(nogil=True, cache=True, error_model="numpy", **options)(function)
    return compiled


def inlined(function: F) -> F:
    """Compile `function` into each kernel that calls it: a call of its own would count references to every array."""
    compiled: F = numba.njit(nogil=True, inline="always", error_model="numpy")(function)
    return compiled
