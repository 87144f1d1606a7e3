# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The insides of vessels, which belong to the outsides before them."""

from __future__ import annotations

import numpy as np

from topo_region_seg.steps.view.label_image import Labels
from topo_region_seg.steps.view.outlines import OCCLUDED, OWN, TOUCHING, Relations
from topo_region_seg.compiled.dialect import kernel
from topo_region_seg.data import FloatArray
from topo_region_seg.steps.view.grid import Single

PAIRS = 400
FEWEST = 20
CURVED = 0.15


@kernel
def openings(label: Labels, xyz: Single, normals: Single, n_labels: int) -> FloatArray:
    """Return for each label (L,) by how much normals open over pairs of its points, on the mean: above 0 it is convex,
    below concave."""
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


def insides(relations: Relations, opening: FloatArray, n_objects: int, support: int):
    """Return for each label (L,) that of which it is the inside; itself if it is none."""
    n = len(opening)
    total = np.bincount(relations.first, relations.count.sum(axis=1), len(relations.frame))
    whole = np.maximum(total + relations.frame + relations.void, 1.0)
    own = np.bincount(relations.first, relations.count[:, OWN], len(whole)) / whole
    on_ground = relations.second >= n
    stands = np.bincount(relations.first[on_ground], relations.count[on_ground, TOUCHING], len(whole)) / whole
    to = np.arange(n)
    for k in np.argsort(opening, kind="stable"):
        if k == 0 or opening[k] > -CURVED or stands[k] > 0.1 or own[k] < 0.3:
            continue
        mine = (relations.first == k) & (relations.second < n)
        other, count = relations.second[mine], relations.count[mine] / max(total[k], 1.0)
        fit = np.where((opening[other] >= CURVED) & (count[:, OWN] <= 0.1), count[:, OCCLUDED] + count[:, TOUCHING], 0.0)
        if len(fit) and fit.max() > 0.18:
            to[to == k] = other[fit.argmax()]
    return to
