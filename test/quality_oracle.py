# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The quality measures once more, from their definitions, set by set and pixel by pixel; nothing of the package."""

from __future__ import annotations

import math
from fractions import Fraction
from itertools import product

import numpy as np
from scipy.optimize import linprog
from sklearn.metrics import adjusted_rand_score

NAMES = (
    *("wov", "fos", "fus", "ari", "boundary_recall", "boundary_precision", "asa", "labelled"),
    *("overlap_precision", "overlap_recall", "overlap_f", "f75", "precision_50", "recall_50"),
    *("precision_75", "recall_75", "false_objects", "boundary_f"),
    *("achievable", "spill", "pieces"),
)

FEW = 6
"""Segments up to which all assignments are tried."""


def measures(truth: np.ndarray, labels: np.ndarray, valid: np.ndarray, height: int, width: int) -> dict:
    found = dict.fromkeys(NAMES)
    points = np.flatnonzero(valid).tolist()
    segments, regions = sets(truth, points, 20), sets(labels, points, 1)
    if points:
        found["labelled"] = sum(map(len, regions.values())) / len(points)
    unknown = {i for i in points if truth[i] == 0}
    judged = {name: s for name, s in regions.items() if len(s & unknown) <= len(s - unknown)}
    if len(unknown) < len(points):
        good = [s for s in judged.values() if any(iou(g, s) > 0.5 for g in segments.values())]
        found["false_objects"] = len(judged) - len(good)
    for percent in (50, 75):
        hits = sum(iou(g, s) > percent / 100 for g in segments.values() for s in regions.values())
        found[f"precision_{percent}"] = hits / len(judged) if judged else None
        found[f"recall_{percent}"] = hits / len(segments) if segments else None
    pairs = assignment(segments, regions)
    counted = judged | {s: regions[s] for _, s in pairs}
    right = sum(len(segments[g] & regions[s]) for g, s in pairs)
    if counted:
        found["overlap_precision"] = right / sum(map(len, counted.values()))
    if not segments:
        return found
    found["overlap_recall"] = right / sum(map(len, segments.values()))
    found["overlap_f"] = f_of(found["overlap_precision"] or 0, found["overlap_recall"])
    found["f75"] = sum(dice(segments[g], regions[s]) > 0.75 for g, s in pairs) / len(segments)
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
    surroundings = {i for i in points if truth[i] < 20}
    right = outside = 0
    for s in regions.values():
        parts = [len(s & surroundings), *(len(s & segments[g]) for g in sorted(segments))]
        if max(parts) > parts[0]:
            right, outside = right + max(parts), outside + len(s) - max(parts)
    found["achievable"], found["spill"] = right / total, outside / total
    pieces = [sum(10 * len(s & g) >= len(g) for s in regions.values()) for g in segments.values()]
    found["pieces"] = sum(pieces) / len(pieces)
    on_objects = [i for i in points if truth[i] >= 20]
    found["ari"] = adjusted_rand_score(truth[on_objects], labels[on_objects])
    if height > 1:
        on_object = np.where(valid & (truth >= 20), truth, 0)
        true_edge = edge(on_object, valid, height, width)
        own_edge = edge(labels, valid, height, width)
        found["boundary_recall"] = near(true_edge, own_edge)
        found["boundary_precision"] = near(own_edge, true_edge)
        found["boundary_f"] = boundary_f(on_object, labels, true_edge, own_edge, pairs, set(counted), width, height)
    return found


def iou(a: set[int], b: set[int]) -> float:
    return len(a & b) / len(a | b)


def dice(a: set[int], b: set[int]) -> Fraction:
    return Fraction(2 * len(a & b), len(a) + len(b))


def f_of(precision: float, recall: float) -> float:
    return 2 / (1 / precision + 1 / recall) if precision and recall else 0.0


def assignment(segments: dict[int, set[int]], regions: dict[int, set[int]]) -> list[tuple[int, int]]:
    """The one-to-one pairs with the largest sum of F; of equal ones those with more common points."""
    return by_program(segments, regions) if len(segments) > FEW else assignments(segments, regions)[0]


def tied(truth: np.ndarray, labels: np.ndarray, valid: np.ndarray) -> bool:
    """Whether several assignments are equally good, which matters for boundaries and F above 0.75 alone."""
    points = np.flatnonzero(valid).tolist()
    return len(assignments(sets(truth, points, 20), sets(labels, points, 1))) > 1


def assignments(segments: dict[int, set[int]], regions: dict[int, set[int]]) -> list[list[tuple[int, int]]]:
    """All best assignments. Region after region, the best ways to have used each set of segments are kept."""
    best: dict[frozenset[int], tuple] = {frozenset(): (Fraction(0), 0, [[]])}
    for s, region in regions.items():
        after = dict(best)
        for used, (total, common, ways) in best.items():
            for g, segment in segments.items():
                if segment & region and g not in used:
                    worth = (total + dice(segment, region), common + len(segment & region))
                    longer = [[*way, (g, s)] for way in ways]
                    known = after.get(used | {g}, (*worth, []))
                    if worth >= known[:2]:
                        after[used | {g}] = (*worth, longer + (known[2] if worth == known[:2] else []))
        best = after
    most = max(found[:2] for found in best.values())
    return [way for found in best.values() if found[:2] == most for way in found[2]]


def by_program(segments: dict[int, set[int]], regions: dict[int, set[int]]) -> list[tuple[int, int]]:
    """The same as a linear program, for many segments: each is used once at most, and so is each region."""
    pairs = [(g, s) for g, s in product(segments, regions) if segments[g] & regions[s]]
    worth = [-float(dice(segments[g], regions[s])) for g, s in pairs]
    once = np.array([[name in pair for pair in tagged(pairs)] for name in {n for p in tagged(pairs) for n in p}])
    found = linprog(worth, A_ub=once, b_ub=np.ones(len(once)), method="highs-ds")
    assert np.allclose(found.x, np.round(found.x))
    return [pair for pair, used in zip(pairs, found.x, strict=True) if used > 0.5]


def tagged(pairs: list[tuple[int, int]]) -> list[tuple[tuple[str, int], tuple[str, int]]]:
    return [(("segment", g), ("region", s)) for g, s in pairs]


def boundary_f(
    truth: np.ndarray,
    labels: np.ndarray,
    true_edge: set[tuple[int, int]],
    own_edge: set[tuple[int, int]],
    pairs: list[tuple[int, int]],
    counted: set[int],
    width: int,
    height: int,
) -> float | None:
    reach = math.ceil(0.003 * math.sqrt(width**2 + height**2))
    disk = [(r, c) for r, c in product(range(-reach, reach + 1), repeat=2) if r * r + c * c <= reach * reach]

    def outlines(edge: set[tuple[int, int]], names: list[list[int]]) -> dict[int, set[tuple[int, int]]]:
        found: dict[int, set[tuple[int, int]]] = {}
        for r, c in edge:
            if names[r][c]:
                found.setdefault(names[r][c], set()).add((r, c))
        return found

    true = outlines(true_edge, truth.reshape(height, width).tolist())
    own = {s: e for s, e in outlines(own_edge, labels.reshape(height, width).tolist()).items() if s in counted}
    if not true:
        return None

    def hits(a: set[tuple[int, int]], b: set[tuple[int, int]]) -> int:
        return sum(any((r + dr, c + dc) in b for dr, dc in disk) for r, c in a)

    recall = sum(hits(true.get(g, set()), own.get(s, set())) for g, s in pairs) / sum(map(len, true.values()))
    precision = sum(hits(own.get(s, set()), true.get(g, set())) for g, s in pairs) / max(1, sum(map(len, own.values())))
    return f_of(precision, recall)


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
