# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The insides of vessels, which belong to the outsides before them."""

from __future__ import annotations

import numpy as np

from topo_region_seg.compiled.dialect import kernel
from topo_region_seg.data import FloatArray, IntArray
from topo_region_seg.steps.view.grid import Single
from topo_region_seg.steps.view.label_image import Labels
from topo_region_seg.steps.view.outlines import OCCLUDED, OWN, TOUCHING, Relations

PAIRS, FEWEST = 400, 20
"""Pairs of points whose normals are compared, of labels with at least so many points."""
CURVED = 0.15
"""Opening from which on a label is convex; below the negative of it, concave."""
STANDING, RIM, HIDDEN, BEFORE = 0.1, 0.3, 0.1, 0.18
"""Shares of the outline of an inside: on the ground at the most, its own at the least; hiding the outside at the most,
and hidden by it, or touching it, at the least."""


@kernel
def openings(label: Labels, xyz: Single, normals: Single, n_labels: int) -> FloatArray:
    """Return by how much the normals of each label (L,) open over pairs of its points, on the mean.

    Above 0 it is convex, below concave.
    """
    size = np.zeros(n_labels, np.int64)
    for p in range(len(label)):
        if label[p] > 0 and not np.isnan(normals[p, 0]):
            size[label[p]] += 1
    start = np.zeros(n_labels + 1, np.int64)
    start[1:] = np.cumsum(size)
    place, member = start[:-1].copy(), np.empty(start[-1], np.int64)
    for p in range(len(label)):
        if label[p] > 0 and not np.isnan(normals[p, 0]):
            member[place[label[p]]] = p
            place[label[p]] += 1
    opening = np.zeros(n_labels)
    for k in range(1, n_labels):
        n = size[k]
        if n < FEWEST:
            continue
        total, count = 0.0, 0
        step = np.uint64(0x9E3779B97F4A7C15)
        state = np.uint64(k + 1) * step
        for _ in range(PAIRS):
            state += step
            mixed = (state ^ (state >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
            mixed = (mixed ^ (mixed >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
            i = member[start[k] + np.int64((mixed >> np.uint64(33)) % np.uint64(n))]
            j = member[start[k] + np.int64((mixed & np.uint64(0x7FFFFFFF)) % np.uint64(n))]
            along, apart = 0.0, 0.0
            for c in range(3):
                e = np.float64(xyz[i, c]) - np.float64(xyz[j, c])
                along += e * (np.float64(normals[i, c]) - np.float64(normals[j, c]))
                apart += e * e
            total += along / max(np.sqrt(apart), 1e-6)
            count += 1
        opening[k] = total / count
    return opening


def insides(found: Relations, opening: FloatArray) -> IntArray:
    """Return for each label (L,) that of which it is the inside; itself if it is none.

    An inside is concave, stands on nothing, and has a rim of its own, behind which it is hidden by, or touches, a
    convex part that it does not hide itself.
    """
    n = len(opening)
    total = found.totals(n)
    among = np.maximum(np.bincount(found.first, found.pixels.sum(axis=1), len(found.frame))[:n], 1.0)
    own = np.bincount(found.first, found.pixels[:, OWN], len(found.frame))[:n] / total
    ground = found.second >= n
    stands = np.bincount(found.first[ground], found.pixels[ground, TOUCHING], len(found.frame))[:n] / total
    group = np.arange(n)
    for k in np.argsort(opening, kind="stable"):
        if k == 0 or opening[k] > -CURVED or stands[k] > STANDING or own[k] < RIM:
            continue
        mine = (found.first == k) & (found.second < n)
        other, count = found.second[mine], found.pixels[mine] / among[k]
        outside = (opening[other] >= CURVED) & (count[:, OWN] <= HIDDEN)
        fit = np.where(outside, count[:, OCCLUDED] + count[:, TOUCHING], 0.0)
        if len(fit) and np.max(fit) > BEFORE:
            group[group == k] = group[other[int(np.argmax(fit))]]
    return group
