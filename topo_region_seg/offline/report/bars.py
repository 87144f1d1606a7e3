# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""A summary of a barcode: the bars of regions, the longest of the others, and a histogram of the deaths."""

from __future__ import annotations

from typing import Any

import numpy as np

from topo_region_seg.offline.runs.barcodes import Bars

LONGEST = 30
"""Largest number of bars of a kind that are drawn one by one."""
BINS = 40


def summarized(bars: Bars, max_radius: float) -> dict[str, Any]:
    """Return the parts of a barcode that the page draws.

    Parameters
    ----------
    bars : Bars
        All bars of a frame.
    max_radius : float
        The end of the filtration, metres.

    Returns
    -------
    dict
        `max_mm`; `total`, the number of bars; `forever`, how many never die; `region_count`, and `regions`, the labels
        of the first of them with the death of their longest bar, None if it never dies;
        `longest`, pairs of death in mm and label; `histogram`, the number of deaths in each of BINS equal parts of the
        filtration; `computed`, whether the barcode was computed for the page.
    """
    endless = np.isinf(bars.death)
    labels, place = np.unique(bars.label, return_inverse=True)
    last = np.zeros(len(labels))
    np.maximum.at(last, place.reshape(-1), bars.death)
    regions = [
        [int(label), None if np.isinf(death) else _millimeters(death)]
        for label, death in zip(labels, last, strict=True)
        if label
    ]
    finite = np.flatnonzero(~endless)
    longest = finite[np.argsort(-bars.death[finite], kind="stable")[:LONGEST]]
    histogram, _ = np.histogram(np.minimum(bars.death[finite], max_radius), BINS, (0.0, max_radius))
    return {
        "max_mm": 1e3 * max_radius,
        "total": len(bars.death),
        "forever": int(endless.sum()),
        "regions": regions[:LONGEST],
        "region_count": len(regions),
        "longest": [[_millimeters(bars.death[row]), int(bars.label[row])] for row in longest],
        "histogram": histogram.tolist(),
        "computed": bars.computed,
    }


def _millimeters(meters: float) -> float:
    return round(1e3 * float(meters), 3)
