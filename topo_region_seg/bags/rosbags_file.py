# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Recordings that rosbags reads: ROS 1 bags, sqlite3 storage, compressed rosbag2 folders."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator
from pathlib import Path
from typing import Any

from rosbags.interfaces import MessageDefinitionFormat
from rosbags.rosbag1 import Reader as Ros1Reader
from rosbags.rosbag2 import Reader as Ros2Reader

from topo_region_seg.bags.records import BagError, BagReader, Record, Storage, Topic, merge_topics
from topo_region_seg.bags.ros1_scan import Ros1Scan


class RosbagsFile(BagReader):
    """A recording behind one of rosbags' readers."""

    def __init__(self, path: Path, reader: Callable[[Path], Any], mend: str) -> None:
        self.path = path
        self.problems = []
        self._mend = mend
        try:
            self._reader = reader(path)
            self._reader.open()
        except Exception as error:  # rosbags lets those of its storage libraries through
            raise BagError(f"{path}: {_one_line(error)}; {mend}") from error
        self._ros1 = isinstance(self._reader, Ros1Reader)
        self.topics = merge_topics(
            [
                Topic(
                    c.topic,
                    c.msgtype,
                    c.msgcount,
                    c.msgdef.data if c.msgdef.format is MessageDefinitionFormat.MSG and not self._ros1 else "",
                )
                for c in self._reader.connections
            ]
        )

    def messages(self, topics: Collection[str]) -> Iterator[Record]:
        """Iterate over the messages of some topics in the order of log times."""
        connections = [c for c in self._reader.connections if c.topic in topics]
        if not connections:
            return
        messages = self._reader.messages(connections)
        while True:
            try:
                connection, log_time, data = next(messages)
            except StopIteration:
                return
            except Exception as error:  # the rest of the file cannot be trusted
                self.problems.append(f"{self.path}: {_one_line(error)}; the rest of the recording is left out")
                return
            yield Record(connection.topic, connection.msgtype, log_time, bytes(data), "ros1" if self._ros1 else "cdr")

    def storage(self) -> Storage:
        """Return how the recording is stored."""
        reader = self._reader
        times = (reader.start_time, reader.end_time - 1) if reader.message_count else None
        if self._ros1:
            return Storage("ROS 1 bag", 1, (), times)
        mode, packed = reader.compression_mode, reader.compression_format
        compression = (f"{packed} {mode}s",) if mode else ()
        parts = getattr(reader.storage, "storages", [reader.storage])
        kind = "mcap" if type(parts[0]).__name__ == "McapReader" else "sqlite3"
        return Storage(kind, len(parts), compression, times)

    def close(self) -> None:
        """Close the files."""
        self._reader.close()


def open_ros1(path: Path) -> BagReader:
    """Open a ROS 1 bag; one without an index, as a killed recorder leaves it, is read record by record."""
    try:
        return RosbagsFile(path, Ros1Reader, "if it is a ROS 1 bag, 'rosbag reindex' may mend it")
    except BagError:
        return Ros1Scan(path)


def open_ros2(path: Path) -> RosbagsFile:
    """Open a rosbag2 folder or .db3 file with rosbags' own storage readers."""
    return RosbagsFile(path, Ros2Reader, "'ros2 bag reindex' on the folder may mend it")


def _one_line(error: Exception) -> str:
    return " ".join(str(error).split()).rstrip(".") or type(error).__name__
