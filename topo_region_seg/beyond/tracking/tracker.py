# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Labels that stay with their regions from one frame to the next."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from topo_region_seg.beyond.tracking.holding import Holding
from topo_region_seg.beyond.tracking.labels import LARGEST, LabelPool
from topo_region_seg.beyond.tracking.matching import matched
from topo_region_seg.beyond.tracking.motion import EVERY, Place, Poses, camera_motion, seen_from_here
from topo_region_seg.beyond.tracking.overlap import Seen, same_place, same_points, seen_in
from topo_region_seg.beyond.tracking.tracks import MEMORY, Tracks
from topo_region_seg.clock import Clock
from topo_region_seg.data import Cloud, LabelArray, Notice, SegmentationWarning
from topo_region_seg.segmentation import Segmentation

Stream = tuple[str, tuple[int, int] | None]
"""What the frames of a stream have in common: the frame id, and the height and width of images."""


class Tracker:
    """Gives the regions of consecutive frames steady labels; made for one stream, used from one thread at a time."""

    def __init__(self) -> None:
        self.reset()

    def reset(self) -> None:
        """Forget all regions; labels count from 1 again."""
        self._tracks = Tracks.none()
        self._pool = LabelPool()
        self._holding = Holding()
        self._seen: Seen | None = None
        self._stamp = -np.inf
        self._stream: Stream = ("", None)
        self._poses: Poses = (None, None)

    def follow(
        self,
        cloud: Cloud,
        seg: Segmentation,
        stamp: float,
        frame_id: str = "",
        warn: Callable[[str, str], None] | None = None,
    ) -> Segmentation:
        """Return `seg` with the labels that its regions had before; new ones get labels that are free.

        Labels are 1 to 65,535. One is free when no region in sight or in memory has it, and is given again when all
        others that are free have been given since. Should they run short, the regions that have been out of sight for
        longest are forgotten early; where there are more regions than labels, the smallest new ones get labels from
        65,536 on for this frame alone, and a notice says so.

        Parameters
        ----------
        cloud : Cloud
            What `seg` was made of.
        seg : Segmentation
            The next frame. Its regions stay as they are, unless ``seg.params.hold_regions`` is on. Returned as it is,
            and all regions are forgotten, where ``seg.params.track_regions`` is off.
        stamp : float
            Time of the frame, seconds. If it is before that of the last frame, all regions are forgotten.
        frame_id : str
            Coordinate frame. If it is another one than before, or the image another size, all regions are forgotten.
        warn : callable, optional
            Called with the code and text of a notice. Without it, that becomes a :class:`SegmentationWarning`.
        """
        if not seg.params.track_regions:
            if self._seen is not None:
                self.reset()
            return seg
        clock = Clock()
        with clock("tracking"):
            stream: Stream = (frame_id, (cloud.height, cloud.width) if cloud.organized else None)
            if stamp < self._stamp or (self._seen is not None and stream != self._stream):
                self.reset()
            self._stamp, self._stream = stamp, stream
            place = self._with_the_camera(cloud, seg)
            if not seg.params.hold_regions:
                self._holding = Holding()
            elif self._seen is not None:
                seg = self._holding.steadied(cloud, seg, self._seen, place)
            label = self._labeled(cloud, seg)
            table = np.zeros(int(np.max(seg.regions.label, initial=0)) + 1, np.uint32)
            table[seg.regions.label] = label
        untracked = int(np.count_nonzero(label > LARGEST))
        notices = (
            (*seg.notices, Notice("labels_short", _short_text(len(label), untracked))) if untracked else seg.notices
        )
        if untracked:
            (warn or _python_warning)(notices[-1].code, notices[-1].text)
        return replace(
            seg,
            labels=table[seg.labels],
            regions=replace(seg.regions, label=label),
            point_labels=table[seg.point_labels],
            ms={**seg.ms, **clock.ms},
            cpu_ms={**seg.cpu_ms, **clock.cpu_ms},
            notices=notices,
        )

    def _with_the_camera(self, cloud: Cloud, seg: Segmentation) -> Place:
        """Move what is in memory to where the camera sees it now, if it is known to have moved."""
        poses = cloud.sensor_pose, cloud.base_pose
        motion = None if self._seen is None else camera_motion(self._poses, poses)
        self._poses = poses
        if motion is None or self._seen is None:
            return EVERY
        self._tracks = self._tracks.moved(motion)
        reach = same_place(seg)
        self._seen, place = seen_from_here(self._seen, cloud, np.flatnonzero(seg.labels), motion, reach)
        return place

    def _labeled(self, cloud: Cloud, seg: Segmentation) -> LabelArray:
        """Return the label of every row of the table of regions, and remember the frame."""
        table, label = seg.regions, np.zeros(len(seg.regions), np.uint32)
        # A patch is a place in the image and no thing: where nothing of it is left, it does not come back.
        patches = seg.params.output == "supervoxels"
        here = seen_in(cloud, seg)
        match = np.full(len(table), -1)
        if self._seen is not None:
            points = same_points(cloud, here, seg, self._seen)
            match = matched(table, self._tracks, *points, likeness=not patches)
            known = np.flatnonzero(match >= 0)
            match[known[self._tracks.label[match[known]] > LARGEST]] = -1
        memory = 0 if patches else MEMORY
        lost = self._remembered(self._tracks.lost_since(match), int(np.count_nonzero(match < 0)), memory)
        old, new = match >= 0, np.flatnonzero(match < 0)
        label[old] = self._tracks.label[match[old]]
        free = min(len(new), len(self._pool))
        label[new[:free]] = self._pool.take(free)
        label[new[free:]] = LARGEST + 1 + np.arange(len(new) - free)
        self._tracks = self._tracks.seen(table, label, match).joined(lost)
        self._seen = replace(here, label=label)
        return label

    def _remembered(self, lost: Tracks, wanted: int, memory: int) -> Tracks:
        """Return what was lost at most `memory` frames ago; the labels of the rest become free, more where wanted."""
        if (lost.label > LARGEST).any():
            lost = lost.rows(lost.label <= LARGEST)
        forgotten = int(np.count_nonzero(lost.lost > memory))
        forgotten = max(forgotten, min(wanted - len(self._pool), len(lost)))
        self._pool.give_back(lost.label[:forgotten])
        return lost.rows(slice(forgotten, None))


def _short_text(regions: int, untracked: int) -> str:
    return (
        f"{regions} regions, more than the {LARGEST} labels that are tracked: the {untracked} smallest new ones have "
        "labels for this frame alone; raise min_region_size or seed_spacing to get fewer regions"
    )


def _python_warning(code: str, text: str) -> None:
    warnings.warn(f"{text} ({code})", SegmentationWarning, stacklevel=3)
