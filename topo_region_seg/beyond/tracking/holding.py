# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Regions that were apart stay apart, and borders at rest stay where they are, until the change is more than noise."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from topo_region_seg.beyond.tracking.merges import joined_regions, parted
from topo_region_seg.beyond.tracking.overlap import Seen, seen_in
from topo_region_seg.beyond.tracking.steady_borders import centers, regions_at_rest, with_steady_borders
from topo_region_seg.data import Cloud, IntArray
from topo_region_seg.segmentation import Segmentation

HOLD = 10
"""Frames in a row for which regions must have become one before they are taken for one."""
WAIT = 3
"""Frames in a row for which a point at the border of regions at rest must be in another one before it changes over."""


class Holding:
    """Steadies the regions of the consecutive images of one stream."""

    def __init__(self) -> None:
        self._joined: dict[tuple[int, int], int] = {}
        self._waited = np.zeros(0, np.uint8)

    def steadied(self, cloud: Cloud, seg: Segmentation, seen: Seen) -> Segmentation:
        """Return `seg` with the regions that noise has joined parted again, and with the resting borders of `seen`.

        Parameters
        ----------
        cloud : Cloud
            What `seg` was made of; organized.
        seg : Segmentation
            The frame.
        seen : Seen
            The frame before, an image of the same size.
        """
        waited = self._waited if len(self._waited) == len(cloud) else np.zeros(len(cloud), np.uint8)
        self._waited = np.zeros(len(cloud), np.uint8)
        if not len(seg.regions):
            return seg
        here = seen_in(cloud, seg)
        now, before = here.point_row.astype(np.int64), seen.row[seg.index].astype(np.int64)
        # Where a thing has gone, what is seen behind it has not joined it.
        way = cloud.xyz[seg.index] - seen.cloud_xyz[seg.index]
        before[~((way * way).sum(axis=1) <= seg.scale**2)] = 0
        held = self._held(joined_regions(now, before), seen)
        region = parted(seg.points, now, before, held) if held else now - 1
        former = regions_at_rest(region, before, seg.points, centers(seen.point_row, seen.xyz, len(seen.label) + 1))
        # A region of several parts goes on with none.
        whole = np.zeros(len(seg.regions) + 1, np.int64)
        whole[now[region >= 0]] = former[region[region >= 0]]
        whole[list(held)] = 0
        both = np.flatnonzero((here.row > 0) & (seen.row > 0))
        found = whole[here.row[both]]
        off = both[(found > 0) & (found != seen.row[both])]
        self._waited[off] = np.minimum(waited[off], 254) + 1
        steady = with_steady_borders(region, before, former, self._waited[seg.index] < WAIT)
        if not held and np.array_equal(steady, region):
            return seg
        return replace(seg.divided(steady), notices=seg.notices)

    def _held(self, joined: dict[int, tuple[int, ...]], seen: Seen) -> dict[int, tuple[int, ...]]:
        """Return those of the joined regions, and of their parts, that are still held apart."""
        label: IntArray = np.append(0, seen.label)
        pairs = {
            (parts[0], part): (int(label[parts[0]]), int(label[part]))
            for parts in joined.values()
            for part in parts[1:]
        }
        self._joined = {pair: self._joined.get(pair, 0) + 1 for pair in pairs.values()}
        held = {
            region: (parts[0], *(part for part in parts[1:] if self._joined[pairs[parts[0], part]] <= HOLD))
            for region, parts in joined.items()
        }
        return {region: parts for region, parts in held.items() if len(parts) > 1}
