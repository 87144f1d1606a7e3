# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""What to do where depth images come, but not what belongs to them: one line each."""

from __future__ import annotations

from rclpy.node import Node

INFO_TYPE = "sensor_msgs/msg/CameraInfo"
IMAGE_TYPE, PACKED_TYPE = "sensor_msgs/msg/Image", "sensor_msgs/msg/CompressedImage"
PACKED = "/compressed"
"""What image_transport appends to the topics of packed color images."""
NAMED = 4


def no_camera_info(node: Node, depth: str, info: str) -> str:
    """Say that no camera_info comes, and where there is some."""
    text = f"depth images come on {depth}, but no camera_info on {info}"
    if node.count_publishers(info):
        return f"{text}, although it has a publisher: does it publish now?"
    # Most drivers have them side by side.
    beside = f"{depth.rpartition('/')[0]}/camera_info"
    others = sorted(topics_of(node, INFO_TYPE), key=lambda name: (name != beside, "depth" not in name, name))
    return text + remapping("depth/camera_info", others, "sensor_msgs/CameraInfo")


def no_color(node: Node, depth: str, color: str) -> str:
    """Say that no color images come, where there are some, and how to do without."""
    text = f"depth images come on {depth}, but no color images on {color}"
    without = "; or set features to 'normals', which need no color"
    if node.count_publishers(color):
        return f"{text}, although it has a publisher: does it publish now?{without}"
    packed = color.endswith(PACKED)
    kind = PACKED_TYPE if packed else IMAGE_TYPE
    others = [name.removesuffix(PACKED) for name in topics_of(node, kind) if name.endswith(PACKED) or not packed]
    others = sorted(
        (name for name in others if name != depth),
        key=lambda name: ("depth" in name, "color" not in name and "rgb" not in name, name),
    )
    text += remapping("color/image", others, kind.replace("/msg", ""))
    if not packed and node.count_publishers(color + PACKED):
        text += f"; or set color_transport to {PACKED[1:]} for {color}{PACKED}"
    return text + without


def color_apart(depth: str, color: str, apart: float, period: float) -> str:
    """Say by how much the stamps of color and depth images differ, seconds."""
    return (
        f"color and depth stamps differ by {apart:.3g} s at least, which is more than half a period of {period:.3g} s: "
        f"{color} and {depth} must be of one camera and clock; let its driver synchronize them"
    )


def other_size(depth: str, info: str, size: tuple[int, int] | None, described: tuple[int, int]) -> str:
    """Say that images are of another size than camera_info says; sizes are (height, width)."""
    height, width = size or (0, 0)
    return (
        f"depth images on {depth} have {width} x {height} pixels, but camera_info on {info} describes images of "
        f"{described[1]} x {described[0]}; remap depth/camera_info to that of the same images"
    )


def topics_of(node: Node, kind: str) -> list[str]:
    """Return the topics of a type that somebody publishes."""
    return [name for name, kinds in node.get_topic_names_and_types() if kind in kinds and node.count_publishers(name)]


def remapping(name: str, topics: list[str], kind: str) -> str:
    """Return the end of a sentence: what a topic may be remapped to."""
    if not topics:
        return f": nobody publishes {kind}; is the camera driver running?"
    remaps = " or ".join(f"-r {name}:={topic}" for topic in topics[:NAMED])
    more = f" (and {len(topics) - NAMED} more)" if len(topics) > NAMED else ""
    return f": nobody publishes there; remap with --ros-args {remaps}{more}"
