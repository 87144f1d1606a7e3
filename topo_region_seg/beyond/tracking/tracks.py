# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The regions in memory: those in sight, and for some frames those that are not."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from topo_region_seg.cloud.placing import Transform
from topo_region_seg.data import BoolArray, FloatArray, IntArray, LabelArray, RegionTable

MEMORY = 10
"""Frames for which a region that is not seen may still get its label back."""


@dataclass(frozen=True)
class Tracks:
    """What is known of T regions: first those of the frame before, in the order of its table, then the lost ones.

    Parameters
    ----------
    label : (T,) uint32
        Their labels.
    center : (T, 3) float64
        Where they were seen last, metres.
    step : (T, 3) float64
        How far they moved from one frame to the next, metres; zeros for those seen in one frame only.
    lab : (T, 3) float64
        Their mean color, CIELAB; NaN without color.
    lost : (T,) int64
        For how many frames they have not been seen.
    """

    label: LabelArray
    center: FloatArray
    step: FloatArray
    lab: FloatArray
    lost: IntArray

    @classmethod
    def none(cls) -> Tracks:
        """Return the memory of a stream that has not begun."""
        points, counts = np.zeros((0, 3)), np.zeros(0, np.int64)
        return cls(np.zeros(0, np.uint32), points, points, points, counts)

    def __len__(self) -> int:
        return len(self.label)

    def expected_centers(self) -> FloatArray:
        """Return where to look for the regions, (T, 3): those in sight a step farther, lost ones where they were."""
        return self.center + np.where(self.lost[:, None] > 0, 0.0, self.step)

    def moved(self, motion: Transform) -> Tracks:
        """Return the regions in the frame of another cloud."""
        center = self.center @ motion.rotation.T + motion.position
        return replace(self, center=center, step=self.step @ motion.rotation.T)

    def rows(self, chosen: BoolArray | IntArray | slice) -> Tracks:
        """Return some of the regions."""
        return Tracks(
            self.label[chosen],
            self.center[chosen],
            self.step[chosen],
            self.lab[chosen],
            self.lost[chosen],
        )

    def seen(self, table: RegionTable, label: LabelArray, match: IntArray) -> Tracks:
        """Return the regions of a frame (R,) with the labels they got; `match` is the row of each here, -1 for none."""
        known = match >= 0
        old = match[known]
        step = np.zeros((len(table), 3))
        step[known] = (table.centroid[known] - self.center[old]) / (self.lost[old, None] + 1)
        return Tracks(label, table.centroid, step, table.mean_lab, np.zeros(len(table), np.int64))

    def lost_since(self, match: IntArray) -> Tracks:
        """Return the regions that none of a frame's is matched with, those lost for longest first, then by label."""
        missed = np.ones(len(self), np.bool_)
        missed[match[match >= 0]] = False
        chosen = np.flatnonzero(missed)
        lost = self.rows(chosen[np.lexsort((self.label[chosen], -self.lost[chosen]))])
        return replace(lost, lost=lost.lost + 1)

    def joined(self, other: Tracks) -> Tracks:
        """Return these regions and then the others."""
        if not len(other):
            return self
        pairs = zip(vars(self).values(), vars(other).values(), strict=True)
        return Tracks(*(np.concatenate(pair) for pair in pairs))
