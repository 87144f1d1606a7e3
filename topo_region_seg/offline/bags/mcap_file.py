# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""One MCAP file, whole, without index, damaged or cut short."""

from __future__ import annotations

import os
import struct
from collections import Counter, OrderedDict
from collections.abc import Collection, Iterator
from io import BytesIO
from pathlib import Path
from typing import BinaryIO

from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.records import Channel, Schema

from topo_region_seg.offline.bags import chunks
from topo_region_seg.offline.bags.chunks import ChunkError
from topo_region_seg.offline.bags.mcap_summary import MAGIC, Summary, read_summary
from topo_region_seg.offline.bags.records import BagError, BagReader, Record, Storage, Topic, merge_topics, ros2_name

LOOSE = -1
"""Stands for the offset in a chunk of messages that lie in the file directly."""
CACHED_CHUNKS = 4

Entry = tuple[int, int, int, int]
"""Log time, offset of the chunk (or of the loose message) in the file, offset in the chunk, channel: sorts as read."""


class McapFile(BagReader):
    """An MCAP file: read through its index, or by a scan of all its records where the index is not there or is damaged.

    The checksum of every chunk is checked; a damaged one goes to `problems`, and the others are still read.

    Parameters
    ----------
    path : Path
        The file.
    name : Path, optional
        What messages call it, if that is another.
    """

    def __init__(self, path: Path, name: Path | None = None) -> None:
        self.path = name or path
        self.problems = []
        self._schemas: dict[int, Schema] = {}
        self._channels: dict[int, Channel] = {}
        self._scanned: list[Entry] = []
        self._compressions: set[str] = set()
        self._chunks: OrderedDict[int, bytes] = OrderedDict()
        self._summary: Summary | None = None
        try:
            self._file: BinaryIO = path.open("rb")
        except OSError as error:
            raise BagError(
                f"{self.path}: cannot be opened ({error.strerror}); check the name and the permissions"
            ) from None
        try:
            self._open()
        except BaseException:
            self._file.close()
            raise

    def _open(self) -> None:
        size = os.fstat(self._file.fileno()).st_size
        if size == 0:
            raise BagError(f"{self.path}: the file is empty; nothing was recorded")
        if self._file.read(len(MAGIC)) != MAGIC:
            raise BagError(
                f"{self.path}: not an MCAP file (wrong magic bytes); give a .mcap, a rosbag2 folder or a .bag"
            )
        self._summary = read_summary(self._file, size)
        if self._summary is not None:
            self._schemas, self._channels = self._summary.schemas, self._summary.channels
            self._compressions = {chunk.compression for chunk in self._summary.chunks}
            counts = self._summary.counts
        else:
            self.truncated = not self._scan(size)
            counts = Counter(entry[3] for entry in self._scanned)
        self.topics = merge_topics(
            [self._topic(channel, counts.get(channel.id, 0)) for channel in self._channels.values()]
        )

    def storage(self) -> Storage:
        """Return how the recording is stored."""
        times = self._summary.times if self._summary else None
        if self._scanned:
            times = min(entry[0] for entry in self._scanned), max(entry[0] for entry in self._scanned)
        return Storage("mcap", 1, tuple(f"{name} chunks" for name in sorted(self._compressions) if name), times)

    def close(self) -> None:
        """Close the file."""
        self._file.close()
        self._chunks.clear()

    def messages(self, topics: Collection[str]) -> Iterator[Record]:
        """Iterate over the messages of some topics in the order of log times."""
        wanted = {number for number, channel in self._channels.items() if channel.topic in topics}
        entries = sorted(self._entries(wanted))
        in_chunk = Counter(entry[1] for entry in entries)
        bad: set[int] = set()
        for log_time, position, offset, number in entries:
            if position in bad:
                continue
            try:
                data = self._message(position, offset, number)
            except ChunkError as error:
                bad.add(position)
                self._report(position, error, in_chunk[position])
                continue
            channel = self._channels[number]
            yield Record(channel.topic, self._type(channel), log_time, data, channel.message_encoding)

    def _entries(self, wanted: set[int]) -> list[Entry]:
        if self._summary is None:
            return [entry for entry in self._scanned if entry[3] in wanted]
        entries: list[Entry] = []
        for chunk in self._summary.chunks:
            if chunk.message_index_offsets and wanted.isdisjoint(chunk.message_index_offsets):
                continue
            try:
                found = self._indexed(chunk.chunk_start_offset, chunk.chunk_length, chunk.message_index_length)
                found = found or self._inside(chunk.chunk_start_offset, self._chunk(chunk.chunk_start_offset))
            except ChunkError as error:
                self._report(chunk.chunk_start_offset, error, 0)
                continue
            entries += [entry for entry in found if entry[3] in wanted]
        return entries

    def _indexed(self, position: int, length: int, index_length: int) -> list[Entry]:
        """Read the message indexes after a chunk; empty where there are none."""
        self._file.seek(position + length)
        content = self._file.read(index_length)
        entries: list[Entry] = []
        for opcode, start, end in chunks.records(content):
            if opcode == chunks.MESSAGE_INDEX:
                number, size = struct.unpack_from("<HI", content, start + 9)
                pairs = struct.iter_unpack("<QQ", content[start + 15 : min(start + 15 + size // 16 * 16, end)])
                entries += [(time, position, offset, number) for time, offset in pairs]
        return entries

    def _scan(self, size: int) -> bool:
        """Find channels and messages by walking over the file; return whether the file is whole."""
        position = len(MAGIC)
        while position + chunks.RECORD_HEAD.size <= size:
            self._file.seek(position)
            opcode, length = chunks.RECORD_HEAD.unpack(self._file.read(chunks.RECORD_HEAD.size))
            end = position + chunks.RECORD_HEAD.size + length
            if opcode == chunks.DATA_END:  # what follows is the summary, which is damaged or of no use
                self._file.seek(size - len(MAGIC))
                return self._file.read() == MAGIC
            if opcode == 0 or (end > size and opcode != chunks.CHUNK):
                return False
            try:
                self._visit(position, opcode, length, cut=end > size)
            except ChunkError as error:
                if end > size:
                    return False
                self._report(position, error, 0)
            position = end
        return False

    def _visit(self, position: int, opcode: int, length: int, cut: bool) -> None:
        if opcode == chunks.CHUNK:
            content = self._file.read(length)
            data = chunks.decompress(content, partial=cut)
            self._compressions.add(chunks.parse_head(content).compression)
            self._keep(position, data)
            self._scanned += self._inside(position, data)
        elif opcode in (chunks.SCHEMA, chunks.CHANNEL):
            self._learn(opcode, self._file.read(length))
        elif opcode == chunks.MESSAGE and length >= 22:
            number, _, log_time = struct.unpack("<HIQ", self._file.read(14))
            self._scanned.append((log_time, position, LOOSE, number))

    def _inside(self, position: int, data: bytes) -> list[Entry]:
        """List the messages of a decompressed chunk, learning its channels."""
        entries: list[Entry] = []
        for opcode, start, end in chunks.records(data):
            if opcode in (chunks.SCHEMA, chunks.CHANNEL):
                self._learn(opcode, data[start + 9 : end])
            elif opcode == chunks.MESSAGE and end - start >= chunks.MESSAGE_HEAD.size:
                _, _, number, _, log_time, _ = chunks.MESSAGE_HEAD.unpack_from(data, start)
                entries.append((log_time, position, start, number))
        return entries

    def _learn(self, opcode: int, content: bytes) -> None:
        stream = ReadDataStream(BytesIO(content))
        try:
            if opcode == chunks.SCHEMA:
                schema = Schema.read(stream)
                self._schemas.setdefault(schema.id, schema)
            else:
                channel = Channel.read(stream)
                self._channels.setdefault(channel.id, channel)
        except (McapError, struct.error, UnicodeDecodeError) as error:
            raise ChunkError(f"damaged schema or channel ({error})") from None

    def _message(self, position: int, offset: int, number: int) -> bytes:
        """Read the data of one message."""
        if offset == LOOSE:
            self._file.seek(position)
            _, length = chunks.RECORD_HEAD.unpack(self._file.read(chunks.RECORD_HEAD.size))
            return self._file.read(length)[22:]
        data = self._chunk(position)
        try:
            opcode, length, found, *_ = chunks.MESSAGE_HEAD.unpack_from(data, offset)
        except struct.error:
            raise ChunkError("its index points behind its end") from None
        end = offset + chunks.RECORD_HEAD.size + length
        if opcode != chunks.MESSAGE or found != number or end > len(data):
            raise ChunkError("its index does not fit its messages")
        return data[offset + chunks.MESSAGE_HEAD.size : end]

    def _chunk(self, position: int) -> bytes:
        """Return a decompressed chunk, the last few of which are kept."""
        if position in self._chunks:
            self._chunks.move_to_end(position)
            return self._chunks[position]
        self._file.seek(position)
        head = self._file.read(chunks.RECORD_HEAD.size)
        if len(head) < chunks.RECORD_HEAD.size or head[0] != chunks.CHUNK:
            raise ChunkError("there is no chunk where the index says")
        content = self._file.read(chunks.RECORD_HEAD.unpack(head)[1])
        cut = self.truncated and len(content) < chunks.RECORD_HEAD.unpack(head)[1]
        data = chunks.decompress(content, partial=cut)
        self._keep(position, data)
        return data

    def _keep(self, position: int, data: bytes) -> None:
        self._chunks[position] = data
        while len(self._chunks) > CACHED_CHUNKS:
            self._chunks.popitem(last=False)

    def _report(self, position: int, error: ChunkError, lost: int) -> None:
        messages = f"; {lost} message{'s' if lost != 1 else ''} lost" if lost else ""
        self.problems.append(f"{self.path}: chunk at byte {position}: {error}{messages}")

    def _type(self, channel: Channel) -> str:
        schema = self._schemas.get(channel.schema_id)
        return ros2_name(schema.name) if schema else ""

    def _topic(self, channel: Channel, count: int) -> Topic:
        schema = self._schemas.get(channel.schema_id)
        text = schema.data.decode("utf-8", "replace") if schema and schema.encoding == "ros2msg" else ""
        return Topic(channel.topic, self._type(channel), count, text)
