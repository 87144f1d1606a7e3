# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The quality measures once more, from their definitions, set by set and pixel by pixel; nothing of the package."""

from __future__ import annotations

from itertools import product

import numpy as np
from sklearn.metrics import adjusted_rand_score

NAMES = ("wov", "fos", "fus", "ari", "boundary_recall", "boundary_precision", "asa", "labelled")


def measures(truth: np.ndarray, labels: np.ndarray, valid: np.ndarray, height: int, width: int) -> dict:
    found = dict.fromkeys(NAMES)
    points = np.flatnonzero(valid).tolist()
    segments, regions = sets(truth, points, 20), sets(labels, points, 1)
    if points:
        found["labelled"] = sum(map(len, regions.values())) / len(points)
    if not segments:
        return found
    total = sum(map(len, segments.values()))
    overlap = kept = spilled = 0.0
    for g in segments.values():
        best = max(regions.values(), key=lambda s: (len(g & s), len(s)), default=set())
        if g & best:
            overlap += len(g) * len(g & best) / len(g | best)
            kept += len(g & best)
            spilled += len(best - g)
    found["wov"], found["fos"], found["fus"] = overlap / total, 1 - kept / total, spilled / total
    found["asa"] = sum(max(len(g & s) for g in segments.values()) for s in regions.values()) / total
    on_objects = [i for i in points if truth[i] >= 20]
    found["ari"] = adjusted_rand_score(truth[on_objects], labels[on_objects])
    if height > 1:
        on_object = np.where(valid & (truth >= 20), truth, 0)
        true_edge = edge(on_object, valid, height, width)
        own_edge = edge(labels, valid, height, width)
        found["boundary_recall"] = near(true_edge, own_edge)
        found["boundary_precision"] = near(own_edge, true_edge)
    return found


def sets(labels: np.ndarray, points: list[int], first: int) -> dict[int, set[int]]:
    found: dict[int, set[int]] = {}
    names = labels.tolist()
    for i in points:
        if names[i] >= first:
            found.setdefault(names[i], set()).add(i)
    return found


def edge(labels: np.ndarray, valid: np.ndarray, height: int, width: int) -> set[tuple[int, int]]:
    names, known = labels.reshape(height, width).tolist(), valid.reshape(height, width).tolist()
    found = set()
    for row, column in product(range(height), range(width)):
        for r, c in ((row + 1, column), (row, column + 1)):
            inside = r < height and c < width and known[row][column] and known[r][c]
            if inside and names[row][column] != names[r][c]:
                found |= {(row, column), (r, c)}
    return found


def near(wanted: set[tuple[int, int]], given: set[tuple[int, int]]) -> float | None:
    if not wanted:
        return None
    square = list(product(range(-2, 3), repeat=2))
    hits = [p for p in wanted if any((p[0] + dr, p[1] + dc) in given for dr, dc in square)]
    return len(hits) / len(wanted)
