# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""A run, read back: its record, and its labeled clouds one by one."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from topo_region_seg.cloud.pointcloud2 import CloudFormatError, decode
from topo_region_seg.cloud.stamp import stamp_of
from topo_region_seg.data import BoolArray, Cloud, LabelArray
from topo_region_seg.offline.bags import open_bag
from topo_region_seg.offline.bags.attachments import read_attachment
from topo_region_seg.offline.bags.clouds import cloud_topic, decode_message
from topo_region_seg.offline.bags.records import BagError
from topo_region_seg.offline.evaluation.labels import labels_of
from topo_region_seg.offline.frames import FrameResult
from topo_region_seg.offline.runs.record import RECORD_NAME, RunRecord
from topo_region_seg.offline.stamps import StampQueue, seconds
from topo_region_seg.parameter_table import ParameterError
from topo_region_seg.params import Params

LABELED_POINTS = "/labeled_points"


@dataclass(frozen=True)
class RunFrame:
    """One labeled cloud.

    Parameters
    ----------
    index : int
        Its index in the run, from 0.
    record : FrameResult
        Its entry in the record.
    msg : sensor_msgs/PointCloud2
        As recorded.
    cloud : Cloud
        Its points.
    labels : (N,) uint32
        Its regions; 0 = none.
    """

    index: int
    record: FrameResult
    msg: Any
    cloud: Cloud
    labels: LabelArray

    @property
    def valid(self) -> BoolArray:
        """Which points have a finite position, (N,)."""
        finite: BoolArray = np.isfinite(self.cloud.xyz).all(axis=1)
        return finite


class Run:
    """A recording written by ``replay``.

    Attributes
    ----------
    path : Path
        File or folder.
    record : RunRecord
        How it was made.
    params : Params
        Its parameters.
    problems : list of str
        One line for each damaged part of the recording; grows while frames are read.
    """

    def __init__(self, path: Path, record: RunRecord, params: Params) -> None:
        self.path = path
        self.record = record
        self.params = params
        self.problems: list[str] = []

    def frames(self, wanted: Collection[int] | None = None) -> Iterator[RunFrame]:
        """Read the labeled clouds, or those with given indices; each is matched with its entry in the record by stamp.

        Clouds that cannot be read and clouds without an entry go to `problems`.
        """
        places = StampQueue(frame.stamp for frame in self.record.frames)
        with open_bag(self.path) as reader:
            if not reader.count(LABELED_POINTS):
                return
            topic = cloud_topic(reader, LABELED_POINTS)
            for message in reader.messages([LABELED_POINTS]):
                try:
                    msg = decode_message(message, topic)
                    stamp = seconds(stamp_of(msg))
                    index = places.take(stamp)
                    if index is None:
                        self._note(f"{self.path}: the cloud of {stamp:.9f} s is not in the record")
                        continue
                    if wanted is not None and index not in wanted:
                        continue
                    cloud = decode(msg, max_points=self.params.point_limit)
                    labels = labels_of(msg, max_points=self.params.point_limit)
                except CloudFormatError as error:
                    self._note(f"{self.path}: {error}")
                    continue
                yield RunFrame(index, self.record.frames[index], msg, cloud, labels)
            self._note(*reader.problems)

    def _note(self, *problems: str) -> None:
        """Add problems, each once however often the frames are read."""
        self.problems += [problem for problem in dict.fromkeys(problems) if problem not in self.problems]


def open_run(path: str | Path) -> Run:
    """Open a run.

    Raises
    ------
    BagError
        It cannot be opened, or has no record of a run; the message says which.
    """
    path = Path(path)
    with open_bag(path) as reader:  # has clear errors for files that are not recordings
        labeled = reader.count(LABELED_POINTS)
    data = read_attachment(path, RECORD_NAME)
    if data is None:
        what = "was written by an older version, or is cut short" if labeled else "was not written by replay"
        raise BagError(f"{path}: {what} (it has no '{RECORD_NAME}'); make it with: topo_region_seg replay BAG -o OUT")
    try:
        record = RunRecord.from_json(data)
        return Run(path, record, Params.from_mapping(record.params))
    except (ValueError, ParameterError, RecursionError) as error:
        reason = " ".join(str(error).split())
        raise BagError(f"{path}: its '{RECORD_NAME}' cannot be read ({reason}); replay the bag again") from None
