# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The truth for a run, from the recording that the run was made of."""

from __future__ import annotations

from pathlib import Path

from topo_region_seg.cloud.pointcloud2 import CloudFormatError
from topo_region_seg.data import LabelArray
from topo_region_seg.offline.bags import open_bag
from topo_region_seg.offline.bags.clouds import POINT_CLOUD, decode_message
from topo_region_seg.offline.bags.records import BagError, BagReader, Topic
from topo_region_seg.offline.evaluation.labels import has_labels
from topo_region_seg.offline.evaluation.measures import Measures, measure
from topo_region_seg.offline.evaluation.truth import TRUTH_TOPIC, RecordedTruth
from topo_region_seg.offline.runs.run import Run, RunFrame


def truth_of_run(run: Run, source: Path | None = None, truth_topic: str | None = None) -> RecordedTruth | None:
    """Return the truth in the source of a run: of the topic asked for, of the usual one, or what its clouds carry.

    Parameters
    ----------
    run : Run
        The run.
    source : Path, optional
        Where the source is now; else where it was when the run was made, and None comes back if it is gone.
    truth_topic : str, optional
        The topic of true labels; it has to be there.

    Raises
    ------
    BagError
        The source or the topic asked for is not there.
    """
    if source is None and truth_topic is None and not Path(run.record.source).exists():
        return None
    with open_bag(source or run.record.source) as reader:
        topic = _topic(reader, run.record.topic, truth_topic)
        return RecordedTruth(reader, topic, run.params.point_limit) if topic else None


def quality(frame: RunFrame, truth: LabelArray | None) -> Measures | None:
    """Return the measures of a frame against its truth; None where there is none for its points."""
    if truth is None or len(truth) != len(frame.labels):
        return None
    return measure(truth, frame.labels, frame.valid, frame.cloud.height, frame.cloud.width)


def _topic(reader: BagReader, clouds: str, wanted: str | None) -> Topic | None:
    topics = {topic.name.lstrip("/"): topic for topic in reader.topics if topic.type == POINT_CLOUD}
    found = topics.get((wanted or TRUTH_TOPIC).lstrip("/"))
    if found or not wanted:
        carried = topics.get(clouds.lstrip("/"))
        return found or (carried if carried and _carries_labels(reader, carried) else None)
    names = ", ".join(topic.name for topic in topics.values()) or "none"
    raise BagError(f"{reader.path}: has no truth on {wanted}; give --truth-topic (its topics of clouds: {names})")


def _carries_labels(reader: BagReader, topic: Topic) -> bool:
    for record in reader.messages([topic.name]):
        try:
            return has_labels(decode_message(record, topic))
        except CloudFormatError:
            continue
    return False
