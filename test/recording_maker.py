# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""sqlite3 and ROS 1 recordings of the kinds that recorders of all versions write."""

from __future__ import annotations

import itertools
import sqlite3
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import zstandard
from bag_maker import Entry, ros1_message
from rosbags.rosbag1 import Writer as Ros1Writer
from rosbags.typesys import Stores, get_typestore

from topo_region_seg.offline.bags.types import typestore


@dataclass(frozen=True)
class SqliteKind:
    """What a recorder of rosbag2 does with sqlite3."""

    version: int = 9
    """Of metadata.yaml: 2 is Dashing's, 4 Foxy's, 5 Humble's, 8 and 9 Iron's and Jazzy's."""
    page_size: int = 4096
    journal: str = "delete"
    index: bool = True
    packed: str = ""
    """ "file" or "message": compressed with zstd."""
    folder: bool = True

    @property
    def name(self) -> str:
        return "-".join(map(str, vars(self).values()))


@dataclass(frozen=True)
class Ros1Kind:
    """What a recorder of ROS 1 does."""

    compression: str = "none"
    chunk_threshold: int = 768 * 1024
    connections: int = 1
    latching: int | None = None
    in_order: bool = True

    @property
    def name(self) -> str:
        return "-".join(map(str, vars(self).values()))


def sqlite_kinds() -> list[SqliteKind]:
    """Return every version with every compression, in turn with page sizes, journals and indexes."""
    core = itertools.product((2, 4, 5, 8, 9), ("", "file", "message"))
    sizes, journals = itertools.cycle((512, 4096, 65536, 1024)), itertools.cycle(("delete", "wal", "off"))
    indexes = itertools.cycle((True, False))
    found = [SqliteKind(version, next(sizes), next(journals), next(indexes), packed) for version, packed in core]
    plain = itertools.product((2, 5, 9), (512, 65536), ("delete", "wal"))
    return found + [SqliteKind(version, size, journal, folder=False) for version, size, journal in plain]


def ros1_kinds() -> list[Ros1Kind]:
    """Return every compression with chunks of one, some and all messages, one or two publishers, in order or not."""
    core = itertools.product(("none", "bz2", "lz4"), (0, 40_000, 10**7), (1, 2), (None, 1), (True, False))
    return [Ros1Kind(*values) for values in core]


def write_sqlite(folder: Path, entries: Sequence[Entry], kind: SqliteKind) -> Path:
    """Write a rosbag2 folder, or a plain .db3 file; return its path."""
    folder.mkdir()
    path = folder / "bag_0.db3"
    topics = list(dict.fromkeys((topic, name) for topic, name, _, _ in entries))
    connection = sqlite3.connect(path)
    connection.execute(f"PRAGMA page_size = {kind.page_size}")
    connection.execute(f"PRAGMA journal_mode = {kind.journal}")
    _schema(connection, kind)
    for number, (topic, name) in enumerate(topics, 1):
        more = [[], [""], ["", ""]][0 if kind.version < 4 else 1 if kind.version < 8 else 2]
        values = [number, topic, name, "cdr", *more]
        connection.execute(f"INSERT INTO topics VALUES ({', '.join('?' * len(values))})", values)
        if kind.version >= 8:
            text = typestore().generate_msgdef(name, ros_version=2)[0]
            row = (number, name, "ros2msg", text, "")
            connection.execute("INSERT INTO message_definitions VALUES (?, ?, ?, ?, ?)", row)
    for topic, name, log_time, message in entries:
        data = bytes(typestore().serialize_cdr(message, name))
        if kind.packed == "message":
            data = zstandard.ZstdCompressor().compress(data)
        row = (topics.index((topic, name)) + 1, log_time, data)
        connection.execute("INSERT INTO messages (topic_id, timestamp, data) VALUES (?, ?, ?)", row)
    connection.commit()
    connection.close()
    if kind.packed == "file":
        packed = path.with_name("bag_0.db3.zstd")
        packed.write_bytes(zstandard.ZstdCompressor().compress(path.read_bytes()))
        path.unlink()
        path = packed
    if not kind.folder:
        return path
    (folder / "metadata.yaml").write_text(_metadata(path.name, entries, topics, kind))
    return folder


def _schema(connection: sqlite3.Connection, kind: SqliteKind) -> None:
    qos = ", offered_qos_profiles TEXT NOT NULL" if kind.version >= 4 else ""
    hash_ = ", type_description_hash TEXT NOT NULL" if kind.version >= 8 else ""
    connection.executescript(
        f"CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL,"
        f" serialization_format TEXT NOT NULL{qos}{hash_});"
        "CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL,"
        " timestamp INTEGER NOT NULL, data BLOB NOT NULL);"
    )
    if kind.index:
        connection.execute("CREATE INDEX timestamp_idx ON messages (timestamp ASC)")
    if kind.version >= 8:
        connection.executescript(
            "CREATE TABLE schema(schema_version INTEGER PRIMARY KEY, ros_distro TEXT NOT NULL);"
            "CREATE TABLE metadata(id INTEGER PRIMARY KEY, metadata_version INTEGER NOT NULL, metadata TEXT NOT NULL);"
            "CREATE TABLE message_definitions(id INTEGER PRIMARY KEY, topic_type TEXT NOT NULL,"
            " encoding TEXT NOT NULL, encoded_message_definition TEXT NOT NULL, type_description_hash TEXT NOT NULL);"
            "INSERT INTO schema VALUES (4, 'jazzy');"
        )


def _metadata(name: str, entries: Sequence[Entry], topics: list[tuple[str, str]], kind: SqliteKind) -> str:
    times = [log_time for _, _, log_time, _ in entries]
    lines = [
        "rosbag2_bagfile_information:",
        f"  version: {kind.version}",
        "  storage_identifier: sqlite3",
        f"  relative_file_paths: [{name}]",
        f"  duration: {{nanoseconds: {max(times) - min(times)}}}",
        f"  starting_time: {{nanoseconds_since_epoch: {min(times)}}}",
        f"  message_count: {len(entries)}",
        "  topics_with_message_count:",
    ]
    for topic, type_ in topics:
        qos = "[]" if kind.version >= 9 else "''"
        more = f", offered_qos_profiles: {qos}" if kind.version >= 4 else ""
        more += ", type_description_hash: ''" if kind.version >= 8 else ""
        count = sum(entry[:2] == (topic, type_) for entry in entries)
        lines.append(
            f"    - {{topic_metadata: {{name: {topic}, type: {type_}, serialization_format: cdr{more}}},"
            f" message_count: {count}}}"
        )
    if kind.version >= 4 or kind.packed:
        lines += [
            f"  compression_format: '{'zstd' if kind.packed else ''}'",
            f"  compression_mode: '{kind.packed.upper()}'",
        ]
    return "\n".join(lines) + "\n"


def write_ros1(path: Path, entries: Sequence[Entry], kind: Ros1Kind) -> Path:
    """Write a ROS 1 bag."""
    store = get_typestore(Stores.ROS1_NOETIC)
    writer = Ros1Writer(path)
    if kind.compression != "none":
        writer.set_compression(Ros1Writer.CompressionFormat[kind.compression.upper()])
    writer.chunk_threshold = kind.chunk_threshold
    connections: dict[tuple[str, int], Any] = {}
    # Entries out of order change places in pairs, across the borders of chunks.
    order = list(range(len(entries)))
    if not kind.in_order:
        order[1:-1:2], order[2::2] = order[2::2], order[1:-1:2]
    with writer:
        for number in order:
            topic, name, log_time, message = entries[number]
            key = topic, number % kind.connections
            if key not in connections:
                caller = f"/node{key[1]}"
                connections[key] = writer.add_connection(
                    topic, name, typestore=store, callerid=caller, latching=kind.latching
                )
            data = store.serialize_ros1(ros1_message(store, message, number), name)
            writer.write(connections[key], log_time, data)
    return path
