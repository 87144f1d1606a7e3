# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Whether regions keep their labels over the frames of a recording: IDF1, label switches, flicker.

IDF1 is that of multiple object tracking: Ristani, Solera, Zou, Cucchiara and Tomasi, "Performance Measures and a Data
Set for Multi-Target, Multi-Camera Tracking", 2016. Label switches are those of Bernardin and Stiefelhagen, "Evaluating
Multiple Object Tracking Performance: The CLEAR MOT Metrics", 2008. As in MOTS (Voigtlaender et al. 2019), a region is a
hit of a true segment if their intersection over union is above one half, so that nothing has to be chosen in a frame.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from topo_region_seg.data import BoolArray, LabelArray
from topo_region_seg.offline.evaluation.contingency import contingency
from topo_region_seg.offline.evaluation.detection import best_pairs, detect
from topo_region_seg.offline.evaluation.measures import FIRST_OBJECT, Measures, TruthReading

IDENTITY = ("idf1", "id_precision", "id_recall", "switches", "hits", "flicker")
"""The names of the measures, in the order in which they are shown."""


@dataclass(frozen=True)
class Identity:
    """What was counted over the frames of one recording, or of several.

    Parameters
    ----------
    right : int
        Hits of segments by the label that is assigned to them: assigned one to one, so that they are most.
    segments : int
        True segments of all frames.
    regions : int or None
        Regions of all frames that are right or false; None where that is not known, as not all objects have truth.
    hits : int
        Segments of all frames that a region hits.
    switches : int
        Of those, the ones with another label than at their last hit.
    kept, changed : int
        Points of the same true label in two consecutive frames, with a region in both; those of them whose region has
        another label than before.
    """

    right: int = 0
    segments: int = 0
    regions: int | None = 0
    hits: int = 0
    switches: int = 0
    kept: int = 0
    changed: int = 0

    def measures(self) -> Measures:
        """Return a value for each of IDENTITY; None where there was nothing to measure."""
        both = None if self.regions is None else self.regions + self.segments
        return {
            "idf1": 2.0 * self.right / both if both and self.segments else None,
            "id_precision": self.right / self.regions if self.regions and self.segments else None,
            "id_recall": self.right / self.segments if self.segments else None,
            "switches": self.switches,
            "hits": self.hits,
            "flicker": self.changed / self.kept if self.kept else None,
        }


def summed(found: Iterable[Identity | None]) -> Identity | None:
    """Return the counts of several recordings, each with trajectories of its own; None where none has any."""
    some = [one for one in found if one is not None]
    if not some:
        return None
    counts = [asdict(one) for one in some]
    sums: dict[str, Any] = {name: sum(count[name] or 0 for count in counts) for name in counts[0]}
    return Identity(**{**sums, "regions": None if any(one.regions is None for one in some) else sums["regions"]})


class IdentityMeter:
    """Follows the segments of a recording over its frames.

    Parameters
    ----------
    reading : TruthReading
        What true labels mean.
    """

    def __init__(self, reading: TruthReading) -> None:
        self._reading = reading
        self._together: Counter[tuple[int, int]] = Counter()
        self._last: dict[int, int] = {}
        self._segments = self._regions = self._switches = self._kept = self._changed = 0
        self._before: tuple[LabelArray, LabelArray, tuple[int, int]] | None = None

    def add(self, truth: LabelArray, labels: LabelArray, valid: BoolArray, height: int, width: int) -> None:
        """Count one frame, the next one of the recording; arguments are those of :func:`measure`."""
        truth = self._reading.segments(truth)
        found = detect(contingency(truth[valid], labels[valid]), FIRST_OBJECT)
        self._segments += int(np.count_nonzero(found.is_object))
        self._regions += int(np.count_nonzero(found.reported))
        for segment, label in zip(*(column.tolist() for column in found.hits()), strict=True):
            self._together[segment, label] += 1
            self._switches += self._last.get(segment, label) != label
            self._last[segment] = label
        known, own = np.where(valid, truth, np.uint32(0)), np.where(valid, labels, np.uint32(0))
        if self._before is not None and height > 1 and self._before[2] == (height, width):
            true_before, own_before, _ = self._before
            same = (known > 0) & (known == true_before) & (own > 0) & (own_before > 0)
            self._kept += int(np.count_nonzero(same))
            self._changed += int(np.count_nonzero(own[same] != own_before[same]))
        self._before = known, own, (height, width)

    def identity(self) -> Identity:
        """Return what was counted so far."""
        pairs = np.array(list(self._together), np.int64).reshape(-1, 2)
        count = np.array(list(self._together.values()), np.int64)
        segment, label = (np.unique(column, return_inverse=True)[1] for column in pairs.T)
        right = int(count[best_pairs(segment, label, count.astype(np.float64))].sum())
        regions = None if self._reading.partial else self._regions
        hits = int(count.sum())
        return Identity(right, self._segments, regions, hits, self._switches, self._kept, self._changed)
