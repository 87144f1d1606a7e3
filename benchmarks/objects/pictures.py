# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Pictures of the frames that go wrong: colors, what was found, what became of the points, and the truth."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from benchmarks.objects.datasets import data_sets
from benchmarks.objects.programs import OURS
from benchmarks.objects.tables import LOW, Found
from topo_region_seg.data import PointClass
from topo_region_seg.offline.evaluation.measures import FIRST_OBJECT
from topo_region_seg.offline.figures.shading import own_colors, region_colors
from topo_region_seg.params import Params
from topo_region_seg.pipeline import Pipeline

CLASSES = {
    PointClass.NOTHING: (0, 0, 0),
    PointClass.SUPPORT: (90, 120, 200),
    PointClass.BEHIND: (40, 60, 110),
    PointClass.STRUCTURE: (90, 170, 110),
    PointClass.LABELED: (235, 235, 235),
    PointClass.UNSURE: (230, 120, 50),
    PointClass.LOOSE: (200, 60, 160),
}
"""Colors, sRGB, of what became of points."""
KEY = "blue support, dark behind it, green structure, white labeled, orange unsure, pink loose"


def draw_low(found: Found, params: Params, folder: Path) -> Iterator[Path]:
    """Draw every frame with a weighted overlap below LOW into a folder; yields the files."""
    folder.mkdir(parents=True, exist_ok=True)
    for data_set, frames in found.items():
        for name, programs in frames.items():
            overlap = programs[OURS]["wov"]
            if overlap is None or overlap >= LOW:
                continue
            path = folder / f"{data_set}-{name.replace(', ', '-').replace(' ', '_')}.png"
            _draw(data_set, name, overlap, params, path)
            yield path


def _draw(data_set: str, name: str, overlap: float, params: Params, path: Path) -> None:
    sample = data_sets()[data_set].load(name)
    cloud, own = sample.cloud, own_colors(sample.cloud)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        seg = Pipeline(params).run(cloud)
    color_of = np.array([CLASSES[PointClass(number)] for number in range(len(PointClass))], np.uint8)
    truth = np.where(sample.truth >= FIRST_OBJECT, sample.truth - FIRST_OBJECT + 1, 0).astype(np.uint32)
    panels = {
        f"{name}, {sample.kind}": own,
        f"found, WOv {overlap:.2f}": region_colors(own, seg.labels),
        KEY: color_of[seg.point_classes],
        "truth": region_colors(own, truth),
    }
    figure = Figure(figsize=(20, 4.0), dpi=80, facecolor="white")
    for axes, (title, panel) in zip(figure.subplots(1, len(panels)), panels.items(), strict=True):
        axes.imshow(panel.reshape(cloud.height, cloud.width, 3))
        axes.set_title(title, fontsize=8)
        axes.set_axis_off()
    figure.subplots_adjust(left=0.005, right=0.995, bottom=0.01, top=0.92, wspace=0.02)
    figure.savefig(path)
