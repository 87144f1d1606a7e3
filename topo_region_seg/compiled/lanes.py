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
def gap_of_four(typing_context, boxes, p, q, width):  # type: ignore[no-untyped-def]
    """Return the squared distance of two boxes in four channels.

    `boxes` (M,) float32 holds bounds: the lower ones of the two begin at places `p` and `q`, the upper ones
    `width` further on.
    """
    return types.float32(boxes, p, q, width), _gap_of_four


def _gap_of_four(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    boxes, p, q, width = arguments
    boxes = context.make_array(signature.args[0])(context, builder, value=boxes).data
    p, q, width = (
        context.cast(builder, value, kind, types.int64)
        for value, kind in zip((p, q, width), signature.args[1:], strict=True)
    )
    four = ir.VectorType(ir.FloatType(), 4)
    low_p, low_q = (load(builder, boxes, place, four) for place in (p, q))
    high_p, high_q = (load(builder, boxes, builder.add(place, width), four) for place in (p, q))
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


@intrinsic
def float32_at(typing_context, data, place):  # type: ignore[no-untyped-def]
    """Return the float32 whose four bytes, in the machine's order, begin at a place in `data` (M,) uint8."""

    def build(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        array = context.make_array(signature.args[0])(context, builder, value=arguments[0]).data
        first = builder.gep(array, [context.cast(builder, arguments[1], signature.args[1], types.int64)])
        return builder.load(builder.bitcast(first, ir.FloatType().as_pointer()), align=1)

    return types.float32(data, place), build
