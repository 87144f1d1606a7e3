# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""ROS 1 bags that are cut short or damaged: all whole messages, found by a walk over their records."""

from __future__ import annotations

import bz2
import struct
from collections import Counter
from collections.abc import Collection, Iterator
from pathlib import Path
from typing import NamedTuple

import lz4.frame

from topo_region_seg.offline.bags.records import BagError, BagReader, Record, Storage, Topic, merge_topics, ros2_name
from topo_region_seg.offline.bags.recovery.bounded import BoundedFile
from topo_region_seg.offline.bags.recovery.mcap_chunks import MAX_CHUNK_BYTES

MAGIC = b"#ROSBAG V2.0\n"
MESSAGE, BAG_HEADER, INDEX, CHUNK, CONNECTION = 2, 3, 4, 5, 7
MAX_HEADER = 2**20
NANOSECONDS = 1_000_000_000


class _Connection(NamedTuple):
    topic: str
    type: str


class _Record(NamedTuple):
    """A record of the file: the fields of its header, and where its data lies."""

    fields: dict[str, bytes]
    start: int
    end: int


class _Entry(NamedTuple):
    """A message; sorts as read: by time, then as in the file. `chunk` is the place of the chunk in the file."""

    log_time: int
    chunk: int
    start: int
    end: int
    connection: int


class _DamageError(Exception):
    """A chunk is damaged."""


class Ros1Scan(BagReader):
    """A ROS 1 bag that rosbags refuses: all whole messages of it, those of a chunk that is cut included.

    Chunks that do not decompress, or whose records do not fit them, go to `problems`; the others are still read.

    Raises
    ------
    BagError
        No message of it is whole.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.problems = []
        self._connections: dict[int, _Connection] = {}
        self._entries: list[_Entry] = []
        self._cached: tuple[int, bytes] = (-1, b"")
        self._file = BoundedFile(path)
        try:
            self.truncated = not self._scan()
            known = [entry for entry in self._entries if entry.connection in self._connections]
            if lost := len(self._entries) - len(known):
                self.problems.append(f"{path}: {lost} messages of topics that no whole part of the file describes")
            self._entries = known
            if not known:
                reason = "".join(f" ({problem.removeprefix(f'{path}: ')})" for problem in self.problems[:1])
                what = "cut short" if self.truncated else "damaged"
                raise BagError(f"{path}: is {what} before its first whole message{reason}; record it again")
        except BaseException:
            self._file.close()
            raise
        if not self.truncated and not self.problems:
            self.problems.append(f"{path}: its index is damaged; {len(self._entries)} messages were found without it")
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

    def _scan(self) -> bool:
        """Visit record by record; return whether the file is whole: closed by its recorder, its last record there."""
        position, closed = len(MAGIC), False
        while (record := _record(self._file, position)) is not None:
            if _op(record.fields) == BAG_HEADER:
                closed = any(record.fields.get("index_pos", b""))
            elif _op(record.fields) == CONNECTION:
                self._file.seek(record.start)
                self._learn(record.fields, self._file.read(record.end - record.start))
            elif _op(record.fields) == CHUNK:
                try:
                    self._entries += self._inside(self._chunk(position), position, cut=record.end > self._file.length)
                except _DamageError as error:
                    self.problems.append(f"{self.path}: chunk at byte {position}: {error}")
            position = record.end
        return closed and position == self._file.length

    def _chunk(self, position: int) -> bytes:
        """Return the records of a chunk, decompressed as far as they go where the file ends in it."""
        if self._cached[0] == position:
            return self._cached[1]
        record = _record(self._file, position)
        if record is None:
            raise _DamageError("there is no chunk")
        self._file.seek(record.start)
        packed = self._file.read(record.end - record.start)
        field = record.fields.get("size", b"")
        claimed = struct.unpack("<I", field)[0] if len(field) == 4 else MAX_CHUNK_BYTES
        try:
            # Never more than is claimed, whatever the compressed data says of itself.
            data = _decompress(record.fields.get("compression", b"none"), packed, min(claimed + 1, MAX_CHUNK_BYTES))
        except (OSError, EOFError, RuntimeError, ValueError, MemoryError) as error:
            raise _DamageError(f"does not decompress ({' '.join(str(error).split()) or 'memory is short'})") from None
        if record.end <= self._file.length and len(field) == 4 and len(data) != claimed:
            raise _DamageError(f"claims {claimed} bytes uncompressed, which is not what it holds")
        self._cached = position, data
        return data

    def _inside(self, data: bytes, position: int, *, cut: bool) -> Iterator[_Entry]:
        """Yield the whole messages of a chunk; one that is not `cut` must consist of whole records."""
        offset = 0
        while (head := _fields(data, offset)) is not None:
            fields, length = head
            start = offset + length + 4
            if start > len(data):
                break
            end = start + struct.unpack_from("<I", data, start - 4)[0]
            if end > len(data):
                break
            offset = end
            if _op(fields) == CONNECTION:
                self._learn(fields, data[start:end])
            elif _op(fields) == MESSAGE and len(fields.get("time", b"")) == 8:
                seconds, nanoseconds = struct.unpack("<II", fields["time"])
                yield _Entry(seconds * NANOSECONDS + nanoseconds, position, start, end, _connection(fields))
        if offset != len(data) and not cut:
            raise _DamageError(f"its records are damaged from byte {offset} of {len(data)} on")

    def _learn(self, fields: dict[str, bytes], data: bytes) -> None:
        number, described = _connection(fields), _pairs(data) or {}
        if number < 0:
            return
        topic, kind = fields.get("topic", b"").decode("utf-8", "replace"), described.get("type", b"")
        self._connections.setdefault(
            _connection(fields), _Connection(topic, ros2_name(kind.decode("utf-8", "replace")))
        )


def count_records(path: Path) -> tuple[int, int] | None:
    """Return how many chunks a bag has and how many indexes after them; None where its records do not lead to its end.

    Only the heads of records are read.
    """
    position, found = len(MAGIC), Counter[int]()
    with BoundedFile(path) as file:
        while (record := _record(file, position)) is not None:
            found[_op(record.fields)] += 1
            position = record.end
        return (found[CHUNK], found[INDEX]) if position == file.length else None


def _record(file: BoundedFile, position: int) -> _Record | None:
    """Read the head of the record at a place of the file; None where the file ends before its data."""
    file.seek(position)
    counted = file.read(4)
    if len(counted) < 4:
        return None
    length = min(struct.unpack("<I", counted)[0], MAX_HEADER + 1)
    head = _fields(counted + file.read(length), 0)
    counted = file.read(4)
    if head is None or len(counted) < 4:
        return None
    start = position + head[1] + 4
    return _Record(head[0], start, start + struct.unpack("<I", counted)[0])


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


def _connection(fields: dict[str, bytes]) -> int:
    """Return the number of the connection that a record is of, -1 where it names none."""
    return int(struct.unpack("<I", fields["conn"])[0]) if len(fields.get("conn", b"")) == 4 else -1


def _op(fields: dict[str, bytes]) -> int:
    return fields.get("op", b"\0")[0] if fields.get("op") else 0


def _decompress(compression: bytes, packed: bytes, limit: int) -> bytes:
    if compression == b"none":
        return packed
    if compression == b"bz2":
        return bz2.BZ2Decompressor().decompress(packed, limit)
    if compression == b"lz4":
        return bytes(lz4.frame.LZ4FrameDecompressor().decompress(packed, max_length=limit))
    raise ValueError(f"unknown compression {compression!r}")
