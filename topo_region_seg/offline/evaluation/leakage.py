# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""How far regions reach beyond the objects that they lie on, which does not punish a region for being a part of one."""

from __future__ import annotations

import numpy as np

from topo_region_seg.offline.evaluation.contingency import Contingency

PIECE = 10
"""A region with at least one in so many points of an object is a piece of it."""


def leakage(counted: Contingency, first_object: int) -> dict[str, float]:
    """Return the measures `achievable`, `spill` and `pieces`; there must be an object.

    A region is mostly what most of its points are: one of the objects, or surroundings, all of which count as one and
    as unknown points do. Of as many it is surroundings, then the object with the smaller label.

    Parameters
    ----------
    counted : Contingency
        The points of the true labels and of the regions; label 0 is none.
    first_object : int
        True labels from this one up are objects.
    """
    c = counted
    of_object = c.truths >= first_object
    # Column 0 is the surroundings.
    column = np.where(of_object, np.cumsum(of_object), 0)
    table = np.zeros((len(c.labels), int(np.max(column)) + 1), np.int64)
    np.add.at(table, (c.label, column[c.truth]), c.count)
    sizes = table.sum(axis=0)[1:]
    table = table[c.labels > 0]
    mostly = np.argmax(table, axis=1)
    most = np.max(table, axis=1, initial=0)
    counts = mostly > 0
    points = int(sizes.sum())
    return {
        "achievable": int(most[counts].sum()) / points,
        "spill": int((table.sum(axis=1) - most)[counts].sum()) / points,
        "pieces": float(np.mean((PIECE * table[:, 1:] >= sizes).sum(axis=0))),
    }
