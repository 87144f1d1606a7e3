# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""One frame: segmented, timed and measured."""

from __future__ import annotations

import time
import warnings
from typing import Any

import numpy as np

from benchmarks.objects.datasets import Sample, data_sets
from topo_region_seg.offline.evaluation.contingency import contingency
from topo_region_seg.offline.evaluation.detection import detection_measures
from topo_region_seg.offline.evaluation.measures import FIRST_OBJECT, measure
from topo_region_seg.params import Params
from topo_region_seg.pipeline import Pipeline

PRECISION = ("overlap_precision", "overlap_f", "precision_50", "precision_75", "false_objects", "boundary_precision")
"""Measures that count what is reported where no truth is, so that all objects need truth."""


def measure_frame(data_set: str, name: str, params: Params, repeats: int) -> dict[str, Any]:
    """Segment a frame and return its measures, milliseconds of the processor (median of the repeats) and counts."""
    sample = data_sets()[data_set].load(name)
    times = []
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        for _ in range(repeats):
            started = time.process_time()
            seg = Pipeline(params).run(sample.cloud)
            times.append(1e3 * (time.process_time() - started))
    return {"cpu_ms": round(float(np.median(times)), 2), **measured(sample, seg.labels)}


def measured(sample: Sample, labels: np.ndarray[Any, np.dtype[np.uint32]]) -> dict[str, Any]:
    """Return the measures of labels; of the tabletop also those by whole objects, whose names begin with `whole_`."""
    found = _all(sample, sample.truth, labels)
    if sample.kind == "tabletop" and sample.truth.max(initial=0) >= FIRST_OBJECT + 10:
        whole = np.where(sample.truth >= FIRST_OBJECT, sample.truth // 10 * 10, sample.truth).astype(np.uint32)
        found |= {f"whole_{key}": value for key, value in _all(sample, whole, labels).items()}
    return found


def _all(sample: Sample, truth: np.ndarray[Any, np.dtype[np.uint32]], labels: Any) -> dict[str, Any]:
    valid = np.isfinite(sample.cloud.xyz).all(axis=1)
    found = measure(truth, labels, valid, sample.cloud.height, sample.cloud.width)
    found |= detection_measures(contingency(truth[valid], labels[valid]), FIRST_OBJECT)
    if not sample.complete:
        found |= dict.fromkeys(PRECISION)
    rounded = {key: None if value is None else round(value, 4) for key, value in found.items()}
    present = np.unique(truth[valid])
    counts = {"reported": len(np.unique(labels[labels > 0])), "true": int(np.sum(present >= FIRST_OBJECT))}
    return {"kind": sample.kind, **counts, **rounded}
