# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Recordings for tests, written by other writers than the project's own where that matters."""

from __future__ import annotations

import struct
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import clouds
import numpy as np
from mcap.writer import CompressionType, Writer
from rosbags.rosbag1 import Writer as Ros1Writer
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as Ros2Writer
from rosbags.typesys import Stores, get_typestore

from topo_region_seg.offline.bags.types import typestore

CLOUD = "sensor_msgs/msg/PointCloud2"
COUNT = "std_msgs/msg/UInt32"
SECOND = 1_000_000_000

Entry = tuple[str, str, int, Any]
"""Topic, type, log time in ns, message or raw bytes."""


def cloud_entries(n: int = 3, topic: str = "/camera/points", start: int = 1) -> list[Entry]:
    """Small clouds at whole seconds, whose points tell which one it is."""
    entries = []
    for i in range(start, start + n):
        xyz, rgb = clouds.scene(32, 24)
        xyz[0] = i
        entries.append((topic, CLOUD, i * SECOND, clouds.message(xyz, rgb, height=24, sec=i)))
    return entries


def count_entry(log_time: int = SECOND, topic: str = "/count") -> Entry:
    return (topic, COUNT, log_time, clouds.TYPES.UInt32(data=7))


def write_mcap(
    path: Path,
    entries: Sequence[Entry],
    *,
    chunk_size: int = 1,
    compression: CompressionType = CompressionType.ZSTD,
    definitions: dict[str, str] | None = None,
    encoding: str = "cdr",
    **options: Any,
) -> Path:
    """Write with the mcap library; `chunk_size` 1 puts every message into a chunk of its own."""
    channels: dict[str, int] = {}
    with path.open("wb") as file:
        writer = Writer(file, chunk_size=chunk_size, compression=compression, **options)
        writer.start(profile="ros2")
        for topic, kind, log_time, message in entries:
            if topic not in channels:
                text = (definitions or {}).get(kind) or typestore().generate_msgdef(kind, ros_version=2)[0]
                schema = writer.register_schema(kind, "ros2msg", text.encode())
                channels[topic] = writer.register_channel(topic, encoding, schema)
            data = message if isinstance(message, bytes) else bytes(typestore().serialize_cdr(message, kind))
            writer.add_message(channels[topic], log_time, data, log_time)
        writer.finish()
    return path


def write_folder(path: Path, entries: Sequence[Entry], plugin: StoragePlugin) -> Path:
    """Write a rosbag2 folder with rosbags."""
    with Ros2Writer(path, version=9, storage_plugin=plugin) as writer:
        connections: dict[str, Any] = {}
        for topic, kind, log_time, message in entries:
            if topic not in connections:
                connections[topic] = writer.add_connection(topic, kind, typestore=typestore())
            writer.write(connections[topic], log_time, typestore().serialize_cdr(message, kind))
    return path


def write_split_folder(path: Path, parts: Sequence[Sequence[Entry]]) -> Path:
    """Write a rosbag2 folder of several MCAP files, with the least metadata."""
    path.mkdir()
    names = [f"split_{i}.mcap" for i in range(len(parts))]
    for name, entries in zip(names, parts, strict=True):
        write_mcap(path / name, entries)
    listed = "".join(f"    - {name}\n" for name in names)
    (path / "metadata.yaml").write_text(
        f"rosbag2_bagfile_information:\n  version: 5\n  storage_identifier: mcap\n  relative_file_paths:\n{listed}"
    )
    return path


def write_ros1(path: Path, entries: Sequence[Entry]) -> Path:
    """Write a ROS 1 bag with rosbags."""
    store = get_typestore(Stores.ROS1_NOETIC)
    with Ros1Writer(path) as writer:
        connections: dict[str, Any] = {}
        for sequence, (topic, kind, log_time, message) in enumerate(entries):
            if topic not in connections:
                connections[topic] = writer.add_connection(topic, kind, typestore=store)
            data = store.serialize_ros1(ros1_message(store, message, sequence), kind)
            writer.write(connections[topic], log_time, data)
    return path


def chunks_of(path: Path) -> list[tuple[int, int]]:
    """Offset and end of every chunk record of an MCAP file."""
    data = path.read_bytes()
    found, offset = [], 8
    while offset + 9 <= len(data):
        opcode, length = struct.unpack_from("<BQ", data, offset)
        if opcode == 0x06:
            found.append((offset, offset + 9 + length))
        offset += 9 + length
    return found


def damage(path: Path, position: int) -> None:
    """Flip one bit."""
    data = bytearray(path.read_bytes())
    data[position] ^= 0x10
    path.write_bytes(data)


def first_x(message: Any) -> float:
    """The number that `cloud_entries` wrote into a cloud."""
    return float(np.frombuffer(message.data[:4].tobytes(), "<f4")[0])


def ros1_message(store: Any, message: Any, sequence: int) -> Any:
    if not hasattr(message, "header"):
        return store.types[message.__msgtype__](**{k: v for k, v in vars(message).items() if k != "__msgtype__"})
    head = message.header
    types = store.types
    stamp = types["builtin_interfaces/msg/Time"](sec=head.stamp.sec, nanosec=head.stamp.nanosec)
    values = {name: getattr(message, name) for name in message.__dataclass_fields__ if name != "__msgtype__"}
    values["header"] = types["std_msgs/msg/Header"](seq=sequence, stamp=stamp, frame_id=head.frame_id)
    kind = types[message.__msgtype__]
    # D, K, R and P of CameraInfo are small in ROS 2.
    return kind(**{name if name in kind.__dataclass_fields__ else name.upper(): values[name] for name in values})
