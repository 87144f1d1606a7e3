# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The innermost step of the filtration as vector code: all points of one leaf against all of another.

Written in LLVM's own operations on vectors of a leaf's points, as no compiler flag makes it of a loop: numba
computes with integers of 64 bits, four of which fit where eight points do.
"""

from __future__ import annotations

from typing import Any

from llvmlite import ir
from numba.core import cgutils
from numba.core.types import UniTuple, int64  # type: ignore[attr-defined]
from numba.extending import intrinsic

from topo_region_seg.compiled.kd_tree import LEAF
from topo_region_seg.compiled.lanes import WORD, load, reduce, splat
from topo_region_seg.compiled.predicate import CHANNELS

FAR_SINGLE = 0x7F800000  # bits of infinity
_SINGLE = ir.VectorType(ir.FloatType(), LEAF)
_WORDS = ir.VectorType(WORD, LEAF)


@intrinsic
def sift_leaves(typing_context, blocks, roots, row_a, row_b, sieve):  # type: ignore[no-untyped-def]
    """Sift the pairs of points of two leaves.

    Parameters
    ----------
    typing_context
        numba's; a kernel does not give it.
    blocks : (L, 9, LEAF) float32
        Points by leaf and channel.
    roots : (N + LEAF,) int32
        Component of each row; pairs within a component do not pass.
    row_a, row_b : int64
        First rows of the leaves.
    sieve : tuple of 6 float32
        Squared limits: reach, color from and to, chord from and to, and the end of the present scale.

    Returns
    -------
    hits : uint64
        Bit ``8 i + j`` is set where points i and j pass and are not farther apart than the end of the scale.
    beyond : int32
        Bits of the smallest squared distance (float32) of the others that pass; `FAR_SINGLE` = none.
    """
    signature = UniTuple(int64, 2)(blocks, roots, row_a, row_b, sieve)
    return signature, _sift_leaves


def _sift_leaves(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    blocks_type, roots_type, *_ = signature.args
    blocks, roots, row_a, row_b, sieve = arguments
    blocks = context.make_array(blocks_type)(context, builder, value=blocks).data
    roots = context.make_array(roots_type)(context, builder, value=roots).data
    reach, color_from, color_to, chord_from, chord_to, near = (
        splat(builder, value, _SINGLE) for value in cgutils.unpack_tuple(builder, sieve, 6)
    )
    word = row_a.type
    of_a, of_b = (builder.mul(row, ir.Constant(word, CHANNELS)) for row in (row_a, row_b))

    def point(i: int, c: int) -> Any:
        place = builder.add(of_a, ir.Constant(word, c * LEAF + i))
        return splat(builder, builder.load(builder.gep(blocks, [place])), _SINGLE)

    def points(c: int) -> Any:
        return load(builder, blocks, builder.add(of_b, ir.Constant(word, c * LEAF)), _SINGLE)

    def square(first: int, i: int, others: list[Any]) -> Any:
        total = None
        for c in range(first, first + 3):
            difference = builder.fsub(others[c], point(i, c))
            product = builder.fmul(difference, difference, flags=("contract",))
            total = product if total is None else builder.fadd(total, product, flags=("contract",))
        return total

    others = [points(c) for c in range(CHANNELS)]
    other_roots = load(builder, roots, row_b, _WORDS)
    far = splat(builder, ir.Constant(WORD, FAR_SINGLE), _WORDS)
    beyond = far
    hits = ir.Constant(ir.IntType(64), 0)
    for i in range(LEAF):
        root = builder.load(builder.gep(roots, [builder.add(row_a, ir.Constant(word, i))]))
        passes = builder.icmp_signed("!=", other_roots, splat(builder, root, _WORDS))
        d2, color, chord = (square(first, i, others) for first in (0, 3, 6))
        for condition in (
            builder.fcmp_ordered("<=", d2, reach),
            builder.fcmp_ordered("<=", color, color_to),
            builder.fcmp_ordered(">=", color, color_from),
            # Unordered, so that the NaN of a missing normal passes.
            builder.fcmp_unordered("<=", chord, chord_to),
            builder.fcmp_unordered(">=", chord, chord_from),
        ):
            passes = builder.and_(passes, condition)
        here = builder.and_(passes, builder.fcmp_ordered("<=", d2, near))
        there = builder.and_(passes, builder.fcmp_ordered(">", d2, near))
        bits = builder.zext(builder.bitcast(here, ir.IntType(LEAF)), ir.IntType(64))
        hits = builder.or_(hits, builder.shl(bits, ir.Constant(ir.IntType(64), LEAF * i)))
        length = builder.select(there, builder.bitcast(d2, _WORDS), far)
        beyond = builder.select(builder.icmp_signed("<", length, beyond), length, beyond)
    least = reduce(builder, f"smin.v{LEAF}i32", beyond, result=WORD)
    return context.make_tuple(builder, signature.return_type, [hits, builder.sext(least, ir.IntType(64))])
