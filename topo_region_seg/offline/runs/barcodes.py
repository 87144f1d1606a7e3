# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The barcodes of some frames of a run: recorded ones, or computed anew from the source."""

from __future__ import annotations

from collections import defaultdict, deque
from collections.abc import Collection, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from topo_region_seg.cloud.layout import check_field
from topo_region_seg.cloud.pointcloud2 import CloudFormatError, decode
from topo_region_seg.data import FloatArray, LabelArray
from topo_region_seg.offline.bags import open_bag
from topo_region_seg.offline.bags.clouds import cloud_topic, decode_message
from topo_region_seg.offline.evaluation.labels import labels_of
from topo_region_seg.offline.runs.run import Run
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
    anew : bool
        Whether they were computed from the source now, rather than recorded.
    """

    death: FloatArray
    label: LabelArray
    anew: bool


def barcodes_of(run: Run, wanted: Collection[int], source: Path | None = None) -> dict[int, Bars]:
    """Return the barcodes of the frames of some indices, as far as they can be had.

    Parameters
    ----------
    run : Run
        The run; what it recorded on ``/barcode`` is taken as it is.
    wanted : collection of int
        Indices of frames.
    source : Path, optional
        Where the source is now; else where it was when the run was made, if it is still there.

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
    found: dict[int, Bars] = {}
    warm_up()
    pipeline = Pipeline(run.params)
    for index, msg in _messages(run, place, run.record.topic, wanted):
        try:
            bars = pipeline.run(decode(msg, max_points=limit)).barcode
        except (CloudFormatError, MissingColorError):
            continue
        found[index] = Bars(bars.death, bars.label, anew=True)
    return found


def _messages(run: Run, path: Path, name: str, wanted: Collection[int]) -> Iterator[tuple[int, Any]]:
    """Iterate over the messages of a topic of clouds that belong to the frames of some indices, matched by stamp."""
    places: dict[float, deque[int]] = defaultdict(deque)
    for index, frame in enumerate(run.record.frames):
        places[frame.stamp].append(index)
    with open_bag(path) as reader:
        topic = cloud_topic(reader, name)
        for record in reader.messages([topic.name]):
            try:
                msg = decode_message(record, topic)
            except CloudFormatError:
                continue
            waiting = places[msg.header.stamp.sec + msg.header.stamp.nanosec * 1e-9]
            if waiting and (index := waiting.popleft()) in wanted:
                yield index, msg


def _recorded(msg: Any, limit: int) -> Bars:
    """Read the fields `death` and `label` of a recorded barcode; an odd one has no bars."""
    data = np.ascontiguousarray(msg.data).reshape(-1).view(np.uint8)
    try:
        field, row_step = check_field(msg, data.nbytes, "death", max_points=limit, warn=lambda code, text: None)
        label = labels_of(msg, max_points=limit)
    except CloudFormatError:
        return Bars(np.zeros(0), np.zeros(0, np.uint32), anew=False)
    if int(field.datatype) != _FLOAT32 or not len(label):
        return Bars(np.zeros(0), np.zeros(0, np.uint32), anew=False)
    kind = ">f4" if msg.is_bigendian else "<f4"
    strides = (row_step, int(msg.point_step))
    column: Any = np.ndarray((int(msg.height), int(msg.width)), kind, data, int(field.offset), strides)
    death = column.astype(np.float64).reshape(-1)
    return Bars(np.where(np.isnan(death), np.inf, np.maximum(death, 0.0)), label, anew=False)
