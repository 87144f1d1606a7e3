# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""ROS 1 bags without an index, as a killed recorder leaves them: read by a walk over their records."""

from __future__ import annotations

import bz2
import os
import struct
from collections import Counter
from collections.abc import Collection, Iterator
from pathlib import Path
from typing import NamedTuple

import lz4.frame

from topo_region_seg.offline.bags.records import BagError, BagReader, Record, Storage, Topic, merge_topics, ros2_name
from topo_region_seg.offline.bags.recovery.mcap_chunks import MAX_CHUNK_BYTES

MAGIC = b"#ROSBAG V2.0\n"
MESSAGE, CHUNK, CONNECTION = 2, 5, 7
MAX_HEADER = 2**20
NANOSECONDS = 1_000_000_000


class _Connection(NamedTuple):
    topic: str
    type: str


class _Entry(NamedTuple):
    """A message; sorts as read: by time, then as in the file. `chunk` is the place of the chunk in the file."""

    log_time: int
    chunk: int
    start: int
    end: int
    connection: int


class Ros1Scan(BagReader):
    """A ROS 1 bag that is cut short: all whole messages of it, those of a chunk that is cut included."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.problems = []
        self.truncated = True
        self._connections: dict[int, _Connection] = {}
        self._entries: list[_Entry] = []
        self._cached: tuple[int, bytes] = (-1, b"")
        self._file = path.open("rb")
        try:
            self._scan(os.fstat(self._file.fileno()).st_size)
            if not self._entries:
                raise BagError(f"{path}: is cut short before its first whole message; record it again")
        except BaseException:
            self._file.close()
            raise
        counts = Counter(entry.connection for entry in self._entries)
        self.topics = merge_topics([Topic(c.topic, c.type, counts[number]) for number, c in self._connections.items()])

    def messages(self, topics: Collection[str]) -> Iterator[Record]:
        """Iterate over the messages of some topics in the order of log times."""
        wanted = {number for number, connection in self._connections.items() if connection.topic in topics}
        for entry in sorted(entry for entry in self._entries if entry.connection in wanted):
            connection = self._connections[entry.connection]
            data = self._chunk(entry.chunk)[entry.start : entry.end]
            yield Record(connection.topic, connection.type, entry.log_time, data, "ros1")

    def storage(self) -> Storage:
        """Return how the recording is stored."""
        times = [entry.log_time for entry in self._entries]
        return Storage("ROS 1 bag", 1, (), (min(times), max(times)))

    def close(self) -> None:
        """Close the file."""
        self._file.close()

    def _scan(self, size: int) -> None:
        position = len(MAGIC)
        while position + 4 <= size:
            self._file.seek(position)
            head = _fields(self._file.read(4 + MAX_HEADER), 0)
            if head is None:
                return
            fields, length = head
            self._file.seek(position + length)
            counted = self._file.read(4)
            if len(counted) < 4:
                return
            (data_length,) = struct.unpack("<I", counted)
            if _op(fields) == CHUNK:
                data = self._chunk(position)
                for entry in self._inside(data, position):
                    self._entries.append(entry)
            position += length + 4 + data_length

    def _chunk(self, position: int) -> bytes:
        """Return the records of a chunk, decompressed as far as they go."""
        if self._cached[0] == position:
            return self._cached[1]
        self._file.seek(position)
        head = _fields(self._file.read(4 + MAX_HEADER), 0)
        data = b""
        if head is not None:
            fields, length = head
            self._file.seek(position + length)
            (size,) = struct.unpack("<I", self._file.read(4))
            packed = self._file.read(size)
            try:
                data = _decompress(fields.get("compression", b"none"), packed)
            except (OSError, EOFError, RuntimeError, ValueError) as error:
                self.problems.append(f"{self.path}: chunk at byte {position}: {' '.join(str(error).split())}")
        self._cached = position, data
        return data

    def _inside(self, data: bytes, position: int) -> Iterator[_Entry]:
        offset = 0
        while (head := _fields(data, offset)) is not None:
            fields, length = head
            offset += length
            if offset + 4 > len(data):
                return
            (size,) = struct.unpack_from("<I", data, offset)
            start, offset = offset + 4, offset + 4 + size
            if offset > len(data):
                return
            number = struct.unpack("<I", fields["conn"])[0] if len(fields.get("conn", b"")) == 4 else -1
            if _op(fields) == CONNECTION:
                self._learn(number, fields, data[start:offset])
            elif _op(fields) == MESSAGE and number in self._connections and len(fields.get("time", b"")) == 8:
                seconds, nanoseconds = struct.unpack("<II", fields["time"])
                yield _Entry(seconds * NANOSECONDS + nanoseconds, position, start, offset, number)

    def _learn(self, number: int, fields: dict[str, bytes], data: bytes) -> None:
        described = _pairs(data) or {}
        topic, kind = fields.get("topic", b"").decode("utf-8", "replace"), described.get("type", b"")
        self._connections.setdefault(number, _Connection(topic, ros2_name(kind.decode("utf-8", "replace"))))


def _fields(data: bytes, offset: int) -> tuple[dict[str, bytes], int] | None:
    """Read the header of a record; return it with its length, None where it is cut or no header."""
    if offset + 4 > len(data):
        return None
    (length,) = struct.unpack_from("<I", data, offset)
    if length > MAX_HEADER or offset + 4 + length > len(data):
        return None
    pairs = _pairs(data[offset + 4 : offset + 4 + length])
    return None if pairs is None else (pairs, 4 + length)


def _pairs(data: bytes) -> dict[str, bytes] | None:
    """Read ``name=value`` fields, each after its length; None where they do not fit."""
    found: dict[str, bytes] = {}
    offset = 0
    while offset < len(data):
        if offset + 4 > len(data):
            return None
        (length,) = struct.unpack_from("<I", data, offset)
        field = data[offset + 4 : offset + 4 + length]
        name, equals, value = field.partition(b"=")
        if len(field) != length or not equals:
            return None
        found[name.decode("utf-8", "replace")] = value
        offset += 4 + length
    return found


def _op(fields: dict[str, bytes]) -> int:
    return fields.get("op", b"\0")[0] if fields.get("op") else 0


def _decompress(compression: bytes, packed: bytes) -> bytes:
    if compression == b"none":
        return packed
    if compression == b"bz2":
        return bz2.BZ2Decompressor().decompress(packed, MAX_CHUNK_BYTES)
    if compression == b"lz4":
        return bytes(lz4.frame.LZ4FrameDecompressor().decompress(packed, max_length=MAX_CHUNK_BYTES))
    raise ValueError(f"unknown compression {compression!r}")
