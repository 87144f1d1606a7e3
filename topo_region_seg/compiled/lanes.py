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


def load(builder: Any, data: Any, place: Any, vector: Any) -> Any:
    """Load a vector of 32-bit numbers from a place in an array."""
    return builder.load(builder.bitcast(builder.gep(data, [place]), vector.as_pointer()), align=4)


def reduce(builder: Any, name: str, *operands: Any, result: Any, flags: tuple[str, ...] = ()) -> Any:
    """Call one of LLVM's reductions of a vector to a number."""
    function = ir.FunctionType(result, [operand.type for operand in operands])
    called = cgutils.get_or_insert_function(builder.module, function, f"llvm.vector.reduce.{name}")
    return builder.call(called, operands, fastmath=flags)


@intrinsic
def gap_of_four(typing_context, boxes, a, others, b, three):  # type: ignore[no-untyped-def]
    """Return the squared distance of two boxes in four cells; boxes are (T, K, 2, 4) float32, lower bounds first."""
    return types.float32(boxes, a, others, b, three), _gap_of_four


def _gap_of_four(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    four = ir.VectorType(ir.FloatType(), 4)
    three = context.cast(builder, arguments[4], signature.args[4], types.int64)

    def bounds(place: int) -> tuple[Any, Any]:
        boxes = context.make_array(signature.args[place])(context, builder, value=arguments[place])
        box = context.cast(builder, arguments[place + 1], signature.args[place + 1], types.int64)
        cell = builder.add(builder.mul(three, cgutils.unpack_tuple(builder, boxes.shape)[1]), box)
        cell = builder.mul(cell, ir.Constant(cell.type, 8))
        return load(builder, boxes.data, cell, four), load(
            builder, boxes.data, builder.add(cell, ir.Constant(cell.type, 4)), four
        )

    (low_p, high_p), (low_q, high_q) = bounds(0), bounds(2)
    apart = ir.Constant(four, [0.0] * 4)
    for gap in (builder.fsub(low_q, high_p), builder.fsub(low_p, high_q)):
        apart = builder.select(builder.fcmp_ordered(">", gap, apart), gap, apart)
    square = builder.fmul(apart, apart)
    zero = ir.Constant(ir.FloatType(), 0.0)
    return reduce(builder, "fadd.v4f32", zero, square, result=ir.FloatType(), flags=("reassoc",))


@intrinsic
def trailing_zeros(typing_context, bits):  # type: ignore[no-untyped-def]
    """Return the number of the lowest bit that is set in an int64 that is not 0."""

    def build(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return builder.cttz(arguments[0], ir.Constant(ir.IntType(1), 1))

    return types.int64(types.int64), build
