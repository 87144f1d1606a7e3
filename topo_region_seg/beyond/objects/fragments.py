# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Small segments that touch a larger one along much of their outline, and belong to it."""

from __future__ import annotations

import numpy as np

from topo_region_seg.beyond.objects.convexity import Borders
from topo_region_seg.data import FloatArray, IntArray
from topo_region_seg.steps.view.outlines import OCCLUDED, TOUCHING, Relations

SMALL = 1000
"""Pixels up to which a segment may be a fragment of what it touches."""
TOUCHED = 0.12
"""Share of its outline along which it must touch."""
ENCLOSED = 0.25
"""Share from which on less of the border needs to be convex, by as much."""


def borders_of_fragments(borders: Borders, found: Relations, size: IntArray) -> Borders:
    """Return borders of which only those have pairs that lie between a fragment and what it touches.

    Parameters
    ----------
    borders : Borders
        Borders between segments.
    found : Relations
        What lies beyond the outlines of these.
    size : (L,) int64
        Pixels of each segment.
    """
    n = len(size)
    first_is_small = size[borders.first] < size[borders.second]
    small = np.where(first_is_small, borders.first, borders.second)
    large = np.where(first_is_small, borders.second, borders.first)
    count = _counts(found, small, large)
    touched = count[:, TOUCHING] / found.totals(n)[small]
    fragment = (size[small] <= SMALL) & (touched >= TOUCHED) & (count[:, OCCLUDED] <= count[:, TOUCHING])
    more = np.where(touched >= ENCLOSED, ENCLOSED, 0.0) * borders.pairs
    convex = np.minimum(borders.convex + more, borders.pairs)
    return borders._replace(pairs=np.where(fragment, borders.pairs, 0.0), convex=np.where(fragment, convex, 0.0))


def _counts(found: Relations, first: IntArray, second: IntArray) -> FloatArray:
    """Return the counts (B, 3) of pairs of labels; 0 where they do not meet."""
    n = len(found.frame)
    known, wanted = found.first * n + found.second, first * n + second
    if len(known) == 0:
        return np.zeros((len(wanted), 3))
    place = np.minimum(np.searchsorted(known, wanted), len(known) - 1)
    counts: FloatArray = np.where((known[place] == wanted)[:, None], found.pixels[place], 0.0)
    return counts
