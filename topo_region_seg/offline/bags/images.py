# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Clouds from the depth images of a recording, each with its camera_info and color image, as the node makes them."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from topo_region_seg.cloud.camera_info import choose_info, is_rectified
from topo_region_seg.cloud.depth_image import decode_depth
from topo_region_seg.cloud.layout import CloudFormatError
from topo_region_seg.cloud.pairing import Pair, Pairing
from topo_region_seg.cloud.pointcloud2 import encode
from topo_region_seg.cloud.stamp import stamp_of
from topo_region_seg.data import Cloud
from topo_region_seg.offline.bags.decoding import decode_record
from topo_region_seg.offline.bags.records import BagReader, Record, Topic
from topo_region_seg.offline.bags.types import bag_types
from topo_region_seg.params import THINNABLE

IMAGES = "images"
"""Encoding of a record that is made of images."""
MOST_POINTS = THINNABLE * 4_000_000
"""Images with more pixels are refused; the limit of the parameters comes after that."""


NEAR = 30
"""Messages of camera_info before and after an image that are looked at for one that fits it."""


@dataclass(frozen=True)
class ImageTopic(Topic):
    """The topic of depth images that stand for clouds, with what belongs to it.

    Parameters
    ----------
    info : str
        Topic of camera_info; empty where the recording has none for it.
    color : str
        Topic of the registered color images; empty for none.
    """

    info: str = ""
    color: str = ""

    def __str__(self) -> str:
        """Return what the clouds are made of, for people."""
        color = f"colors of {self.color}" if self.color else "without color"
        return f"clouds made of depth images, with {self.info or 'no camera_info'}, {color}"


@dataclass(frozen=True)
class ImageRecord(Record):
    """A depth image with its partners, decoded.

    `parts` are the records that it is made of: camera_info and color image where there are any, the depth image last.
    `failure` says why there is no cloud of it.
    """

    depth: Any = None
    camera: Any = None
    picture: Any = None
    parts: tuple[Record, ...] = ()
    failure: CloudFormatError | None = None

    def message(self) -> Any:
        """Return the cloud as a PointCloud2.

        Raises
        ------
        CloudFormatError
            An image cannot be read, or what belongs to it is missing.
        """
        if self.failure is not None:
            raise self.failure
        cloud = decode_depth(
            self.depth, self.camera, self.picture, max_points=MOST_POINTS, rectified=is_rectified(self.topic)
        )
        columns = {name: np.ascontiguousarray(cloud.xyz[:, axis]) for axis, name in enumerate("xyz")}
        if cloud.rgb is not None:
            columns["rgb"] = _packed(cloud)
        return encode(bag_types(), self.depth.header, columns, height=cloud.height, width=cloud.width, is_dense=False)


class _Read(NamedTuple):
    """A record and its message, None where it cannot be decoded."""

    record: Record
    msg: Any


def image_records(reader: BagReader, topic: ImageTopic) -> Iterator[ImageRecord]:
    """Iterate over the depth images of a topic, each with its partners, in the order of their log times.

    One without a partner comes too: reading its cloud says what is missing.
    """
    infos = _Infos(reader, topic)
    if not topic.color:
        for record in reader.messages([topic.name]):
            yield _found(topic, _read(record), infos)
        return
    pairing: Pairing[_Read, _Read] = Pairing()
    for record in reader.messages([topic.name, topic.color]):
        read = _read(record)
        pairs: list[Pair[_Read, _Read]] = []
        if read.msg is None:
            if record.topic == topic.name:
                yield _found(topic, read, infos)
        elif record.topic == topic.color:
            pairs = pairing.add_color(stamp_of(read.msg), read)
        else:
            pairs = pairing.add_depth(stamp_of(read.msg), read)
        for pair in pairs:
            yield _paired(topic, pair, infos, pairing.period)
    for pair in pairing.flush():
        yield _paired(topic, pair, infos, pairing.period)


def _paired(topic: ImageTopic, pair: Pair[_Read, _Read], infos: _Infos, period: float) -> ImageRecord:
    if pair.color is not None:
        return _found(topic, pair.depth, infos, pair.color)
    if pair.apart is None:
        failure = CloudFormatError("no_color", f"no color image on {topic.color} near the depth image's time")
    else:
        failure = CloudFormatError(
            "color_apart",
            f"color and depth stamps differ by {pair.apart:.3g} s at least, which is more than half a period of "
            f"{period:.3g} s",
        )
    return replace(_found(topic, pair.depth, infos), failure=failure)


def _found(topic: ImageTopic, depth: _Read, infos: _Infos, color: _Read | None = None) -> ImageRecord:
    failure, info = None, None
    if depth.msg is None:
        failure = CloudFormatError("undecodable", f"not a serialized {depth.record.type}")
    elif (info := infos.of(depth.msg)) is None:
        failure = CloudFormatError(
            "no_camera_info", f"the recording has no camera_info for {topic.name}; record it along with the images"
        )
    return ImageRecord(
        topic.name,
        topic.type,
        depth.record.log_time,
        b"",
        IMAGES,
        depth.msg,
        info.msg if info else None,
        color.msg if color else None,
        tuple(part.record for part in (info, color, depth) if part is not None),
        failure,
    )


class _Infos:
    """The camera_info messages of a topic by stamp."""

    def __init__(self, reader: BagReader, topic: ImageTopic) -> None:
        read = map(_read, reader.messages([topic.info]))
        self._infos = sorted((info for info in read if info.msg is not None), key=lambda info: stamp_of(info.msg))
        self._stamps = [stamp_of(info.msg) for info in self._infos]

    def of(self, depth: Any) -> _Read | None:
        """Return the last one before an image that fits its size, as a camera may change; else the first after it."""
        place = bisect_right(self._stamps, stamp_of(depth))
        near = self._infos[max(place - NEAR, 0) : place + NEAR]
        before, backwards = [info.msg for info in near[: min(place, NEAR)]], [info.msg for info in near[::-1]]
        chosen = choose_info(before, depth) or choose_info(backwards, depth)
        return next((info for info in near if info.msg is chosen), near[-1] if near else None)


def _read(record: Record) -> _Read:
    try:
        return _Read(record, decode_record(record))
    except CloudFormatError:
        return _Read(record, None)


def _packed(cloud: Cloud) -> Any:
    """Return the colors of a cloud as one float32 a point, as drivers pack them."""
    assert cloud.rgb is not None
    red, green, blue = cloud.rgb.astype(np.uint32).T
    return (red << np.uint32(16) | green << np.uint32(8) | blue).view(np.float32)
