# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""What to do when no clouds come: said from what the graph shows."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from typing import Any

from rclpy.node import Node
from rclpy.qos import DurabilityPolicy

from topo_region_seg.cloud.messages.topics import CLOUDS
from topo_region_seg.ros.input import FrameSource
from topo_region_seg.ros.missing_images import remapping
from topo_region_seg.ros.transport import SHARED_MEMORY, fast_dds

CLOUD_TYPE = "sensor_msgs/msg/PointCloud2"
TYPES_OF_A_SEGMENTATION = {CLOUD_TYPE, "std_msgs/msg/UInt32", "visualization_msgs/msg/MarkerArray"}
"""What a node like this one publishes, whatever its topics are called."""
UNKNOWN = "_NODE_NAMESPACE_UNKNOWN_/_NODE_NAME_UNKNOWN_"
"""rclpy's name for a node of which no more is known than a topic."""
PACKED = "/compressedDepth"
HOST_BYTES = 4
"""Leading bytes of a GUID of Fast DDS that tell vendor and host."""


def advice(node: Node, source: FrameSource, heard: bool) -> str:
    """Return the rest of a sentence that begins with 'no clouds on ... for 5 s'; `heard`: there were some before."""
    publishers = node.get_publishers_info_by_topic(source.topic)
    if publishers:
        return _to_be_heard(node, source, publishers, heard)
    cameras = sorted(_cameras(node, source.kind))
    if source.kind != CLOUD_TYPE:
        base = source.topic.removesuffix(PACKED)
        if base != source.topic:  # what image_transport appends is not remapped
            cameras = [topic.removesuffix(PACKED) for topic in cameras if topic.endswith(PACKED)]
        cameras.sort(key=lambda topic: ("depth" not in topic, topic))
        if base == source.topic and node.count_publishers(base + PACKED):
            packed = f"; or set depth_transport to {PACKED[1:]} for {base}{PACKED}"
            return remapping(source.name, cameras, source.kind.replace("/msg", "")) + packed
    return remapping(source.name, cameras, source.kind.replace("/msg", ""))


def _to_be_heard(node: Node, source: FrameSource, publishers: list[Any], heard: bool) -> str:
    names = sorted({_full_name(info) for info in publishers} - {UNKNOWN})
    text = f", although {', '.join(names) or 'a node'} publishes there: does it publish now?"
    durabilities = {info.qos_profile.durability for info in publishers}
    if DurabilityPolicy.TRANSIENT_LOCAL in durabilities and not source.hears_the_past:
        name = source.durability_override()
        text += f" If it did before the node was there, its durability asks for -p {name}:=transient_local."
    if not heard and fast_dds() and _on_this_host(node, source.topic, publishers):
        text += (
            f" If it runs in another container, both must share the shared memory {SHARED_MEMORY} (--ipc=host), or set "
            "FASTDDS_BUILTIN_TRANSPORTS=UDPv4."
        )
    return text


def _cameras(node: Node, kind: str) -> list[str]:
    """Return the topics of a type that are not all made by nodes of this kind, by their names on the graph.

    rclpy remaps the topic that it is asked the publishers of, so the nodes are asked for their topics instead.
    """
    made_here = _topics_of_segmentations(node)
    return sorted(
        topic
        for topic, types in node.get_topic_names_and_types()
        if kind in types and topic.rpartition("/")[2] not in CLOUDS and node.count_publishers(topic) > made_here[topic]
    )


def _topics_of_segmentations(node: Node) -> Counter[str]:
    topics: Counter[str] = Counter()
    for name, namespace in node.get_node_names_and_namespaces():
        try:
            published = node.get_publisher_names_and_types_by_node(name, namespace)
        except Exception:
            continue  # rclpy's for a node that has just gone
        if {kind for _, types in published for kind in types} >= TYPES_OF_A_SEGMENTATION:
            topics.update(topic for topic, _ in published)
    return topics


def _on_this_host(node: Node, topic: str, publishers: Iterable[Any]) -> bool:
    own = [
        info
        for info in node.get_subscriptions_info_by_topic(topic)
        if _full_name(info) == node.get_fully_qualified_name()
    ]
    hosts = {tuple(info.endpoint_gid[:HOST_BYTES]) for info in own}
    return any(tuple(info.endpoint_gid[:HOST_BYTES]) in hosts for info in publishers)


def _full_name(info: Any) -> str:
    return f"{info.node_namespace.rstrip('/')}/{info.node_name}"
