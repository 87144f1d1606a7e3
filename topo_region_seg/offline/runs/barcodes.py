# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The barcodes of some frames of a run: as recorded, or computed from the source."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from topo_region_seg.cloud.layout import check_field
from topo_region_seg.cloud.pointcloud2 import CloudFormatError, decode
from topo_region_seg.cloud.stamp import stamp_of
from topo_region_seg.data import FloatArray, LabelArray
from topo_region_seg.offline.bags import open_bag
from topo_region_seg.offline.bags.clouds import cloud_records, cloud_topic, decode_message
from topo_region_seg.offline.bags.sensor_frame import SensorFrame
from topo_region_seg.offline.evaluation.labels import labels_of
from topo_region_seg.offline.runs.pairing import StampCounts
from topo_region_seg.offline.runs.run import Run
from topo_region_seg.offline.stamps import StampQueue, seconds
from topo_region_seg.pipeline import MissingColorError, Pipeline, warm_up

BARCODE = "/barcode"
_FLOAT32 = 7


@dataclass(frozen=True)
class Bars:
    """The H0 bars of a frame.

    Parameters
    ----------
    death : (M,) float64
        Metres, inf for bars that never die; all births are 0.
    label : (M,) uint32
        Region of the bar's point; 0 = none.
    computed : bool
        Whether they were computed from the source, rather than recorded.
    """

    death: FloatArray
    label: LabelArray
    computed: bool


def barcodes_of(run: Run, wanted: Collection[int], source: Path | None = None) -> dict[int, Bars]:
    """Return the barcodes of some frames by their index; frames whose barcode is not known are left out.

    The labels of computed barcodes are those that the run has recorded: tracking has given them to its regions.

    Parameters
    ----------
    run : Run
        The run; barcodes recorded on ``/barcode`` are used as they are.
    wanted : collection of int
        Indices of frames.
    source : Path, optional
        Where the source is now; by default, the path it had for the run.

    Raises
    ------
    BagError
        The run or the source cannot be read.
    """
    limit = run.params.point_limit
    with open_bag(run.path) as reader:
        if reader.count(BARCODE):
            return {index: _recorded(msg, limit) for index, msg in _messages(run, run.path, BARCODE, wanted)}
    place = source or Path(run.record.source)
    if not place.exists():
        return {}
    warm_up()
    pipeline = Pipeline(run.params)
    labels = {frame.index: frame.labels for frame in run.frames(wanted)}
    with open_bag(place) as transforms:
        return _computed(run, place, pipeline, labels, SensorFrame(transforms))


def _computed(
    run: Run, place: Path, pipeline: Pipeline, labels: dict[int, LabelArray], sensor: SensorFrame
) -> dict[int, Bars]:
    found = {}
    limit = run.params.point_limit
    for index, msg in _messages(run, place, run.record.topic, labels, with_rejected=True):
        try:
            cloud = decode(msg, max_points=limit, needs_color=pipeline.needs_color)
            cloud = sensor.place(cloud, msg)
            if len(cloud) != len(labels[index]):
                continue  # not the recording that was replayed
            seg = pipeline.run(cloud, _ignore)  # the replay has reported its notices
        except (CloudFormatError, MissingColorError):
            continue
        found[index] = Bars(seg.barcode.death, labels[index][seg.index], computed=True)
    return found


def _messages(
    run: Run, path: Path, name: str, wanted: Collection[int], *, with_rejected: bool = False
) -> Iterator[tuple[int, Any]]:
    """Iterate over the messages of a topic that belong to some frames, with the frames' indices.

    They are matched by stamp. With `with_rejected`, the topic holds the clouds that the run rejected too: frames that
    share their stamp with one of those are left out, as it is not known which message is theirs.
    """
    counts = StampCounts(run.record)
    places = StampQueue(frame.stamp for frame in run.record.frames)
    with open_bag(path) as reader:
        topic = cloud_topic(reader, name)
        for record in cloud_records(reader, topic):
            try:
                msg = decode_message(record, topic)
            except CloudFormatError:
                continue
            stamp = seconds(stamp_of(msg))
            index = places.take(stamp)
            if index is not None and index in wanted and (counts.ordered(stamp) or not with_rejected):
                yield index, msg


def _recorded(msg: Any, limit: int) -> Bars:
    """Read the fields `death` and `label` of a recorded barcode; a malformed one has no bars."""
    data = np.ascontiguousarray(msg.data).reshape(-1).view(np.uint8)
    try:
        field, row_step = check_field(msg, data.nbytes, "death", max_points=limit, warn=_ignore)
        label = labels_of(msg, max_points=limit)
    except CloudFormatError:
        return Bars(np.zeros(0), np.zeros(0, np.uint32), computed=False)
    if int(field.datatype) != _FLOAT32 or not len(label):
        return Bars(np.zeros(0), np.zeros(0, np.uint32), computed=False)
    kind = ">f4" if msg.is_bigendian else "<f4"
    strides = (row_step, int(msg.point_step))
    column: Any = np.ndarray((int(msg.height), int(msg.width)), kind, data, int(field.offset), strides)
    death = column.astype(np.float64).reshape(-1)
    return Bars(np.where(np.isnan(death), np.inf, np.maximum(death, 0.0)), label, computed=False)


def _ignore(code: str, text: str) -> None:
    """Drop a notice that has been reported before."""
