# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The results of an evaluation as JSON and CSV; undefined measures are null or an empty cell."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Sequence

from topo_region_seg.offline.evaluation.identity import Identity, summed
from topo_region_seg.offline.evaluation.measures import MEASURES, Measures
from topo_region_seg.offline.evaluation.results import BagResult, mean_measures, median_ms
from topo_region_seg.offline.evaluation.version import program_version
from topo_region_seg.params import Params


def json_text(results: Sequence[BagResult], params: Params) -> str:
    """Return means over frames, frames, recordings, rejected clouds, parameters and version as JSON."""
    frames = [frame for result in results for frame in result.frames]
    summary = {
        "mean": mean_measures(frames),
        "identity": _identity(summed(result.identity for result in results)),
        "ms": median_ms(frames),
        "frames": [
            {
                "bag": result.bag,
                "stamp": frame.stamp,
                "points": frame.points,
                "regions": frame.regions,
                **frame.measures,
                "ms": frame.ms,
            }
            for result in results
            for frame in result.frames
        ],
        "bags": [
            {
                "bag": result.bag,
                "topic": result.topic,
                "truth": result.truth,
                "mean": mean_measures(result.frames),
                "identity": _identity(result.identity),
                "ms": median_ms(result.frames),
                "frames": len(result.frames),
                "without_truth": result.without_truth,
                "rejected": len(result.rejected),
                "truncated": result.truncated,
                "problems": result.problems,
                "error": result.error or None,
            }
            for result in results
        ],
        "without_truth": sum(result.without_truth for result in results),
        "rejected": [
            {"bag": result.bag, "stamp": rejection.stamp, "reason": rejection.reason, "detail": rejection.detail}
            for result in results
            for rejection in result.rejected
        ],
        "truncated": any(result.truncated for result in results),
        "params": params.as_dict(),
        "version": program_version(),
    }
    return json.dumps(summary, indent=1, allow_nan=False) + "\n"


def csv_text(results: Sequence[BagResult]) -> str:
    """Return a header and one row per frame."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(["bag", "stamp", "points", "regions", *MEASURES, "ms"])
    for result in results:
        for frame in result.frames:
            values = [frame.measures[name] for name in MEASURES]
            writer.writerow([result.bag, frame.stamp, frame.points, frame.regions, *values, frame.ms["total"]])
    return text.getvalue()


def _identity(found: Identity | None) -> Measures | None:
    return None if found is None else found.measures()
