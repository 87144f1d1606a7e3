# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""How many points each true segment shares with each region: counted once, and all that measures need but images."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from topo_region_seg.data import IntArray, LabelArray

_FEW = 2**22
"""Labels and pairs of labels below this number are counted in a table; others are sorted."""


@dataclass(frozen=True)
class Contingency:
    """Pairs of a true label and a region's label that share points, sorted by true label, then by region.

    Parameters
    ----------
    truths, labels : (T,), (L,) uint32
        The true labels and the labels that occur, ascending.
    truth, label : (P,) int64
        For each pair, rows of `truths` and `labels`.
    count : (P,) int64
        Number of points that have both.
    truth_size, label_size : (T,), (L,) int64
        Number of points of each.
    """

    truths: LabelArray
    labels: LabelArray
    truth: IntArray
    label: IntArray
    count: IntArray
    truth_size: IntArray
    label_size: IntArray


def contingency(truth: LabelArray, labels: LabelArray) -> Contingency:
    """Count the pairs of labels of some points, (N,) each."""
    truths, truth_row, truth_size = _numbered(truth)
    known, label_row, label_size = _numbered(labels)
    pair = truth_row * len(known) + label_row
    if len(truths) * len(known) <= _FEW:
        table = np.bincount(pair, minlength=len(truths) * len(known))
        pairs = np.flatnonzero(table)
        count = table[pairs]
    else:
        pairs, count = np.unique(pair, return_counts=True)
    row, column = np.divmod(pairs, max(len(known), 1))
    return Contingency(truths, known, row, column, count, truth_size, label_size)


def _numbered(labels: LabelArray) -> tuple[LabelArray, IntArray, IntArray]:
    """Return the labels that occur, the row of each point among them, and their numbers of points."""
    if len(labels) and int(np.max(labels)) < _FEW:
        counts = np.bincount(labels)
        numbers = np.flatnonzero(counts)
        row = np.zeros(len(counts), np.int64)
        row[numbers] = np.arange(len(numbers))
        return numbers.astype(np.uint32), row[labels], counts[numbers]
    known, inverse, size = np.unique(labels, return_inverse=True, return_counts=True)
    return known, inverse.astype(np.int64), size.astype(np.int64)
