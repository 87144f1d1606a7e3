# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""One frame: segmented, timed and measured."""

from __future__ import annotations

import time
import warnings
from typing import Any

import numpy as np

from benchmarks.objects.datasets import Sample, data_sets
from topo_region_seg.data import LabelArray
from topo_region_seg.offline.evaluation.measures import FIRST_OBJECT, TruthReading, measure
from topo_region_seg.params import Params
from topo_region_seg.pipeline import Pipeline


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


def measured(sample: Sample, labels: LabelArray) -> dict[str, Any]:
    """Return the measures of labels; of the tabletop also those by whole objects, whose names begin with `whole_`."""
    found = _all(sample, labels, whole_objects=False)
    if sample.kind == "tabletop" and int(np.max(sample.truth)) >= FIRST_OBJECT + 10:
        found |= {f"whole_{key}": value for key, value in _all(sample, labels, whole_objects=True).items()}
    return found


def _all(sample: Sample, labels: LabelArray, whole_objects: bool) -> dict[str, Any]:
    valid = np.isfinite(sample.cloud.xyz).all(axis=1)
    reading = TruthReading(whole_objects=whole_objects, partial=not sample.complete)
    found = measure(sample.truth, labels, valid, sample.cloud.height, sample.cloud.width, reading)
    rounded = {key: None if value is None else round(value, 4) for key, value in found.items()}
    present = np.unique(sample.truth[valid & (sample.truth >= FIRST_OBJECT)])
    true = len(np.unique(present // 10)) if whole_objects else len(present)
    return {"kind": sample.kind, "reported": len(np.unique(labels[labels > 0])), "true": true, **rounded}
