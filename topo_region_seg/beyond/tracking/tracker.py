# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Labels that stay with their regions from one frame to the next."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.optimize import linear_sum_assignment
from scipy.spatial import cKDTree

from topo_region_seg.beyond.tracking.merges import joined_regions, parted
from topo_region_seg.beyond.tracking.steady_borders import centers, settled_labels, with_steady_borders
from topo_region_seg.clock import Clock
from topo_region_seg.data import Cloud, FloatArray, IntArray, LabelArray
from topo_region_seg.segmentation import Segmentation

MEMORY = 10
"""Frames for which a region that is not seen may still get its label back."""
REACH = 0.1
"""Farthest way of a region's center from where it is expected, if it overlaps nothing of what it was, metres."""
COLOR_REACH = 20.0
"""Largest difference of mean colors of such a region, CIE76 dE."""
LEAST_SIZE_RATIO = 0.5
"""Least ratio of the sizes of such a region."""
HOLD = 10
"""Frames in a row for which regions must have become one before they are taken for one."""
WAIT = 3
"""Frames in a row for which a point at the border of regions at rest must be in another one before it changes over."""
LEAST_OVERLAP = 0.1
"""Least intersection over union that is taken for a region's own."""
LIKENESS_WEIGHT = 0.2
"""What likeness (0 to 1) counts beside intersection over union (0 to 1)."""
SAMPLES = 5_000
"""Points of a cloud without image grid that are looked up in the cloud before."""


@dataclass
class _Track:
    """What is known of a region: where it was, how it moved and looked, and for how many frames it has been lost."""

    center: FloatArray
    step: FloatArray
    lab: FloatArray
    size: int
    lost: int = 0


@dataclass(frozen=True)
class _Seen:
    """The frame before, with its tracked labels."""

    labels: LabelArray
    cloud_xyz: npt.NDArray[np.floating[Any]]
    shape: tuple[int, int]
    xyz: FloatArray
    point_labels: LabelArray
    waited: npt.NDArray[np.uint8]
    """For how many frames in a row each point has been in another region than its label says."""
    stamp: float


class Tracker:
    """Gives the regions of consecutive frames steady labels; made for one stream, used from one thread at a time."""

    def __init__(
        self,
        *,
        overlap: bool = True,
        motion: bool = True,
        likeness: bool = True,
        memory: int = MEMORY,
        hold: int = HOLD,
        wait: int = WAIT,
    ) -> None:
        """Make a tracker; parts of what it goes by may be left out, to see what each brings.

        Parameters
        ----------
        overlap, motion, likeness : bool
            Whether it goes by intersection over union; by where the motion seen last would have brought a region,
            rather than by where it was; and by colors and sizes.
        memory, hold, wait : int
            MEMORY, HOLD and WAIT; 0 = not at all.
        """
        self._overlaps, self._moves, self._likens = overlap, motion, likeness
        self._memory, self._hold, self._wait = memory, hold, wait
        self.reset()

    def reset(self) -> None:
        """Forget all regions; labels count from 1 again."""
        self._tracks: dict[int, _Track] = {}
        self._seen: _Seen | None = None
        self._next = 1
        self._joined: dict[tuple[int, int], int] = {}
        self._waited = np.zeros(0, np.uint8)

    def follow(self, cloud: Cloud, seg: Segmentation, stamp: float) -> Segmentation:
        """Return `seg` with the labels that its regions had before; new ones get labels that were never used.

        Parameters
        ----------
        cloud : Cloud
            What `seg` was made of.
        seg : Segmentation
            The next frame. Its regions stay as they are, but for those that were several and have been one for up to
            HOLD frames: these are held apart where they were. Returned as it is, and all regions are forgotten, where
            ``seg.params.track_regions`` is off.
        stamp : float
            Time of the frame, seconds; if it is before that of the frame before, all regions are forgotten.
        """
        if not seg.params.track_regions:
            if self._seen is not None:
                self.reset()
            return seg
        clock = Clock()
        with clock("tracking"):
            if self._seen is not None and stamp < self._seen.stamp:
                self.reset()
            seg = self._steadied(cloud, seg)
            given = seg.regions.label.astype(np.int64)
            tracked = self._assign(cloud, seg)
            table = np.zeros(int(np.max(given, initial=0)) + 1, np.uint32)
            table[given] = tracked
            labels, bars = table[seg.labels], replace(seg.barcode, label=table[seg.barcode.label])
            self._remember(seg, tracked)
            self._seen = _Seen(
                labels, cloud.xyz, (cloud.height, cloud.width), bars.xyz, bars.label, self._waited, stamp
            )
        regions = replace(seg.regions, label=tracked)
        return replace(seg, labels=labels, regions=regions, barcode=bars, ms={**seg.ms, **clock.ms})

    def _steadied(self, cloud: Cloud, seg: Segmentation) -> Segmentation:
        """Return `seg` with what noise has joined parted, and borders at rest, as in the image of the frame before."""
        seen = self._seen
        self._waited = np.zeros(len(seg.labels), np.uint8)
        if seen is None or not cloud.organized or seen.shape != (cloud.height, cloud.width) or not len(seg.regions):
            return seg
        now, before = seg.barcode.label.astype(np.int64), seen.labels[seg.index].astype(np.int64)
        # Where a thing has gone, what is seen behind it has not joined it.
        way = cloud.xyz[seg.index] - seen.cloud_xyz[seg.index]
        before[~((way * way).sum(axis=1) <= seg.scale**2)] = 0
        held = self._held(joined_regions(now, before))
        region = parted(seg.barcode.xyz, now, before, held) if held else now - 1
        label = settled_labels(
            region, before, seg.barcode.xyz, centers(seen.point_labels.astype(np.int64), seen.xyz, self._next)
        )
        # Regions of several parts are in no table of one label each.
        raw = np.zeros(int(np.max(seg.regions.label)) + 1, np.uint32)
        raw[now[region >= 0]] = label[region[region >= 0]]
        raw[list(held)] = 0
        both = np.flatnonzero((seg.labels > 0) & (seen.labels > 0))
        found = raw[seg.labels[both]]
        off = both[(found > 0) & (found != seen.labels[both])]
        self._waited[off] = np.minimum(seen.waited[off], 254) + 1
        steady = with_steady_borders(region, before, label, self._waited[seg.index] < self._wait)
        return seg.divided(steady) if held or not np.array_equal(steady, region) else seg

    def _held(self, joined: dict[int, tuple[int, ...]]) -> dict[int, tuple[int, ...]]:
        """Return those of the joined regions, and of their parts, that are still held apart."""
        pairs = [(parts[0], part) for parts in joined.values() for part in parts[1:]]
        self._joined = {pair: self._joined.get(pair, 0) + 1 for pair in pairs}
        held = {
            region: (parts[0], *(part for part in parts[1:] if self._joined[parts[0], part] <= self._hold))
            for region, parts in joined.items()
        }
        return {region: parts for region, parts in held.items() if len(parts) > 1}

    def _assign(self, cloud: Cloud, seg: Segmentation) -> LabelArray:
        """Return the tracked label of every row of the table of regions."""
        table, known = seg.regions, np.array(sorted(self._tracks), np.int64)
        tracked = np.zeros(len(table), np.uint32)
        # Ties fall alike whatever labels the regions came with.
        order = np.lexsort((*table.centroid.T[::-1], -table.size))
        if len(known) and len(order):
            score = self._scores(cloud, seg, known)[order]
            rows, columns = linear_sum_assignment(score, maximize=True)
            good = score[rows, columns] > 0.0
            tracked[order[rows[good]]] = known[columns[good]]
        new = order[tracked[order] == 0]
        tracked[new] = np.arange(self._next, self._next + len(new))
        self._next += len(new)
        return tracked

    def _scores(self, cloud: Cloud, seg: Segmentation, known: IntArray) -> FloatArray:
        """Return how well each region (row) continues each known one (column); 0 where it cannot."""
        tracks, table = [self._tracks[label] for label in known.tolist()], seg.regions
        common, before = self._overlap(cloud, seg, known)
        if not self._overlaps:
            common = np.zeros_like(common)
        union = common.sum(axis=1, keepdims=True) + before - common
        # What of a region lies on nothing known is new ground, and counts to the union.
        iou = common / np.maximum(union, 1.0)
        place = np.array([t.center + t.step if self._moves else t.center for t in tracks])
        away = np.linalg.norm(table.centroid[:, None] - place, axis=2)
        color = np.nan_to_num(np.linalg.norm(table.mean_lab[:, None] - np.array([t.lab for t in tracks]), axis=2))
        size, old = table.size[:, None].astype(np.float64), np.array([t.size for t in tracks], np.float64)
        ratio = np.minimum(size, old) / np.maximum(size, old)
        if not self._likens:
            color, ratio = np.zeros_like(color), np.ones_like(ratio)
        alike = ratio * np.exp(-away / REACH - color / COLOR_REACH)
        near = (away <= REACH) & (color <= COLOR_REACH) & (ratio >= LEAST_SIZE_RATIO)
        return np.where((iou >= LEAST_OVERLAP) | near, iou + LIKENESS_WEIGHT * alike, 0.0)

    def _overlap(self, cloud: Cloud, seg: Segmentation, known: IntArray) -> tuple[FloatArray, FloatArray]:
        """Return common points of regions and known ones, a column for none left out, and the points of those."""
        seen = self._seen
        assert seen is not None
        if cloud.organized and seen.shape == (cloud.height, cloud.width):
            somewhere = np.flatnonzero(seg.labels | seen.labels)
            now, old = seg.labels[somewhere], seen.labels[somewhere]
        else:
            every = max(1, len(seg.barcode) // SAMPLES)
            now = seg.barcode.label[::every]
            old = np.zeros(len(now), np.uint32)
            if len(seen.xyz) and len(now):
                reach = max(2.0 * seg.params.voxel_size, seg.components.max_radius)
                _, place = cKDTree(seen.xyz).query(seg.barcode.xyz[::every], distance_upper_bound=reach)
                old = np.append(seen.point_labels, np.uint32(0))[place]
        row = np.zeros(int(np.max(seg.regions.label)) + 1, np.int32)
        row[seg.regions.label] = np.arange(1, len(seg.regions) + 1)
        column = np.zeros(self._next, np.int32)
        column[known] = np.arange(1, len(known) + 1)
        n_columns = len(known) + 1
        pairs = row[now] * np.int32(n_columns) + column[old]
        counts = np.bincount(pairs, minlength=(len(seg.regions) + 1) * n_columns).reshape(-1, n_columns)
        return counts[1:, 1:].astype(np.float64), counts[:, 1:].sum(axis=0).astype(np.float64)

    def _remember(self, seg: Segmentation, tracked: LabelArray) -> None:
        table = seg.regions
        for track in self._tracks.values():
            track.lost += 1
        for row, label in enumerate(tracked.tolist()):
            old, center = self._tracks.get(label), table.centroid[row]
            step = (center - old.center) / old.lost if old is not None else np.zeros(3)
            self._tracks[label] = _Track(center, step, table.mean_lab[row], int(table.size[row]))
        self._tracks = {label: track for label, track in self._tracks.items() if track.lost <= self._memory}
