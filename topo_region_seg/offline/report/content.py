# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The content of the page, gathered from a run in one pass and limited in size."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from topo_region_seg.data import IntArray, LabelArray
from topo_region_seg.growth import growth_of_output
from topo_region_seg.offline.evaluation.measures import FIRST_OBJECT, Measures
from topo_region_seg.offline.figures.projection import picture_of
from topo_region_seg.offline.figures.shading import own_colors, region_colors
from topo_region_seg.offline.frames import FrameResult
from topo_region_seg.offline.report.bars import summarized
from topo_region_seg.offline.report.pictures import data_uri, outlined, paint, small_view
from topo_region_seg.offline.report.points import BYTES_A_POINT, packed_points
from topo_region_seg.offline.runs.barcodes import Bars
from topo_region_seg.offline.runs.run import Run, RunFrame
from topo_region_seg.offline.runs.truth import RunTruth, quality

PICTURE_BYTES = 5_500_000
"""Of all pictures together, as encoded in the page."""
POINT_BYTES = 3_000_000
"""Of all points of the 3D view together."""
MOST_PICTURED = 200
MOST_POINTS = 30_000
LARGEST_PICTURE = 60_000
_SIDES = (480, 400, 320, 240)
_LEGIBLE = 9_000  # bytes that a picture of the largest size needs for good quality


@dataclass
class FrameContent:
    """The content of one frame; `pictures` are pairs of a caption and a data URI."""

    index: int
    record: FrameResult
    frame_id: str = ""
    quality: Measures | None = None
    pictures: list[tuple[str, str]] = field(default_factory=list)
    points: dict[str, Any] | None = None
    bars: dict[str, Any] | None = None


def points_a_frame(chosen: int) -> int:
    """Return how many points each of the chosen frames may have in 3D."""
    return min(MOST_POINTS, POINT_BYTES * 3 // 4 // (BYTES_A_POINT * max(1, chosen)))  # base64 takes 4 for 3


def evenly(count: int, most: int) -> list[int]:
    """Return up to `most` of the indices 0..count - 1, evenly spread, including the first and the last."""
    return np.unique(np.round(np.linspace(0, count - 1, min(count, most))).astype(int)).tolist() if count else []


def gather(
    run: Run,
    truth: RunTruth | None,
    chosen: Collection[int],
    barcodes: Mapping[int, Bars],
    step: Callable[[str], None] = lambda text: None,
) -> list[FrameContent]:
    """Return the content of every frame of a run; `step` is called after each.

    Parameters
    ----------
    run : Run
        The run.
    truth : RunTruth or None
        True labels of its clouds.
    chosen : collection of int
        Indices of the frames shown in 3D.
    barcodes : mapping of int to Bars
        Barcodes by index.
    step : callable
        For a progress bar.
    """
    frames = [FrameContent(index, record) for index, record in enumerate(run.record.frames)]
    pictured = {*evenly(len(frames), MOST_PICTURED), *chosen}
    budget = min(LARGEST_PICTURE, PICTURE_BYTES // max(1, len(pictured) * (3 if truth else 2)))
    most_points = points_a_frame(len(chosen))
    for given in run.frames():
        content = frames[given.index]
        true_labels = truth.of(given) if truth else None
        content.quality = quality(given, true_labels, truth.reading) if truth else None
        content.frame_id = str(given.msg.header.frame_id)
        if given.index in pictured:
            alike = None if content.quality is None or true_labels is None else in_region_colors(given, true_labels)
            own = own_colors(given.cloud)
            content.pictures = _pictures(given, own, true_labels, alike, budget)
            if given.index in chosen:
                content.points = packed_points(given.cloud, own, given.labels, alike, most_points)
        step(f"frame {given.index}")
    for index, bars in barcodes.items():
        frames[index].bars = summarized(bars, growth_of_output(run.params).max_radius)
    return frames


def in_region_colors(frame: RunFrame, truth: LabelArray) -> LabelArray:
    """Return the region that covers most of the true object of every point, (N,) uint32; 0 outside of objects."""
    objects = frame.valid & (truth >= FIRST_OBJECT)
    covering = np.zeros(len(truth), np.uint32)
    for segment in np.unique(truth[objects]):
        rows = objects & (truth == segment)
        label, count = np.unique(frame.labels[rows], return_counts=True)
        count[label == 0] = 0
        covering[rows] = label[np.argmax(count)] if count.any() else 0
    return covering


def _pictures(
    frame: RunFrame, own: Any, truth: LabelArray | None, alike: LabelArray | None, budget: int
) -> list[tuple[str, str]]:
    view = _view(frame, budget)
    shown = [("input", outlined(paint(own, view), np.zeros(len(own), np.uint32), view))]
    if alike is not None and truth is not None:
        segments = np.where(frame.valid & (truth >= FIRST_OBJECT), truth, np.uint32(0))
        shown.append(("truth", outlined(paint(region_colors(own, alike), view), segments, view)))
    shown.insert(1, ("regions", outlined(paint(region_colors(own, frame.labels), view), frame.labels, view)))
    return [(name, data_uri(image, budget)) for name, image in shown]


def _view(frame: RunFrame, budget: int) -> IntArray:
    wanted = _SIDES[0] * (budget / _LEGIBLE) ** 0.5
    side = next((side for side in _SIDES if side <= wanted), _SIDES[-1])
    return small_view(picture_of(frame.cloud), side)


def stages(frames: Sequence[FrameContent]) -> list[str]:
    """Return the names of the timed stages in order, without the total."""
    names = {name: None for frame in frames for name in frame.record.ms}
    return [name for name in names if name != "total"]
