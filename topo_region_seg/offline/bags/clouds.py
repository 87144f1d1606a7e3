# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The clouds of a recording: which topic they are on, and the messages decoded."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import lru_cache
from typing import Any

from rosbags.typesys import get_types_from_msg

from topo_region_seg.cloud.layout import CHANNELS, COORDINATES, CloudFormatError
from topo_region_seg.offline.bags.decoding import decode_record, recorded_cdr
from topo_region_seg.offline.bags.image_topics import has_images, image_topics
from topo_region_seg.offline.bags.images import ImageRecord, ImageTopic, image_records
from topo_region_seg.offline.bags.records import BagError, BagReader, Record, Topic
from topo_region_seg.offline.bags.types import typestore

POINT_CLOUD = "sensor_msgs/msg/PointCloud2"
_PARTS = (POINT_CLOUD, "sensor_msgs/msg/PointField", "std_msgs/msg/Header")


def cloud_topic(reader: BagReader, wanted: str | None = None) -> Topic:
    """Return the topic of the clouds to segment.

    Without `wanted` it is the only topic of point clouds; if there are several, the only one whose clouds have x, y
    and z; of several such, the only one that is not labeled yet; of several such, the only one with color. Where no
    cloud has x, y and z it is the topic of depth images, whose clouds are made as the node makes them.

    Raises
    ------
    BagError
        There is none, the wanted one is not there or of another type, or there are several; the message lists what
        could be asked for.
    """
    clouds = [topic for topic in reader.topics if topic.type == POINT_CLOUD and topic.count]
    if wanted is not None:
        return _wanted(reader, clouds, wanted)
    fields = {topic.name: _fields(reader, topic) for topic in clouds} if len(clouds) > 1 or has_images(reader) else {}
    # A recording of images may have clouds of other things beside them, such as of true labels.
    only_others = bool(fields) and not any(map(_has_coordinates, fields.values()))
    if (only_others or not clouds) and (image := _image_topic(reader)):
        return image
    if not clouds:
        raise BagError(f"{reader.path}: {why_no_clouds(reader)}")
    if len(clouds) > 1:
        for keep in (_has_coordinates, _is_unlabeled, _has_color):
            clouds = [topic for topic in clouds if keep(fields[topic.name])] or clouds
    if len(clouds) > 1:
        raise BagError(f"{reader.path}: has several topics of clouds; choose one: {_options(clouds)}")
    return clouds[0]


def cloud_topics(reader: BagReader) -> list[Topic]:
    """Return all topics of clouds, and those of depth images where no cloud has x, y and z."""
    clouds: list[Topic] = [topic for topic in reader.topics if topic.type == POINT_CLOUD and topic.count]
    if has_images(reader) and not any(_has_coordinates(_fields(reader, topic)) for topic in clouds):
        clouds += image_topics(reader)
    return clouds


def why_no_clouds(reader: BagReader) -> str:
    """Say why a recording has no clouds, in words that follow its name."""
    if reader.truncated and not reader.topics:
        return "is cut short before its first whole message; record it again"
    problem = reader.problems[0].removeprefix(f"{reader.path}: ") if reader.problems else ""
    if problem and not reader.topics:
        return f"has no whole message ({problem}); record it again"
    if silent := ", ".join(topic.name for topic in reader.topics if topic.type == POINT_CLOUD):
        if reader.truncated:
            return f"is cut short before the first whole cloud of {silent}; record it again"
        if problem:
            return f"has no whole cloud of {silent} ({problem}); record it again"
        return f"has no clouds: nothing was recorded on {silent}; check that the camera publishes, and record it again"
    other = ", ".join(f"{topic.name} ({topic.type})" for topic in reader.topics[:8]) or "nothing"
    return f"has no clouds ({POINT_CLOUD}); it holds {other}"


def cloud_records(reader: BagReader, topic: Topic) -> Iterator[Record]:
    """Iterate over the clouds of a topic, or over its depth images with what belongs to each."""
    return image_records(reader, topic) if isinstance(topic, ImageTopic) else reader.messages([topic.name])


def cdr(record: Record) -> bytes:
    """Return the CDR bytes of a cloud, converted where the recording is of ROS 1, or made where it is of images.

    Raises
    ------
    CloudFormatError
        The bytes are no ROS 1 message of this type, or the encoding is neither (`undecodable`); or there is no cloud of
        the images.
    """
    if isinstance(record, ImageRecord):
        return bytes(typestore().serialize_cdr(record.message(), POINT_CLOUD))
    return recorded_cdr(record)


def decode_message(record: Record, topic: Topic) -> Any:
    """Return the PointCloud2 of a record.

    Raises
    ------
    CloudFormatError
        The recorded type has another layout than that of ROS 2 Jazzy (`schema_mismatch`), or the bytes are no such
        message (`undecodable`); or there is no cloud of the images.
    """
    if isinstance(record, ImageRecord):
        return record.message()
    if topic.definition and not _same_layout(topic.definition):
        raise CloudFormatError("schema_mismatch", f"the recorded definition of {POINT_CLOUD} is not that of ROS 2")
    return decode_record(replace(record, type=POINT_CLOUD))


def _image_topic(reader: BagReader) -> ImageTopic | None:
    topics = image_topics(reader)
    if len(topics) > 1:
        raise BagError(f"{reader.path}: has several topics of depth images; choose one: {_options(topics)}")
    return topics[0] if topics else None


def _wanted(reader: BagReader, clouds: list[Topic], wanted: str) -> Topic:
    for topic in clouds:
        if topic.name.lstrip("/") == wanted.lstrip("/"):
            return topic
    images = image_topics(reader, every=True) if has_images(reader) else []
    for image in images:
        if image.name.lstrip("/") == wanted.lstrip("/"):
            return image
    others = [*clouds, *images]
    advice = f"choose one of: {_options(others)}" if others else "it has no clouds"
    for topic in reader.topics:
        if topic.name.lstrip("/") == wanted.lstrip("/"):
            what = f"of type {topic.type}" if topic.type != POINT_CLOUD else "empty"
            raise BagError(f"{reader.path}: topic {topic.name} is {what}; {advice}")
    raise BagError(f"{reader.path}: has no topic {wanted}; {advice}")


def _options(clouds: Sequence[Topic]) -> str:
    return ", ".join(f"--topic {topic.name}" for topic in clouds)


def _fields(reader: BagReader, topic: Topic) -> set[str]:
    """Return the field names of the first cloud of a topic that can be decoded."""
    for record in reader.messages([topic.name]):
        try:
            return {field.name for field in decode_message(record, topic).fields}
        except CloudFormatError:
            continue
    return set()


def _has_coordinates(fields: set[str]) -> bool:
    return fields.issuperset(COORDINATES)


def _is_unlabeled(fields: set[str]) -> bool:
    return "label" not in fields


def _has_color(fields: set[str]) -> bool:
    return "rgb" in fields or "rgba" in fields or fields.issuperset(CHANNELS)


@lru_cache(maxsize=8)
def _same_layout(definition: str) -> bool:
    """Whether a recorded definition says the same as ROS 2's; one that cannot be read is given the benefit of doubt."""
    try:
        recorded = get_types_from_msg(definition, POINT_CLOUD)
    except Exception:  # the grammar's errors are of many kinds, and the definition is not needed for decoding
        return True
    ours = typestore().fielddefs
    return all(recorded[name][1] == ours[name][1] for name in _PARTS if name in recorded)
