# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The index of an MCAP file, as its summary and the message indexes after its chunks give it."""

from __future__ import annotations

import struct
import zlib
from collections import Counter
from collections.abc import Collection, Iterator
from contextlib import suppress
from typing import BinaryIO

from mcap.opcode import Opcode
from mcap.reader import SeekingReader
from mcap.records import ChunkIndex, Statistics
from mcap.summary import Summary

from topo_region_seg.offline.bags.recovery.mcap_chunks import (
    DAMAGE,
    MAGIC,
    RECORD_HEAD,
    ChunkError,
    Definitions,
    Entry,
    entries_in,
    read_chunk,
    records,
)

MAX_SUMMARY_BYTES = 2**30
_FOOTER = struct.Struct("<BQQQI")


class McapIndex:
    """Every message of a file, without a look at the messages themselves.

    Parameters
    ----------
    file : file
        Open for reading.
    chunks : list of ChunkIndex
        All chunks.
    definitions : Definitions
        Schemas and channels.
    statistics : Statistics
        Those of the file.
    """

    def __init__(
        self, file: BinaryIO, chunks: list[ChunkIndex], definitions: Definitions, statistics: Statistics
    ) -> None:
        self._file, self._chunks = file, chunks
        self.definitions = definitions
        self.compressions = {chunk.compression for chunk in chunks}
        self.times: tuple[int, int] | None = None
        if statistics.message_count:
            self.times = statistics.message_start_time, statistics.message_end_time
        self.counts: Counter[int] = Counter()
        for chunk in chunks:
            for number, pairs in self._indexed(chunk):
                self.counts[number] += len(pairs) // 16

    def entries(self, channels: Collection[int]) -> Iterator[Entry]:
        """Yield the messages of some channels, chunk by chunk."""
        for chunk in self._chunks:
            for number, pairs in self._indexed(chunk):
                if number in channels:
                    for log_time, offset in struct.iter_unpack("<QQ", pairs):
                        yield Entry(log_time, chunk.chunk_start_offset, offset, number)

    def complete(self) -> None:
        """Look for schemas and channels that the summary does not repeat in the chunks whose messages need them."""
        used = set(self.counts)
        for chunk in self._chunks:
            if self.definitions.describe(used):
                return
            with suppress(ChunkError):
                data, _ = read_chunk(self._file, chunk.chunk_start_offset)
                entries_in(data, chunk.chunk_start_offset, self.definitions)

    def _indexed(self, chunk: ChunkIndex) -> Iterator[tuple[int, bytes]]:
        """Yield channel and pairs of log time and offset of the message indexes after a chunk."""
        self._file.seek(chunk.chunk_start_offset + chunk.chunk_length)
        content = self._file.read(chunk.message_index_length)
        for opcode, start, end in records(content):
            if opcode == Opcode.MESSAGE_INDEX and end - start >= RECORD_HEAD.size + 6:
                number, size = struct.unpack_from("<HI", content, start + RECORD_HEAD.size)
                first = start + RECORD_HEAD.size + 6
                yield number, content[first : first + min(size, end - first) // 16 * 16]


def read_index(file: BinaryIO, size: int) -> McapIndex | None:
    """Read the index of a file; None where it is missing, damaged or does not lead to every message.

    The summary is the library's to read; that all messages are indexed is checked against its statistics, as messages
    may also lie outside of chunks, and message indexes may be left out.
    """
    summary = _summary(file, size)
    if summary is None or summary.statistics is None:
        return None
    definitions, statistics = Definitions(), summary.statistics
    definitions.schemas, definitions.channels = dict(summary.schemas), dict(summary.channels)
    chunks = summary.chunk_indexes
    ends = (chunk.chunk_start_offset + chunk.chunk_length + chunk.message_index_length for chunk in chunks)
    if statistics.chunk_count != len(chunks) or any(end > size for end in ends):
        return None
    index = McapIndex(file, chunks, definitions, statistics)
    if index.counts.total() != statistics.message_count:
        return None
    index.complete()
    return index if definitions.describe(set(index.counts)) else None


def _summary(file: BinaryIO, size: int) -> Summary | None:
    tail = _FOOTER.size + len(MAGIC)
    if size < len(MAGIC) + tail:
        return None
    file.seek(size - tail)
    footer = file.read(tail)
    opcode, length, start, _, crc = _FOOTER.unpack_from(footer)
    if footer[_FOOTER.size :] != MAGIC or opcode != Opcode.FOOTER or length != _FOOTER.size - RECORD_HEAD.size:
        return None
    if not len(MAGIC) <= start < size - tail or size - tail - start > MAX_SUMMARY_BYTES:
        return None
    file.seek(start)
    # The library does not check the summary's checksum.
    if crc and zlib.crc32(file.read(size - tail - start) + footer[: _FOOTER.size - 4]) != crc:
        return None
    file.seek(0)
    try:
        return SeekingReader(file, record_size_limit=MAX_SUMMARY_BYTES).get_summary()
    except DAMAGE:
        return None
