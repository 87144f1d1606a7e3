# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The innermost steps of a search for nearest points as vector code: distances of a leaf's points, and sorted rows."""

from __future__ import annotations

from typing import Any

from llvmlite import ir
from numba.core import cgutils, types
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
def insert_leaf(typing_context, blocks, groups, order, row_a, row_b, within, rows, ids):  # type: ignore[no-untyped-def]
    """Insert the points of one leaf among those nearest to the points of another, for all of these at a time.

    Parameters
    ----------
    typing_context
        numba's; a kernel does not give it.
    blocks, groups, row_a, row_b
        As `within_leaves` takes them.
    order : (N,) int32
        Id of the point in each row of the tree.
    within : (LEAF,) float64
        Squared reach of each point of the first leaf; below 0: none. It shrinks to the distance of the last one found.
    rows, ids : (k * LEAF,) float64, int64
        Of each of k places the squared distances, the smallest first, and the ids of the points in that place.

    Returns
    -------
    int64
        Bit i is set where something was as far from point i as what was found before: its order is not looked at.
    """

    def build(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        blocks, groups, order, row_a, row_b, within, rows, ids = _with_data(context, builder, signature, arguments)
        array = context.make_array(signature.args[6])(context, builder, value=arguments[6])
        last = builder.sub(cgutils.unpack_tuple(builder, array.shape)[0], _long(LEAF))
        own, own_groups = _positions(builder, blocks, row_a), load(builder, groups, row_a, _WORDS)
        of_b = _place(builder, row_b)
        endless = splat(builder, ir.Constant(ir.DoubleType(), float("inf")), _DOUBLES)
        ties = cgutils.alloca_once_value(builder, ir.Constant(ir.IntType(LEAF), 0))
        with cgutils.for_range(builder, _long(LEAF)) as points:
            place = builder.add(of_b, points.index)
            other = [_splat_at(builder, blocks, builder.add(place, _long(c * LEAF)), _DOUBLES) for c in range(3)]
            d2, reach = _sum_of_squares(builder, own, other), load(builder, within, _long(0), _DOUBLES, align=8)
            row = builder.add(row_b, points.index)
            near = builder.icmp_signed("!=", _splat_at(builder, groups, row, _WORDS), own_groups)
            # What fills up the last leaf is infinitely far.
            for limit, relation in ((reach, "<="), (endless, "<")):
                near = builder.and_(near, builder.fcmp_ordered(relation, d2, limit))
            some = builder.icmp_signed("!=", builder.bitcast(near, ir.IntType(LEAF)), ir.Constant(ir.IntType(LEAF), 0))
            with builder.if_then(some):
                # A comparison with what is no number is false, so that it comes nowhere.
                d2 = builder.select(near, d2, splat(builder, ir.Constant(ir.DoubleType(), float("nan")), _DOUBLES))
                point = builder.sext(builder.load(builder.gep(order, [row])), _LONG)
                _insert(builder, rows, ids, last, d2, splat(builder, point, _LONGS), ties)
                builder.store(
                    _smaller(builder, reach, load(builder, rows, last, _DOUBLES, align=8)),
                    _vector_at(builder, within, _long(0), _DOUBLES),
                    align=8,
                )
        return builder.zext(builder.load(ties), _LONG)

    return int64(blocks, groups, order, row_a, row_b, within, rows, ids), build


def _insert(builder: Any, rows: Any, ids: Any, last: Any, d2: Any, points: Any, ties: Any) -> None:
    """Insert `d2` and its points into rows, from the last on, so that none has to wait for another; note equal ones."""
    kinds = (rows, _DOUBLES, d2), (ids, _LONGS, points)
    here = [cgutils.alloca_once_value(builder, load(builder, data, last, kind, align=8)) for data, kind, _ in kinds]
    stays = cgutils.alloca_once_value(builder, _stays(builder, builder.load(here[0]), d2, ties))
    with cgutils.for_range_slice(builder, last, _long(0), _long(-LEAF), inc=False) as (place, _):
        before = builder.sub(place, _long(LEAF))
        there = [load(builder, data, before, kind, align=8) for data, kind, _ in kinds]
        earlier = _stays(builder, there[0], d2, ties)
        for (data, kind, new), old, moved in zip(kinds, here, there, strict=True):
            inserted = builder.select(builder.load(stays), builder.load(old), builder.select(earlier, new, moved))
            builder.store(inserted, _vector_at(builder, data, place, kind), align=8)
            builder.store(moved, old)
        builder.store(earlier, stays)
    for (data, kind, new), old in zip(kinds, here, strict=True):
        inserted = builder.select(builder.load(stays), builder.load(old), new)
        builder.store(inserted, _vector_at(builder, data, _long(0), kind), align=8)


def _stays(builder: Any, values: Any, d2: Any, ties: Any) -> Any:
    same = builder.bitcast(builder.fcmp_ordered("==", d2, values), ir.IntType(LEAF))
    builder.store(builder.or_(builder.load(ties), same), ties)
    return builder.fcmp_unordered(">=", d2, values)


def _smaller(builder: Any, one: Any, other: Any) -> Any:
    return builder.select(builder.fcmp_ordered("<", other, one), other, one)


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
    total = _sum_of_squares(builder, own, others)
    builder.store(total, _vector_at(builder, d2, _long(place), _DOUBLES), align=8)
    return total


def _sum_of_squares(builder: Any, own: list[Any], others: list[Any]) -> Any:
    total = None
    for one, other in zip(own, others, strict=True):
        difference = builder.fsub(other, one)
        square = builder.fmul(difference, difference)
        total = square if total is None else builder.fadd(total, square)
    return total


def _bits(builder: Any, condition: Any) -> Any:
    return builder.zext(builder.bitcast(condition, ir.IntType(LEAF)), _LONG)
