# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""One MCAP file, whole, without index, damaged or cut short."""

from __future__ import annotations

from collections import Counter, OrderedDict
from collections.abc import Collection, Iterator
from pathlib import Path

from mcap.records import Channel

from topo_region_seg.offline.bags.mcap_index import read_index
from topo_region_seg.offline.bags.records import BagError, BagReader, Record, Storage, Topic, merge_topics, ros2_name
from topo_region_seg.offline.bags.recovery.bounded import BoundedFile
from topo_region_seg.offline.bags.recovery.mcap_chunks import (
    LOOSE,
    MAGIC,
    RECORD_HEAD,
    ChunkError,
    Entry,
    message_in,
    read_chunk,
)
from topo_region_seg.offline.bags.recovery.mcap_scan import McapScan

CACHED_CHUNKS = 4
_BEFORE_DATA = 22
"""Bytes of a message's content before its data: channel, sequence number and two times."""


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
        self._chunks: OrderedDict[int, bytes] = OrderedDict()
        try:
            self._file = BoundedFile(path)
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
        size = self._file.length
        if size == 0:
            raise BagError(f"{self.path}: the file is empty; nothing was recorded")
        if self._file.read(len(MAGIC)) != MAGIC:
            raise BagError(
                f"{self.path}: not an MCAP file (wrong magic bytes); give a .mcap, a rosbag2 folder or a .bag"
            )
        self._scanned: list[Entry] = []
        self._index = read_index(self._file, size)
        if self._index is not None:
            definitions, counts = self._index.definitions, self._index.counts
            self._compressions, self._times = self._index.compressions, self._index.times
        else:
            scan = McapScan(self._file, size)
            definitions, counts = scan.definitions, Counter(entry.channel for entry in scan.entries)
            self._scanned, self._compressions, self.truncated = scan.entries, scan.compressions, scan.truncated
            times = [entry.log_time for entry in scan.entries]
            self._times = (min(times), max(times)) if times else None
            for position, error in scan.damage:
                self._report(position, error, 0)
            if scan.changed:
                self.problems.append(
                    f"{self.path}: is damaged where no other checksum tells (that of all data is wrong)"
                )
        self._schemas, self._channels = definitions.schemas, definitions.channels
        if lost := sum(count for number, count in counts.items() if number not in self._channels):
            self.problems.append(f"{self.path}: {lost} messages of topics that no whole part of the file describes")
        self.topics = merge_topics([self._topic(channel, counts[channel.id]) for channel in self._channels.values()])

    def storage(self) -> Storage:
        """Return how the recording is stored."""
        compression = tuple(f"{name} chunks" for name in sorted(self._compressions) if name)
        return Storage("mcap", 1, compression, self._times)

    def close(self) -> None:
        """Close the file."""
        self._file.close()
        self._chunks.clear()

    def messages(self, topics: Collection[str]) -> Iterator[Record]:
        """Iterate over the messages of some topics in the order of log times."""
        wanted = {number for number, channel in self._channels.items() if channel.topic in topics}
        found = self._index.entries(wanted) if self._index else (e for e in self._scanned if e.channel in wanted)
        entries = sorted(found)
        in_chunk = Counter(entry.position for entry in entries)
        bad: set[int] = set()
        for entry in entries:
            if entry.position in bad:
                continue
            try:
                data = self._message(entry)
            except ChunkError as error:
                bad.add(entry.position)
                self._report(entry.position, error, in_chunk[entry.position])
                continue
            in_chunk[entry.position] -= 1
            channel = self._channels[entry.channel]
            yield Record(channel.topic, self._type(channel), entry.log_time, data, channel.message_encoding)

    def _message(self, entry: Entry) -> bytes:
        if entry.offset == LOOSE:
            self._file.seek(entry.position)
            _, length = RECORD_HEAD.unpack(self._file.read(RECORD_HEAD.size))
            return self._file.read(length)[_BEFORE_DATA:]
        return message_in(self._chunk(entry.position), entry)

    def _chunk(self, position: int) -> bytes:
        """Return a decompressed chunk, the last few of which are kept."""
        if position in self._chunks:
            self._chunks.move_to_end(position)
            return self._chunks[position]
        self._chunks[position], _ = read_chunk(self._file, position, may_be_cut=self.truncated)
        while len(self._chunks) > CACHED_CHUNKS:
            self._chunks.popitem(last=False)
        return self._chunks[position]

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
