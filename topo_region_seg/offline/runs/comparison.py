# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Two runs of the same recording, frame by frame: what changed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from topo_region_seg.data import BoolArray, IntArray, LabelArray
from topo_region_seg.offline.evaluation.measures import FIRST_OBJECT, Measures, measure
from topo_region_seg.offline.runs.pairing import StampCounts
from topo_region_seg.offline.runs.run import Run, RunFrame
from topo_region_seg.offline.runs.truth import RunTruth, quality
from topo_region_seg.offline.stamps import ordinals


@dataclass(frozen=True)
class FrameChange:
    """What changed in one frame from run A to run B.

    Parameters
    ----------
    stamp : float
        Seconds.
    index : tuple of int
        Its index in A and in B.
    regions : tuple of int
        Number of regions in A and in B.
    wov, ari : float or None
        Weighted overlap of the regions of A with those of B, and the adjusted Rand index of the two on the points of
        regions of A; 1 if they are the same, None if the clouds differ in size.
    changed : float or None
        Share of the valid points whose regions in the two runs are not counterparts.
    ms, cpu_ms : dict of str to (float or None, float or None)
        Milliseconds per stage, and `total`; the same of CPU time.
    quality : tuple of Measures or None
        Quality of A and of B, where the truth is known.
    """

    stamp: float
    index: tuple[int, int]
    regions: tuple[int, int]
    wov: float | None
    ari: float | None
    changed: float | None
    ms: dict[str, tuple[float | None, float | None]]
    quality: tuple[Measures | None, Measures | None]
    cpu_ms: dict[str, tuple[float | None, float | None]] = field(default_factory=dict)

    @property
    def region_change(self) -> int:
        """Regions of B minus those of A."""
        return self.regions[1] - self.regions[0]


@dataclass
class Comparison:
    """All frames of two runs.

    Parameters
    ----------
    frames : list of FrameChange
        Those of both runs.
    only_a, only_b : list of float
        Stamps (s) of frames without a counterpart.
    unpaired : list of float
        Those of them that repeat: which frame of A belongs to which of B is not known.
    """

    frames: list[FrameChange] = field(default_factory=list)
    only_a: list[float] = field(default_factory=list)
    only_b: list[float] = field(default_factory=list)
    unpaired: list[float] = field(default_factory=list)

    def most_changed(self, count: int) -> list[FrameChange]:
        """Return the frames that changed most: by the points that changed, then by the number of regions."""

        def weight(frame: FrameChange) -> tuple[float, int]:
            return (np.inf if frame.changed is None else frame.changed), abs(frame.region_change)

        ranked = sorted(self.frames, key=weight, reverse=True)
        return [frame for frame in ranked if weight(frame) > (0.0, 0)][:count]


def compare(
    a: Run, b: Run, truth: RunTruth | None = None, step: Callable[[str], None] = lambda text: None
) -> Comparison:
    """Compare two runs, frame by frame as :func:`matched` pairs them.

    Parameters
    ----------
    a, b : Run
        The runs.
    truth : RunTruth, optional
        True labels of the frames of A.
    step : callable
        Called after each pair.
    """
    result = Comparison()
    pairs, result.unpaired = matched(a, b)
    partners = {of_b: of_a for of_a, of_b in pairs}
    waiting: dict[int, RunFrame] = {}
    frames_a = a.frames(set(partners.values()))
    for frame in b.frames(partners):
        # Both runs keep the order of the recording, so usually at most one frame waits.
        partner = partners[frame.index]
        while partner not in waiting and (read := next(frames_a, None)):
            waiting[read.index] = read
        if partner in waiting:
            result.frames.append(_change(waiting.pop(partner), frame, truth))
            step(f"{frame.record.stamp:.3f} s")
    result.frames.sort(key=lambda frame: frame.index)
    seen_a, seen_b = {frame.index[0] for frame in result.frames}, {frame.index[1] for frame in result.frames}
    result.only_a = [frame.stamp for index, frame in enumerate(a.record.frames) if index not in seen_a]
    result.only_b = [frame.stamp for index, frame in enumerate(b.record.frames) if index not in seen_b]
    return result


def matched(a: Run, b: Run) -> tuple[list[tuple[int, int]], list[float]]:
    """Pair the frames of equal stamps; where a stamp repeats, the first with the first, the second with the second.

    Returns
    -------
    pairs : list of (int, int)
        Indices in A and B.
    unpaired : list of float
        Repeated stamps (s) of which one of the runs has more clouds than the other or has rejected some, so that the
        order does not say which frames belong together.
    """
    of_a, of_b = (ordinals(frame.stamp for frame in run.record.frames) for run in (a, b))
    counts_a, counts_b = StampCounts(a.record), StampCounts(b.record)

    def known(stamp: float) -> bool:
        clouds = counts_a.clouds(stamp), counts_b.clouds(stamp)
        return max(clouds) == 1 or (clouds[0] == clouds[1] and counts_a.ordered(stamp) and counts_b.ordered(stamp))

    places = {key: index for index, key in enumerate(of_b)}
    common = sorted({stamp for stamp, _ in of_a} & {stamp for stamp, _ in of_b})
    unpaired = [stamp for stamp in common if not known(stamp)]
    left_out = set(unpaired)
    pairs = [(index, places[key]) for index, key in enumerate(of_a) if key in places and key[0] not in left_out]
    return pairs, unpaired


def changed_points(a: LabelArray, b: LabelArray) -> BoolArray:
    """Return which points changed their region, (N,).

    A point has changed unless its regions in A and B are counterparts: each covers most of the other. "No region" is
    its own counterpart.
    """
    pairs, where, count = np.unique(a.astype(np.uint64) << np.uint64(32) | b, return_inverse=True, return_counts=True)
    of_a, of_b = pairs >> np.uint64(32), pairs & np.uint64(0xFFFFFFFF)
    same = _largest(of_a, count) & _largest(of_b, count) & (of_a > 0) & (of_b > 0)
    same |= (of_a == 0) & (of_b == 0)
    changed: BoolArray = ~same[where.reshape(-1)]
    return changed


def _largest(group: npt.NDArray[np.uint64], count: IntArray) -> BoolArray:
    """Return which rows have the largest count of their group; of equal counts, the first."""
    order = np.lexsort((-np.arange(len(group)), count, group))
    last = order[np.append(group[order][1:] != group[order][:-1], True)] if len(group) else order
    largest = np.zeros(len(group), np.bool_)
    largest[last] = True
    return largest


def _change(a: RunFrame, b: RunFrame, truth: RunTruth | None) -> FrameChange:
    wov = ari = changed = None
    if len(a.labels) == len(b.labels):
        wov, ari, changed = _agreement(a.labels, b.labels, a.valid)
    true_labels = truth.of(a) if truth else None
    return FrameChange(
        stamp=a.record.stamp,
        index=(a.index, b.index),
        regions=(a.record.regions, b.record.regions),
        wov=wov,
        ari=ari,
        changed=changed,
        ms=_paired(a.record.ms, b.record.ms),
        cpu_ms=_paired(a.record.cpu_ms, b.record.cpu_ms),
        quality=(_quality(a, true_labels, truth), _quality(b, true_labels, truth)),
    )


def _paired(a: dict[str, float], b: dict[str, float]) -> dict[str, tuple[float | None, float | None]]:
    return {stage: (a.get(stage), b.get(stage)) for stage in dict.fromkeys([*a, *b])}


def _quality(frame: RunFrame, true_labels: LabelArray | None, truth: RunTruth | None) -> Measures | None:
    return quality(frame, true_labels, truth.reading) if truth else None


def _agreement(a: LabelArray, b: LabelArray, valid: BoolArray) -> tuple[float, float, float]:
    a, b = a[valid], b[valid]
    if np.array_equal(a, b) or not len(a):
        return 1.0, 1.0, 0.0
    changed = float(changed_points(a, b).mean())
    # For the measures, true segments begin at FIRST_OBJECT.
    found = measure(np.where(a > 0, a + np.uint32(FIRST_OBJECT - 1), np.uint32(0)), b, np.ones(len(a), np.bool_))
    wov, ari = found["wov"], found["ari"]
    return (0.0, 0.0, changed) if wov is None or ari is None else (wov, ari, changed)
