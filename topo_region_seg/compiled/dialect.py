# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""How every kernel is compiled: without the GIL, cached on disk, and with IEEE arithmetic (NaN carries meaning).

Kernels share some tricks. ``python -m benchmarks.tricks NAME`` leaves one out and prints how many times as long each
stage then takes. Here are the stages that gain most, on an AMD EPYC of family 26 with the first recorded frame:

================  ======================================  ==============================================
trick             where it is                             times as long without it
================  ======================================  ==============================================
index             `index`, below                          records 4.5; tree and filtration 1.2
borrowed          `borrowed`, below                       filtration 2.6 to 4.0; supervoxels 1.5
inlined           `inlined`, below                        filtration 1.6 to 2.1; grooves 1.2
summing           `summing`, below                        grooves 5.3; normals 4.4; support plane 1.6
single precision  `steps/filtration/leaf_pairs.py`        filtration 2.0 to 4.4
vector sieve      `steps/filtration/leaf_sieve.py`        filtration 2.2 to 4.9
trailing zeros    `compiled/lanes.py`                     filtration 1.05 to 1.1
cube root         `steps/color.py`                        color 1.8
filled buckets    `beyond/supervoxels/point_queue.py`     supervoxels 1.1, of points of random colors 1.8
================  ======================================  ==============================================
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

import numba
import numpy as np
from llvmlite import ir
from numba.core.types import Array, BaseTuple  # type: ignore[attr-defined]
from numba.extending import intrinsic

from topo_region_seg.compiled.cache import kept_on_disk, save_one_at_a_time

F = TypeVar("F", bound=Callable[..., Any])
index = np.uint64
"""Makes an index unsigned: one that might be negative, and so count from the end, costs a test each time, and is not
loaded as a vector. To be taken last, as unsigned and signed integers together become floating-point numbers."""
MEMINFO, PARENT = 0, 1  # what holds the count, in numba's model of an array


def kernel(function: F) -> F:
    """Compile `function` at its first call, for the types it is called with."""
    return _compiled(function)


def summing(function: F) -> F:
    """Compile like a kernel, but let sums be taken in any order, so that they become vector code."""
    return _compiled(function, fastmath={"reassoc", "contract", "nsz"})


def _compiled(function: F, **options: Any) -> F:
    with kept_on_disk() as kept:
        compiled: F = numba.njit(nogil=True, cache=kept, error_model="numpy", **options)(function)
    if kept:
        save_one_at_a_time(compiled)
    return compiled


def inlined(function: F) -> F:
    """Compile `function` into each kernel that calls it: a call of its own would count references to every array."""
    compiled: F = numba.njit(nogil=True, inline="always", error_model="numpy")(function)
    return compiled


@intrinsic
def borrowed(typing_context, value):  # type: ignore[no-untyped-def]
    """Return an array, or a tuple of arrays and numbers, whose references are not counted.

    To be used for arguments of the kernel alone, and never to be returned.
    """

    def build(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return _uncounted(builder, signature.args[0], arguments[0])

    return value(value), build


def _uncounted(builder: Any, kind: Any, value: Any) -> Any:
    if isinstance(kind, Array):
        for field in (MEMINFO, PARENT):
            nothing = ir.Constant(value.type.elements[field], None)
            value = builder.insert_value(value, nothing, field)
    elif isinstance(kind, BaseTuple):
        for place, item in enumerate(kind):
            value = builder.insert_value(value, _uncounted(builder, item, builder.extract_value(value, place)), place)
    return value
