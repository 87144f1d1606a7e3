# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""One frame: segmented by each program, timed and measured."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from benchmarks.objects.ablations import PARTS, without
from benchmarks.objects.datasets import Sample, data_sets
from benchmarks.objects.programs import OURS, PEERS, ours
from topo_region_seg.data import LabelArray
from topo_region_seg.offline.evaluation.measures import FIRST_OBJECT, PER_OBJECT, TruthReading, measure
from topo_region_seg.params import Params

WHOLE = "whole_"
"""What the names of measures by whole objects begin with."""


def measure_frame(
    data_set: str, name: str, params: Params, repeats: int, peers: Sequence[str], parts: Sequence[str] = ()
) -> dict[str, dict[str, Any]]:
    """Return by program the measures, `cpu_ms`, and the numbers of objects `reported` and `true`.

    Programs are this package, the `peers`, and this package without each of the `parts`.
    """
    sample = data_sets()[data_set].load(name)
    found = {OURS: ours(sample.cloud, params, repeats)} | {peer: PEERS[peer](sample.cloud) for peer in peers}
    found |= {part: without(PARTS[part], sample.cloud, params) for part in parts}
    return {
        program: {"kind": sample.kind, "cpu_ms": round(ms, 2), **measured(sample, labels)}
        for program, (labels, ms) in found.items()
    }


def measured(sample: Sample, labels: LabelArray) -> dict[str, Any]:
    """Return the measures of labels; where truth has parts, also those by whole objects."""
    found = _by(sample, labels, whole_objects=False)
    if sample.parts:
        found |= {f"{WHOLE}{key}": value for key, value in _by(sample, labels, whole_objects=True).items()}
    return found


def _by(sample: Sample, labels: LabelArray, whole_objects: bool) -> dict[str, Any]:
    valid = np.isfinite(sample.cloud.xyz).all(axis=1)
    reading = TruthReading(whole_objects=whole_objects, partial=not sample.complete)
    found = measure(sample.truth, labels, valid, sample.cloud.height, sample.cloud.width, reading)
    rounded = {key: None if value is None else round(value, 4) for key, value in found.items()}
    present = np.unique(sample.truth[valid & (sample.truth >= FIRST_OBJECT)])
    true = len(np.unique(present // PER_OBJECT)) if whole_objects else len(present)
    return {"reported": len(np.unique(labels[labels > 0])), "true": true, **rounded}
