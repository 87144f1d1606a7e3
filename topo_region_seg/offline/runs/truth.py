# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The truth for a run, from the recording that was replayed."""

from __future__ import annotations

from pathlib import Path

from topo_region_seg.cloud.pointcloud2 import CloudFormatError
from topo_region_seg.cloud.stamp import stamp_of
from topo_region_seg.data import LabelArray
from topo_region_seg.offline.bags import open_bag
from topo_region_seg.offline.bags.clouds import POINT_CLOUD, decode_message
from topo_region_seg.offline.bags.records import BagReader, Topic
from topo_region_seg.offline.evaluation.labels import has_labels
from topo_region_seg.offline.evaluation.measures import AS_LABELED, Measures, TruthReading, measure
from topo_region_seg.offline.evaluation.truth import TRUTH_TOPIC, RecordedTruth, no_truth
from topo_region_seg.offline.runs.pairing import StampCounts
from topo_region_seg.offline.runs.run import Run, RunFrame
from topo_region_seg.offline.stamps import ordinals


class RunTruth:
    """The true labels of a run's frames.

    Parameters
    ----------
    run : Run
        The run.
    truth : RecordedTruth
        The truth in its source.
    reading : TruthReading
        What the true labels mean.

    Attributes
    ----------
    topic : str
        Where the truth was found.
    unpaired : list of float
        Stamps (s) of frames whose truth is not known, as several clouds have that stamp and not each has a truth.
    """

    def __init__(self, run: Run, truth: RecordedTruth, reading: TruthReading = AS_LABELED) -> None:
        self.topic = truth.topic
        self.reading = reading
        self.unpaired: list[float] = []
        self._truth = truth
        self._counts = StampCounts(run.record)
        self._places = [place for _, place in ordinals(frame.stamp for frame in run.record.frames)]

    def __len__(self) -> int:
        return len(self._truth)

    def of(self, frame: RunFrame) -> LabelArray | None:
        """Return the true labels of the points of a frame, (N,) uint32; None where they are not known."""
        stamp = frame.record.stamp
        try:
            found = self._truth.of(stamp_of(frame.msg), self._places[frame.index], self._counts.clouds(stamp))
        except CloudFormatError:
            found = None
        else:
            if found is None or self._counts.ordered(stamp):
                return found
        self.unpaired.append(stamp)
        return None

    def note(self) -> str | None:
        """Return a line about the frames whose truth is not known, None if there are none."""
        count = len(self.unpaired)
        if not count:
            return None
        return (
            f"without truth: {count} frame{'' if count == 1 else 's'}, the first at {self.unpaired[0]:.3f} s: several "
            f"clouds have the same stamp, and which truth on {self.topic} belongs to which is not known"
        )


def truth_of_run(
    run: Run, source: Path | None = None, truth_topic: str | None = None, reading: TruthReading = AS_LABELED
) -> RunTruth | None:
    """Return the truth in the source of a run: on the topic asked for, on the usual one, or in its clouds.

    Parameters
    ----------
    run : Run
        The run.
    source : Path, optional
        Where the source is now. By default, the path it had for the run; None is returned if it is gone.
    truth_topic : str, optional
        The topic of true labels, which must exist.
    reading : TruthReading
        What the true labels mean.

    Raises
    ------
    BagError
        The source or the topic asked for does not exist.
    """
    if source is None and truth_topic is None and not Path(run.record.source).exists():
        return None
    with open_bag(source or run.record.source) as reader:
        topic = _topic(reader, run.record.topic, truth_topic)
        return RunTruth(run, RecordedTruth(reader, topic, run.params.point_limit), reading) if topic else None


def quality(frame: RunFrame, truth: LabelArray | None, reading: TruthReading = AS_LABELED) -> Measures | None:
    """Return the measures of a frame against its truth; None without truth for its points."""
    if truth is None or len(truth) != len(frame.labels):
        return None
    return measure(truth, frame.labels, frame.valid, frame.cloud.height, frame.cloud.width, reading)


def _topic(reader: BagReader, clouds: str, wanted: str | None) -> Topic | None:
    topics = {topic.name.lstrip("/"): topic for topic in reader.topics if topic.type == POINT_CLOUD}
    found = topics.get((wanted or TRUTH_TOPIC).lstrip("/"))
    if found or not wanted:
        carried = topics.get(clouds.lstrip("/"))
        return found or (carried if carried and _carries_labels(reader, carried) else None)
    raise no_truth(reader, wanted, list(topics.values()))


def _carries_labels(reader: BagReader, topic: Topic) -> bool:
    for record in reader.messages([topic.name]):
        try:
            return has_labels(decode_message(record, topic))
        except CloudFormatError:
            continue
    return False
