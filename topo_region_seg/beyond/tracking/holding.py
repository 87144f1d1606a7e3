# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Regions that were apart stay apart, and borders at rest stay where they are, until the change is more than noise."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import numpy.typing as npt

from topo_region_seg.beyond.tracking.merges import joined_regions, parted
from topo_region_seg.beyond.tracking.motion import EVERY, Place
from topo_region_seg.beyond.tracking.overlap import Seen, nearest_before, seen_in
from topo_region_seg.beyond.tracking.steady_borders import centers, regions_at_rest, split_off, with_steady_borders
from topo_region_seg.data import Cloud, FloatArray, IntArray
from topo_region_seg.segmentation import Segmentation

HOLD = 10
"""Frames in a row for which regions must have become one before they are taken for one."""
APART = 5
"""Frames in a row for which a part of a region at rest must have been off it before it is taken for one of its own."""
WAIT = 3
"""Frames in a row for which a point at the border of regions at rest must be in another one before it changes over."""

SAME_VIEW = 0.5
"""Share of the labeled points that must lie where labeled points were in the frame before: else the camera has gone
elsewhere, and nothing is held."""


Counted = tuple[IntArray, npt.NDArray[np.int32], npt.NDArray[np.int32], npt.NDArray[np.uint8]]
"""Rows in the table of the preprocessed points (N,); rows of all pixels, or again of the points, (P,), now and before,
and for how many frames each has been in a part that came off its region."""


class Holding:
    """Steadies the regions of the consecutive images of one stream."""

    def __init__(self) -> None:
        self._joined: dict[tuple[int, int], int] = {}
        self._off = self._waited, self._apart = np.zeros(0, np.uint8), np.zeros(0, np.uint8)

    def steadied(self, cloud: Cloud, seg: Segmentation, seen: Seen, pixel: Place = EVERY) -> Segmentation:
        """Return `seg` with the regions that noise has joined parted again, and with the resting borders of `seen`.

        Parameters
        ----------
        cloud : Cloud
            What `seg` was made of.
        seg : Segmentation
            The frame.
        seen : Seen
            The frame before; an image of the same size if `cloud` is one.
        pixel : (N,) int64 or slice
            Where each pixel of an image was in the frame before, if the camera has moved.
        """
        here = seen_in(cloud, seg)
        if cloud.organized:
            rows, own, former_row = here.row, seg.index, seen.row
            place: Place = pixel
            # Where a thing has gone, what is seen behind it has not joined it.
            way = cloud.xyz[own] - seen.cloud_xyz[own]
            near = (way * way).sum(axis=1) <= seg.scale**2
        else:
            rows, own = here.point_row, np.arange(len(here.point_row))
            place, near = nearest_before(here.xyz, seen.xyz, seg.scale)
            former_row = np.append(seen.point_row, np.int32(0))[place]
        waited, apart = (_carried(count, len(seen.row if cloud.organized else seen.xyz), place) for count in self._off)
        self._off = self._waited, self._apart = np.zeros(len(rows), np.uint8), np.zeros(len(rows), np.uint8)
        if not len(seg.regions):
            return seg
        now, before = here.point_row.astype(np.int64), former_row[own].astype(np.int64)
        before[~near] = 0
        if np.count_nonzero(before[now > 0]) < SAME_VIEW * np.count_nonzero(now):
            return seg
        held = self._held(joined_regions(now, before), seen)
        region = parted(seg.points, now, before, held) if held else now - 1
        center = centers(seen.point_row, seen.xyz, len(seen.label) + 1)
        region = self._whole_again(region, before, seg.points, center, (now, rows, former_row, apart))
        former = regions_at_rest(region, before, seg.points, center)
        # A region of several parts goes on with none.
        whole = np.zeros(len(seg.regions) + 1, np.int64)
        whole[now[region >= 0]] = former[region[region >= 0]]
        whole[list(held)] = 0
        both = np.flatnonzero((rows > 0) & (former_row > 0))
        found = whole[rows[both]]
        off = both[(found > 0) & (found != former_row[both])]
        self._waited[off] = np.minimum(waited[off], 254) + 1
        steady = with_steady_borders(region, before, former, self._waited[own] < WAIT)
        if np.array_equal(steady, now - 1):
            return seg
        return replace(seg.divided(steady), notices=seg.notices)

    def _whole_again(
        self, region: IntArray, before: IntArray, xyz: FloatArray, center: FloatArray, counted: Counted
    ) -> IntArray:
        """Return the regions (N,) with the parts that have just come off regions at rest put back.

        `before`, `xyz` and `center` are as for `regions_at_rest`.
        """
        now, rows, former_row, apart = counted
        main, home = split_off(region, before, int(np.max(region, initial=-1)) + 1)
        whole = np.where(main >= 0, main, np.arange(len(main)))
        together = np.where(region >= 0, whole[region], -1)
        # Of a region that loses a part the center moves; of what was one region it does not.
        at_rest = regions_at_rest(together, before, xyz, center) > 0
        parts = np.flatnonzero((main >= 0) & at_rest[whole])
        if not len(parts):
            return region
        row_of = np.zeros(len(main), np.int64)
        row_of[region[region >= 0]] = now[region >= 0]
        came_off = np.full(int(np.max(rows)) + 1, -1)
        came_off[row_of[parts]] = home[parts]
        off = (rows > 0) & (came_off[rows] == former_row)
        self._apart[off] = np.minimum(apart[off], 254) + 1
        count = np.bincount(rows[off], minlength=len(came_off))
        frames = np.bincount(rows[off], self._apart[off], len(came_off)) / np.maximum(count, 1)
        early = parts[frames[row_of[parts]] <= APART]
        back = np.arange(len(main))
        back[early] = main[early]
        return np.where(region >= 0, back[region], -1)

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


def _carried(count: npt.NDArray[np.uint8], before: int, place: Place) -> npt.NDArray[np.uint8]:
    """Return the counts (N,) of points from those of the `before` ones of the last frame; 0 where there was none."""
    known = count if len(count) == before else np.zeros(before, np.uint8)
    return known if isinstance(place, slice) else np.append(known, np.uint8(0))[place]
