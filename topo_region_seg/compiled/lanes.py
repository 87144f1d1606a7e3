# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Vector code, in LLVM's own operations where numba would not make it of a loop."""

from __future__ import annotations

from typing import Any

from llvmlite import ir
from numba.core import cgutils, types
from numba.extending import intrinsic

WORD = ir.IntType(32)


def splat(builder: Any, value: Any, vector: Any) -> Any:
    """Return a vector of one value."""
    undefined = ir.Constant(vector, ir.Undefined)
    one = builder.insert_element(undefined, value, ir.Constant(WORD, 0))
    return builder.shuffle_vector(one, undefined, ir.Constant(ir.VectorType(WORD, vector.count), [0] * vector.count))


def load(builder: Any, data: Any, place: Any, vector: Any, align: int = 4) -> Any:
    """Load a vector of numbers of `align` bytes from a place in an array."""
    return builder.load(builder.bitcast(builder.gep(data, [place]), vector.as_pointer()), align=align)


def reduce(builder: Any, name: str, *operands: Any, result: Any, flags: tuple[str, ...] = ()) -> Any:
    """Call one of LLVM's reductions of a vector to a number."""
    function = ir.FunctionType(result, [operand.type for operand in operands])
    called = cgutils.get_or_insert_function(builder.module, function, f"llvm.vector.reduce.{name}")
    return builder.call(called, operands, fastmath=flags)


@intrinsic
def trailing_zeros(typing_context, bits):  # type: ignore[no-untyped-def]
    """Return the number of the lowest bit that is set in an int64 that is not 0."""

    def build(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return builder.cttz(arguments[0], ir.Constant(ir.IntType(1), 1))

    return types.int64(types.int64), build
