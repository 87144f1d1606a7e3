# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Arrays without a count of their references, for the time of a kernel.

Numba counts each time that an array gets another name, as it does in every function that is compiled into a loop.
The count is atomic: where two threads work on the same arrays, they wait for each other at every step. The caller
of a kernel keeps its arrays alive, so that in the kernel nothing need be counted.
"""

from __future__ import annotations

from typing import Any

from llvmlite import ir
from numba.core.types import Array, BaseTuple  # type: ignore[attr-defined]
from numba.extending import intrinsic

MEMINFO, PARENT = 0, 1  # what holds the count, in numba's model of an array


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
