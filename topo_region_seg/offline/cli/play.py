# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""``play``: a recording's clouds or images, published in ROS."""

from __future__ import annotations

import argparse
import math
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from topo_region_seg.offline.cli import status
from topo_region_seg.offline.cli.status import ToolError

if TYPE_CHECKING:
    from topo_region_seg.offline.bags.images import ImageTopic

DEFAULT_TOPIC = "points"
"""What region_segmentation_node listens to unless it is remapped."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the command's arguments."""
    parser.add_argument("bag", metavar="BAG", type=Path, help="a rosbag2 folder, a .mcap or a ROS 1 .bag")
    parser.add_argument("--topic", help="topic of the clouds, if the recording has several")
    parser.add_argument(
        "--remap-to",
        metavar="TOPIC",
        help=f"topic to publish clouds on (default: {DEFAULT_TOPIC}, the node's input)",
    )
    parser.add_argument(
        "--as-clouds",
        action="store_true",
        help="publish the clouds of a recording of depth images, in place of the images",
    )
    speed = parser.add_mutually_exclusive_group()
    speed.add_argument("--rate", type=_positive, default=1.0, help="speed as a factor of the recorded one (default: 1)")
    speed.add_argument("--hz", type=_positive, help="clouds a second, instead of the recorded times")
    parser.add_argument("--loop", action="store_true", help="begin again at the end, until Ctrl-C")
    parser.add_argument("--qos", choices=("reliable", "best_effort"), default="reliable", help="default: reliable")
    parser.add_argument("--stamp", choices=("recorded", "now"), default="recorded", help="default: recorded")
    parser.add_argument(
        "--wait-for", metavar="N", type=_count, default=1, help="start when N subscribe (default: 1; 0: at once)"
    )
    parser.add_argument(
        "--wait-timeout", metavar="SECONDS", type=_positive, default=math.inf, help="give up waiting (default: never)"
    )


def run(args: argparse.Namespace) -> int:
    """Publish the clouds, or the images that they are made of."""
    from topo_region_seg.cloud.pointcloud2 import CloudFormatError
    from topo_region_seg.offline.bags import open_bag
    from topo_region_seg.offline.bags.clouds import cdr, cloud_records, cloud_topic
    from topo_region_seg.offline.bags.images import ImageRecord, ImageTopic
    from topo_region_seg.offline.cli.console import note, progress

    with open_bag(args.bag) as reader:
        topic = cloud_topic(reader, args.topic)
        try:
            from topo_region_seg.ros.player import Images, NobodySubscribedError, Playback, play
        except ImportError as error:
            raise ToolError(
                f"rclpy cannot be imported ({error}); run pip install '.[ros]', or source /opt/ros/jazzy/setup.bash"
            ) from None
        images = {}
        if isinstance(topic, ImageTopic) and not args.as_clouds:
            if args.remap_to:
                raise ToolError("--remap-to is for clouds; use --ros-args -r depth/image:=TOPIC, or give --as-clouds")
            images = image_names(topic)
        failed: list[str] = []

        def clouds() -> Iterator[tuple[int, bytes | Images]]:
            for record in cloud_records(reader, topic):
                try:
                    if images and isinstance(record, ImageRecord):
                        yield record.log_time, {images[part.topic]: cdr(part) for part in record.parts}
                    else:
                        yield record.log_time, cdr(record)
                except CloudFormatError as error:
                    failed.append(f"{args.bag}: cloud of log time {record.log_time}: {error}")

        playback = Playback(
            topic=images[topic.name] if images else args.remap_to or DEFAULT_TOPIC,
            rate=args.rate,
            hz=args.hz,
            loop=args.loop,
            reliable=args.qos == "reliable",
            stamp_now=args.stamp == "now",
            wait_for=args.wait_for,
            wait_timeout=args.wait_timeout,
            images={images[part.name]: part.type for part in reader.topics if part.name in images},
        )
        with progress("publishing", None if args.loop else topic.count) as step:
            try:
                played = play(clouds, playback, report=note, step=step, ros_arguments=args.ros_arguments)
            except NobodySubscribedError as error:
                raise ToolError(f"{args.bag}: {error}; start the node first, or give --wait-for 0") from None
        what = "depth image" if images else "cloud"
        count = f"{played.published} {what}{'' if played.published == 1 else 's'}"
        but = f", but {played.unheard}" if played.unheard else ""
        note(f"published {count} of {topic.name} on {playback.topic}{but}")
        for line in (*dict.fromkeys(failed), *reader.problems):
            note(f"left out: {line}")
        if failed or reader.problems or played.unheard:
            return status.FAILED
        return status.TRUNCATED if reader.truncated else status.DONE


def image_names(topic: ImageTopic) -> dict[str, str]:
    """Return where each recorded topic of a camera is published: on the node's inputs, packed as it was recorded."""
    from topo_region_seg.offline.bags.image_topics import packing

    names = {topic.name: f"depth/image{packing(topic.name)}", topic.info: "depth/camera_info"}
    names[topic.color] = f"color/image{packing(topic.color)}"
    return {recorded: name for recorded, name in names.items() if recorded}


def _positive(text: str) -> float:
    value = float(text)
    if not value > 0.0:
        raise argparse.ArgumentTypeError(f"{text} is not greater than 0")
    return value


def _count(text: str) -> int:
    value = int(text)
    if value < 0:
        raise argparse.ArgumentTypeError(f"{text} is negative")
    return value
