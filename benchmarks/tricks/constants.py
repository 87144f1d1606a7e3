# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""What constants of the kernels were chosen by: time, where no result depends on them, and quality, where one does."""

from __future__ import annotations

from collections.abc import Sequence
from statistics import fmean
from typing import NamedTuple

import numpy as np

from benchmarks import child
from benchmarks.tricks import forms
from benchmarks.tricks.race import best_times

FRAMES = 6
"""Recorded frames, every other one, on which quality is measured."""


class Choice(NamedTuple):
    """A constant, `module.NAME`, with other values than its own, and what they are tried on."""

    constant: str
    values: tuple[float, ...]
    on: tuple[str, ...]


FILTRATIONS = forms.FILTRATIONS
BALL = ("filtration, ball",)

BY_TIME = (
    Choice("steps.filtration.persistence.POSITION_WEIGHT", (1.0, 2.0, 4.0, 8.0, 16.0), FILTRATIONS),
    Choice("steps.filtration.persistence.WAITING_LIMIT", (1, 2, 4, 16), FILTRATIONS),
    Choice("steps.filtration.persistence.VOLUME_POSITION_WEIGHT", (1.0, 2.0, 4.0, 8.0), BALL),
    Choice("steps.filtration.persistence.SWEEPS", (1, 3, 6, 9), BALL),
    Choice("steps.filtration.persistence.SPARE_EDGES", (1, 4, 16), FILTRATIONS),
    Choice("steps.filtration.persistence.STALE_SHARE", (0.0001, 0.001, 0.01, 0.1, 1.0), FILTRATIONS),
    Choice("steps.filtration.pair_queue.BUCKET_SHIFT", (51, 52, 53), FILTRATIONS),
    Choice("compiled.kd_tree.SAMPLE", (4, 8, 16, 32), ("tree", *FILTRATIONS)),
    Choice("steps.normals.neighborhoods.CHUNK", (64, 256, 512, 1024), ("normals",)),
    Choice("beyond.objects.curvature.CHUNK", (64, 256, 512, 1024), ("grooves",)),
)
BY_CLOCK = (Choice("steps.filtration.persistence.PAIRS_FOR_MORE", (500, 2_000, 4_000, 8_000, 1_000_000), FILTRATIONS),)
BY_QUALITY = (
    Choice("steps.small_regions.settle.CANDIDATES", (1, 4, 8, 16, 32), ("regions",)),
    Choice("steps.support.search.SAMPLE", (500, 1_000, 2_000, 4_000), ("regions",)),
    Choice("steps.normals.estimate.WIDEN", (1.0, 2.0, 3.0, 5.0), ("regions",)),
    Choice("beyond.objects.unite.TOLERANCE", (0.0, 0.05, 0.1, 0.2), ("objects",)),
    Choice("beyond.objects.uniting.ENOUGH", (5, 10, 20, 40), ("objects",)),
    Choice("beyond.objects.uniting.INDEPENDENT", (1.0, 5.0, 20.0, 80.0), ("objects",)),
    Choice("beyond.objects.unite.ACROSS", (0.0, 1.0, 3.0, 10.0), ("objects",)),
    Choice("beyond.supervoxels.patches.NEIGHBORS", (6, 8, 12, 16), ("supervoxels",)),
    Choice("beyond.supervoxels.patches.TURN", (15.0, 30.0, 60.0), ("supervoxels",)),
    Choice("beyond.supervoxels.patches.SMALLEST", (0.0, 0.0625, 0.25), ("supervoxels",)),
)
SHOWN = {"regions": ("wov", "fos", "fus"), "objects": ("wov", "fos", "fus"), "supervoxels": ("boundary_recall", "asa")}


def show(names: Sequence[str]) -> None:
    """Measure the constants whose names hold one of some words, or all."""

    def wanted(choices: Sequence[Choice]) -> list[Choice]:
        return [c for c in choices if not names or any(name.upper() in c.constant.upper() for name in names)]

    for choice in wanted(BY_TIME):
        _show_times(choice, by_clock=False)
    for choice in wanted(BY_CLOCK):
        _show_times(choice, by_clock=True)
    for choice in wanted(BY_QUALITY):
        _show_quality(choice)


def _show_times(choice: Choice, *, by_clock: bool) -> None:
    unit = "ms of the clock" if by_clock else "ms of processor time"
    print(f"{choice.constant}, {unit}", flush=True)
    found = best_times([("", {choice.constant: value}) for value in choice.values], choice.on, by_clock=by_clock)
    _print_rows(choice, [{stage: f"{times[stage]:.2f}" for stage in choice.on} for times in found])


def _show_quality(choice: Choice) -> None:
    (output,) = choice.on
    print(f"{choice.constant}, {output}", flush=True)
    rows = [
        child.call("tricks.constants", "quality_of", constant=choice.constant, value=value, output=output)
        for value in choice.values
    ]
    _print_rows(choice, [{name: f"{value:.4f}" for name, value in row.items()} for row in rows])


def _print_rows(choice: Choice, rows: Sequence[dict[str, str]]) -> None:
    columns = list(rows[0])
    print("  " + f"{'':>12}" + "".join(f"{name:>18}" for name in columns))
    for value, row in zip(choice.values, rows, strict=True):
        print("  " + f"{value:>12g}" + "".join(f"{row[name]:>18}" for name in columns), flush=True)


def quality_of(constant: str, value: float, output: str) -> dict[str, float]:
    """Return the mean measures of some frames with another value of a constant."""
    forms.take_on("", {constant: value})
    # Only now, as the kernels take up what they find when they are imported.
    from benchmarks.recordings import frames
    from topo_region_seg.offline.evaluation.measures import measure
    from topo_region_seg.params import Params
    from topo_region_seg.pipeline import Pipeline

    pipeline = Pipeline(Params(output=output))
    found = []
    for frame in frames()[:: max(1, len(frames()) // FRAMES)]:
        cloud = frame.cloud()
        valid = np.isfinite(cloud.xyz).all(axis=1)
        found.append(measure(frame.truth, pipeline.run(cloud).labels, valid, cloud.height, cloud.width))
    return {name: fmean(float(measures[name] or 0.0) for measures in found) for name in SHOWN[output]}
