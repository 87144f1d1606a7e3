# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Birth and death of the classes of a merge tree that are large enough for regions."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from topo_region_seg.compiled.dialect import kernel
from topo_region_seg.data import Components, FloatArray, IntArray, LabelArray
from topo_region_seg.steps.scales.search import deaths_in_order


class Classes(NamedTuple):
    """Classes of components with at least so many input points.

    A class is born at the scale at which a component first holds that many. It dies where its component joins that of
    an older one (elder rule); of two born at one scale the one with more points lives on, as nothing else is told apart
    by more than the order of the points.

    Parameters
    ----------
    birth : (C,) float64
        Metres.
    death : (C,) float64
        Metres; inf for those that live when the filtration ends.
    point : (C,) int64
        A point of each.
    """

    birth: FloatArray
    death: FloatArray
    point: IntArray


def classes_of(components: Components, weight: IntArray, min_size: int) -> Classes:
    """Return the classes of a filtration with at least `min_size` input points; `weight` (N,) is that of each point."""
    order = deaths_in_order(components)
    found = Classes(*class_bars(components.parent, order, components.death, weight, min_size))
    lives = found.death > found.birth  # deaths at one scale come one after the other, as if they were several
    return Classes(found.birth[lives], found.death[lives], found.point[lives])


def bars_of_regions(
    classes: Classes, scale: float, labels: LabelArray, of: LabelArray
) -> tuple[FloatArray, FloatArray]:
    """Return birth and death of regions, each (M,), metres: those of the oldest class in each at a scale, metres.

    A region of which no component is large enough, as it was made of small ones, is born and dies at the scale.

    Parameters
    ----------
    classes : Classes
        Those of the filtration.
    scale : float
        The scale of the regions.
    labels : (N,) uint32
        Label of each point; 0 = none.
    of : (M,) uint32
        Labels of the regions.
    """
    birth, death = np.full(len(of), scale), np.full(len(of), scale)
    alive = np.flatnonzero((classes.birth <= scale) & (classes.death > scale))
    row = np.full(int(np.max(labels, initial=0)) + 1, -1)
    row[of[of < len(row)]] = np.flatnonzero(of < len(row))
    place = row[labels[classes.point[alive]]]
    alive, place = alive[place >= 0], place[place >= 0]
    # The oldest comes last, and of those of one age the one that lives longest.
    last = np.lexsort((classes.death[alive], -classes.birth[alive]))
    birth[place[last]], death[place[last]] = classes.birth[alive[last]], classes.death[alive[last]]
    return birth, death


@kernel
def class_bars(
    parent: IntArray, order: IntArray, death: FloatArray, weight: IntArray, min_size: int
) -> tuple[FloatArray, FloatArray, IntArray]:
    """Return birth, death and a point, each (C,), of all classes, those of no length included.

    `order` (D,) is the points that die, first to die first, and `parent` (N,) their parents in the merge tree.
    """
    n = len(parent)
    size = weight.copy()
    own = np.full(n, -1)
    # A class is born of one point, or where two components meet.
    birth, dies, point = np.empty(n + len(order)), np.full(n + len(order), np.inf), np.empty(n + len(order), np.int64)
    count = 0
    for p in range(n):
        if size[p] >= min_size:
            own[p], birth[count], point[count] = count, 0.0, p
            count += 1
    for young in order:
        old, scale = parent[young], death[young]
        one, other = own[old], own[young]
        if one >= 0 and other >= 0:
            if birth[other] < birth[one] or (birth[other] == birth[one] and size[young] > size[old]):
                one, other = other, one
            dies[other] = scale
        elif other >= 0:
            one = other
        size[old] += size[young]
        if one < 0 and size[old] >= min_size:
            one, birth[count], point[count] = count, scale, old
            count += 1
        own[old] = one
    return birth[:count].copy(), dies[:count].copy(), point[:count].copy()
