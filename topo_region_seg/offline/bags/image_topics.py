# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Which topics of a recording are depth images, and which camera_info and color images belong to them.

Names and what the first image says tell. Beside an image lies its camera_info, as drivers have it; its color images
have the same size and frame, which those have that a driver has registered to the depth.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import takewhile
from typing import Any

from topo_region_seg.cloud.camera_info import image_size
from topo_region_seg.cloud.compressed_images import compressed_color, is_compressed
from topo_region_seg.cloud.images import COLORS, DEPTHS
from topo_region_seg.cloud.layout import CloudFormatError
from topo_region_seg.offline.bags.decoding import decode_record
from topo_region_seg.offline.bags.images import MOST_POINTS, ImageTopic
from topo_region_seg.offline.bags.records import BagReader, Topic

IMAGE, COMPRESSED, INFO = "sensor_msgs/msg/Image", "sensor_msgs/msg/CompressedImage", "sensor_msgs/msg/CameraInfo"
PACKED = ("/compressedDepth", "/compressed")
"""What image_transport appends to a topic's name."""


@dataclass(frozen=True)
class _Seen:
    """The topic of some images, and the first one that can be decoded."""

    topic: Topic
    first: Any

    @property
    def name(self) -> str:
        """Name of the topic before image_transport."""
        return base_name(self.topic.name)

    @property
    def frame(self) -> str:
        return str(self.first.header.frame_id).lstrip("/")


def has_images(reader: BagReader) -> bool:
    """Return whether a recording has images of any kind."""
    return any(topic.type in (IMAGE, COMPRESSED) and topic.count for topic in reader.topics)


def base_name(topic: str) -> str:
    """Return the name of an image topic without what image_transport appends."""
    return topic.removesuffix(packing(topic))


def packing(topic: str) -> str:
    """Return what image_transport has appended to the name of an image topic; "" for nothing."""
    return next((packed for packed in PACKED if topic.endswith(packed)), "")


def image_topics(reader: BagReader, *, every: bool = False) -> list[ImageTopic]:
    """Return the topics of depth images.

    Unless `every` one is asked for, those without camera_info are left out where others have one, those whose name does
    not say "depth", those without color images, and packed ones that are there unpacked too; each only where others are
    left.
    """
    if not has_images(reader):
        return []
    seen = [found for topic in reader.topics if (found := _look(reader, topic)) is not None]
    colors = [found for found in seen if _is_color(found)]
    topics = [_with_partners(reader, found, colors) for found in seen if _is_depth(found)]
    if every:
        return topics
    raw = {topic.name for topic in topics}
    keeps: tuple[Callable[[ImageTopic], bool], ...] = (
        lambda topic: bool(topic.info),
        lambda topic: "depth" in topic.name,
        lambda topic: bool(topic.color),
        lambda topic: topic.name == base_name(topic.name) or base_name(topic.name) not in raw,
    )
    for keep in keeps:
        topics = [topic for topic in topics if keep(topic)] or topics
    return topics


def _look(reader: BagReader, topic: Topic) -> _Seen | None:
    if topic.type in (IMAGE, COMPRESSED) and topic.count:
        for record in reader.messages([topic.name]):
            try:
                return _Seen(topic, decode_record(record))
            except CloudFormatError:
                continue
    return None


def _is_depth(seen: _Seen) -> bool:
    if is_compressed(seen.first):
        return "compressedDepth" in seen.first.format
    encoding = str(seen.first.encoding)
    # Infrared images are of 16 bits, too.
    return encoding in DEPTHS and (encoding != "mono16" or "depth" in seen.topic.name)


def _is_color(seen: _Seen) -> bool:
    if is_compressed(seen.first):
        return "compressedDepth" not in seen.first.format
    encoding = str(seen.first.encoding)
    gray = encoding.startswith(("mono", "8UC1"))
    return encoding in COLORS and (not gray or any(word in seen.topic.name for word in ("color", "rgb")))


def _with_partners(reader: BagReader, depth: _Seen, colors: list[_Seen]) -> ImageTopic:
    size = image_size(depth.first)
    fitting = [color for color in colors if color.frame == depth.frame and _color_size(color) == size]
    best = min(fitting, key=lambda color: _rank(color, depth), default=None)
    info = _info_of(reader, depth.name)
    return ImageTopic(depth.topic.name, depth.topic.type, depth.topic.count, "", info, best.topic.name if best else "")


def _rank(color: _Seen, depth: _Seen) -> tuple[bool, int, bool, str]:
    named = any(word in color.name for word in ("color", "rgb"))
    common = sum(1 for _ in takewhile(lambda pair: pair[0] == pair[1], zip(color.name, depth.name, strict=False)))
    return not named, -common, is_compressed(color.first), color.name


def _color_size(color: _Seen) -> tuple[int, int] | None:
    if not is_compressed(color.first):
        return int(color.first.height), int(color.first.width)
    try:
        height, width, _ = compressed_color(color.first, max_points=MOST_POINTS).shape
    except CloudFormatError:
        return None
    return height, width


def _info_of(reader: BagReader, depth: str) -> str:
    """Return the topic of camera_info beside a topic of images; else the only one, or the only one of depth."""
    names = [topic.name for topic in reader.topics if topic.type == INFO and topic.count]
    beside = f"{depth.rpartition('/')[0]}/camera_info"
    if beside in names:
        return beside
    of_depth = [name for name in names if "depth" in name]
    return next((found[0] for found in (names, of_depth) if len(found) == 1), "")
