# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Union-find over rows, with the elder rule of zeroth persistent homology."""

from __future__ import annotations

from topo_region_seg.compiled.dialect import index, inlined


@inlined
def find(parent, row):  # type: ignore[no-untyped-def]
    """Return the root of `row`, halving the path on the way."""
    above = parent[index(row)]
    while above != row:
        higher = parent[index(above)]
        parent[index(row)] = higher
        row, above = higher, parent[index(higher)]
    return row


@inlined
def unite(parent, size, elder, death, into, a, b, scale):  # type: ignore[no-untyped-def]
    """Unite the components of rows `a` and `b` at `scale`; return whether they were two.

    `elder[root]` is the smallest point id of a component. The component with the larger one dies: its
    `death` becomes `scale` (elder rule; all births are equal) and `into` the smaller one; both are indexed by point id.
    """
    a, b = find(parent, a), find(parent, b)
    if a == b:
        return False
    if size[index(a)] < size[index(b)]:
        a, b = b, a
    p, q = index(a), index(b)
    parent[q] = a
    size[p] += size[q]
    young, old = max(elder[p], elder[q]), min(elder[p], elder[q])
    elder[p] = old
    death[index(young)] = scale
    into[index(young)] = old
    return True
