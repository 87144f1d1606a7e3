# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The innermost steps of a search for nearest points as vector code: distances of a leaf's points, and sorted rows."""

from __future__ import annotations

from typing import Any

from llvmlite import ir
from numba.core import types
from numba.core.types import int64
from numba.extending import intrinsic

from topo_region_seg.compiled.kd_tree import LEAF
from topo_region_seg.compiled.lanes import WORD, load, splat

_LONG = ir.IntType(64)
_DOUBLES = ir.VectorType(ir.DoubleType(), LEAF)
_LONGS = ir.VectorType(_LONG, LEAF)
_WORDS = ir.VectorType(WORD, LEAF)


@intrinsic
def within_leaves(typing_context, blocks, groups, row_a, row_b, within, d2):  # type: ignore[no-untyped-def]
    """Return which points of one leaf have points of another within their reach.

    Parameters
    ----------
    typing_context
        numba's; a kernel does not give it.
    blocks : (L, 3, LEAF) float64
        Positions by leaf.
    groups : (N + LEAF,) int32
        Points whose group is the same do not count.
    row_a, row_b : int64
        First rows of the leaves.
    within : (LEAF,) float64
        Squared reach of each point of the first leaf; below 0: none.
    d2 : (LEAF * LEAF,) float64
        Takes the squared distances, that of points i of the first leaf and j of the second at ``8 j + i``.

    Returns
    -------
    int64
        Bit ``8 j + i`` is set where points i and j are that near. So what is near a point does not come in a row: to
        insert it takes a while.
    """

    def build(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        blocks, groups, row_a, row_b, within, d2 = _with_data(context, builder, signature, arguments)
        own, reach = _positions(builder, blocks, row_a), load(builder, within, _long(0), _DOUBLES, align=8)
        own_groups = load(builder, groups, row_a, _WORDS)
        of_b, hits = _place(builder, row_b), ir.Constant(_LONG, 0)
        for j in range(LEAF):
            other = [_splat_at(builder, blocks, builder.add(of_b, _long(c * LEAF + j)), _DOUBLES) for c in range(3)]
            near = builder.fcmp_ordered("<=", _squares(builder, own, other, d2, j * LEAF), reach)
            group = _splat_at(builder, groups, builder.add(row_b, _long(j)), _WORDS)
            near = builder.and_(near, builder.icmp_signed("!=", group, own_groups))
            hits = builder.or_(hits, builder.shl(_bits(builder, near), _long(LEAF * j)))
        return hits

    return int64(blocks, groups, row_a, row_b, within, d2), build


@intrinsic
def within_leaf(typing_context, blocks, row, x, y, z, within, d2):  # type: ignore[no-untyped-def]
    """Return which points of the leaf at a first row are within a squared distance of a place, as bits of an int64.

    `blocks` (L, 3, LEAF) float64 are the positions by leaf; `d2` (at least LEAF,) takes the squared distances.
    """

    def build(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        blocks, row, *place, within, d2 = _with_data(context, builder, signature, arguments)
        own = [splat(builder, value, _DOUBLES) for value in place]
        found = _squares(builder, own, _positions(builder, blocks, row), d2, 0)
        return _bits(builder, builder.fcmp_ordered("<=", found, splat(builder, within, _DOUBLES)))

    return int64(blocks, row, x, y, z, within, d2), build


@intrinsic
def insert_lanes(typing_context, keys, ids, place, key, own):  # type: ignore[no-untyped-def]
    """Insert a key, and an id, in LEAF cells of a sorted row that begin at a place, behind keys that are the same.

    What does not fit falls out at the end; cells into which the key does not come take what falls out of those before
    them, so that a row is gone through from its end. Return whether one of the keys is the same.
    """

    def build(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        keys, ids, place, key, own = _with_data(context, builder, signature, arguments)
        before = builder.sub(place, _long(1))
        key, own = splat(builder, key, _DOUBLES), splat(builder, own, _LONGS)
        here = load(builder, keys, place, _DOUBLES, align=8)
        there = _moved(builder, keys, before, here)
        cells = load(builder, ids, place, _LONGS, align=8)
        stays, comes = (builder.fcmp_ordered("<=", values, key) for values in (here, there))
        for data, new, old, moved in (
            (keys, key, here, there),
            (ids, own, cells, _moved(builder, ids, before, cells)),
        ):
            inserted = builder.select(stays, old, builder.select(comes, new, moved))
            builder.store(inserted, _vector_at(builder, data, place, old.type), align=8)
        same = _bits(builder, builder.fcmp_ordered("==", here, key))
        return builder.icmp_signed("!=", same, _long(0))

    return types.boolean(keys, ids, place, key, own), build


def _moved(builder: Any, data: Any, before: Any, cells: Any) -> Any:
    """Return cells moved by one, after the one before them. To load them so would wait for what was just stored."""
    first = _splat_at(builder, data, before, cells.type)
    return builder.shuffle_vector(first, cells, ir.Constant(_WORDS, [0, *range(LEAF, 2 * LEAF - 1)]))


def _long(value: int) -> Any:
    return ir.Constant(_LONG, value)


def _with_data(context: Any, builder: Any, signature: Any, arguments: Any) -> list[Any]:
    """Return the arguments, of arrays where their data are."""
    return [
        context.make_array(kind)(context, builder, value=value).data if isinstance(kind, types.Array) else value
        for kind, value in zip(signature.args, arguments, strict=True)
    ]


def _vector_at(builder: Any, data: Any, place: Any, vector: Any) -> Any:
    return builder.bitcast(builder.gep(data, [place]), vector.as_pointer())


def _splat_at(builder: Any, data: Any, place: Any, vector: Any) -> Any:
    return splat(builder, builder.load(builder.gep(data, [place])), vector)


def _place(builder: Any, row: Any) -> Any:
    """Return where the positions of the leaf with a first row begin: three channels of LEAF points each."""
    return builder.mul(row, _long(3))


def _positions(builder: Any, blocks: Any, row: Any) -> list[Any]:
    place = _place(builder, row)
    return [load(builder, blocks, builder.add(place, _long(c * LEAF)), _DOUBLES, align=8) for c in range(3)]


def _squares(builder: Any, own: list[Any], others: list[Any], d2: Any, place: int) -> Any:
    """Return squared distances of a place from a leaf's points, which are kept in `d2`, rounded as in plain code."""
    total = None
    for one, other in zip(own, others, strict=True):
        difference = builder.fsub(other, one)
        square = builder.fmul(difference, difference)
        total = square if total is None else builder.fadd(total, square)
    builder.store(total, _vector_at(builder, d2, _long(place), _DOUBLES), align=8)
    return total


def _bits(builder: Any, condition: Any) -> Any:
    return builder.zext(builder.bitcast(condition, ir.IntType(LEAF)), _LONG)
