# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The kernels without one of their tricks each: what a process takes on before it compiles them.

The package holds no switch for this: names of its modules are replaced, and nothing is kept on disk.
"""

from __future__ import annotations

import importlib
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from typing import Any, NamedTuple

import numba
import numpy as np

PACKAGE = "topo_region_seg"
READ_BY_KERNELS = {
    "steps.filtration.pair_queue.BUCKET_SHIFT",
    "compiled.kd_tree.SAMPLE",
    "steps.normals.neighborhoods.CHUNK",
    "beyond.objects.curvature.CHUNK",
}
"""Constants that are compiled in: kernels from the disk have other ones."""


class Form(NamedTuple):
    """The kernels without a trick."""

    words: str
    stages: tuple[str, ...]
    take_on: Callable[[], None]


def take_on(form: str, constants: Mapping[str, float]) -> None:
    """Give this process a form of the kernels, and constants by `module.NAME`, before any is compiled."""
    if form or READ_BY_KERNELS.intersection(constants):
        _replace("compiled.cache", kept_on_disk=_nothing_kept)
    if form:
        FORMS[form].take_on()
    for place, value in constants.items():
        # Modules that import the constant are loaded later.
        module, _, name = place.rpartition(".")
        _replace(module, **{name: type(getattr(_module(module), name))(value)})


@contextmanager
def _nothing_kept() -> Iterator[bool]:
    yield False


def _module(name: str) -> Any:
    return importlib.import_module(f"{PACKAGE}.{name}")


def _replace(module: str, **names: Any) -> None:
    found = _module(module)
    for name, value in names.items():
        if not hasattr(found, name):
            raise AttributeError(f"{found.__name__} has no {name}")
        setattr(found, name, value)


def _kernel(function: Any) -> Any:
    return numba.njit(nogil=True, error_model="numpy")(function)


def _inlined(function: Any) -> Any:
    return numba.njit(nogil=True, error_model="numpy", inline="always")(function)


def _signed_index() -> None:
    _replace("compiled.dialect", index=np.int64)


def _counted_arrays() -> None:
    _replace("compiled.dialect", borrowed=_inlined(lambda value: value))


def _calls() -> None:
    _replace("compiled.dialect", inlined=_kernel)


def _sums_in_order() -> None:
    _replace("compiled.dialect", summing=_kernel)


def _plain_zeros() -> None:
    def trailing_zeros(bits):  # type: ignore[no-untyped-def]
        place = 0
        while not (bits >> place) & 1:
            place += 1
        return place

    _replace("compiled.lanes", trailing_zeros=_inlined(trailing_zeros))


def _plain_sieve() -> None:
    leaf = 8

    def sift_leaves(blocks, roots, row_a, row_b, sieve):  # type: ignore[no-untyped-def]
        reach, color_from, color_to, chord_from, chord_to, near = sieve
        hits, beyond = 0, np.float32(np.inf)
        p, q = np.uint64(row_a // leaf), np.uint64(row_b // leaf)
        for i in range(leaf):
            for j in range(leaf):
                d2, color, chord = np.float32(0.0), np.float32(0.0), np.float32(0.0)
                for c in range(3):
                    d2 += (blocks[p, np.uint64(c), np.uint64(i)] - blocks[q, np.uint64(c), np.uint64(j)]) ** 2
                for c in range(3, 6):
                    color += (blocks[p, np.uint64(c), np.uint64(i)] - blocks[q, np.uint64(c), np.uint64(j)]) ** 2
                for c in range(6, 9):
                    chord += (blocks[p, np.uint64(c), np.uint64(i)] - blocks[q, np.uint64(c), np.uint64(j)]) ** 2
                passes = (
                    (roots[np.uint64(row_a + i)] != roots[np.uint64(row_b + j)])
                    & (d2 <= reach)
                    & (color <= color_to)
                    & (color >= color_from)
                    & (not ((chord > chord_to) | (chord < chord_from)))
                )
                if passes:
                    if d2 <= near:
                        hits |= 1 << (leaf * i + j)
                    else:
                        beyond = min(beyond, d2)
        return hits, np.int64(np.float32(beyond).view(np.int32))

    _replace("steps.filtration.leaf_sieve", sift_leaves=_inlined(sift_leaves))


def _no_sieve() -> None:
    predicate, queue = _module("compiled.predicate"), _module("steps.filtration.pair_queue")
    leaf, edge_length, bits_of = 8, predicate.edge_length, queue.bits_of
    far = np.int64(0x7FF0000000000000)

    def meet_leaves(leaves, roots, limits, start_a, start_b, end, shortest_only, edges, n_edges):
        first, later, n = n_edges, far, len(leaves.order)
        for a in range(start_a, min(start_a + leaf, n)):
            p = leaves.order[np.uint64(a)]
            for b in range(a + 1 if start_a == start_b else start_b, min(start_b + leaf, n)):
                if roots[np.uint64(a)] == roots[np.uint64(b)]:
                    continue
                d2 = edge_length(leaves.points, limits, p, leaves.order[np.uint64(b)])
                if d2 < 0.0:
                    continue
                if bits_of(d2) >= end:
                    later = min(later, bits_of(d2))
                elif shortest_only and n_edges > first:
                    if d2 < edges.d2[first]:
                        edges.d2[first], edges.a[first], edges.b[first] = d2, a, b
                else:
                    edge = np.uint64(n_edges)
                    edges.d2[edge], edges.a[edge], edges.b[edge] = d2, a, b
                    n_edges += 1
        if shortest_only and n_edges > first:
            return n_edges, far
        return n_edges, later

    _replace("steps.filtration.leaf_pairs", meet_leaves=_inlined(meet_leaves))


def _library_root() -> None:
    def lightness(t):  # type: ignore[no-untyped-def]
        return np.cbrt(t) if t > (6.0 / 29.0) ** 3 else t * (841.0 / 108.0) + 4.0 / 29.0

    _replace("steps.color", lightness=_inlined(lightness))


def _marked_bucket() -> None:
    mark = 64  # the word after those of the buckets

    def put_point(queue, point, bucket):  # type: ignore[no-untyped-def]
        head = queue.head[np.uint64(bucket)]
        queue.before[np.uint64(point)], queue.after[np.uint64(point)] = -1, head
        if head >= 0:
            queue.before[np.uint64(head)] = point
        queue.head[np.uint64(bucket)] = point
        queue.filled[mark] = min(queue.filled[mark], bucket)

    def take_point(queue, point, bucket):  # type: ignore[no-untyped-def]
        before, after = queue.before[np.uint64(point)], queue.after[np.uint64(point)]
        if after >= 0:
            queue.before[np.uint64(after)] = before
        if before >= 0:
            queue.after[np.uint64(before)] = after
        else:
            queue.head[np.uint64(bucket)] = after

    def least_bucket(queue):  # type: ignore[no-untyped-def]
        n, bucket = np.int64(len(queue.head)), np.int64(queue.filled[mark])
        while bucket < n and queue.head[np.uint64(bucket)] < 0:
            bucket += 1
        queue.filled[mark] = bucket
        return bucket if bucket < n else np.int64(-1)

    functions = {function.__name__: _inlined(function) for function in (put_point, take_point, least_bucket)}
    _replace("beyond.supervoxels.point_queue", **functions)


FILTRATIONS = ("filtration", "filtration, ball", "filtration, made")
SUPERVOXELS = ("supervoxels", "supervoxels, random")
WALKS = ("normals", "small_regions", "grooves", "objects", "adjacency", "supervoxels")

FORMS = {
    "index": Form("an index is unsigned", ("records", "tree", *WALKS, *FILTRATIONS), _signed_index),
    "borrowed": Form("references to arrays are not counted", ("supervoxels", *FILTRATIONS), _counted_arrays),
    "inlined": Form("functions are compiled into their callers", (*WALKS, *FILTRATIONS), _calls),
    "summing": Form("sums are taken in any order", ("support", "normals", "grooves"), _sums_in_order),
    "single precision": Form("leaves are sieved in single precision first", FILTRATIONS, _no_sieve),
    "vector sieve": Form("the sieve takes eight points at once", FILTRATIONS, _plain_sieve),
    "trailing zeros": Form(
        "the lowest bit that is set is found by one instruction", (*SUPERVOXELS, *FILTRATIONS), _plain_zeros
    ),
    "cube root": Form("the cube root is three of Halley's steps", ("color",), _library_root),
    "filled buckets": Form("a bit tells of each bucket whether it is filled", SUPERVOXELS, _marked_bucket),
}
