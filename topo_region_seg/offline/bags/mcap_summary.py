# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The summary at the end of an MCAP file: channels, counts and where the chunks lie."""

from __future__ import annotations

import struct
import zlib
from dataclasses import dataclass, field
from io import BytesIO
from typing import BinaryIO

from mcap.exceptions import McapError
from mcap.records import Channel, ChunkIndex, Schema, Statistics
from mcap.stream_reader import StreamReader

MAGIC = b"\x89MCAP0\r\n"
FOOTER_BYTES = 1 + 8 + 8 + 8 + 4
MAX_SUMMARY_BYTES = 2**30


@dataclass
class Summary:
    """What the summary says; `counts` are messages per channel id, `times` the first and last log time in ns."""

    schemas: dict[int, Schema] = field(default_factory=dict)
    channels: dict[int, Channel] = field(default_factory=dict)
    chunks: list[ChunkIndex] = field(default_factory=list)
    counts: dict[int, int] = field(default_factory=dict)
    times: tuple[int, int] | None = None


def read_summary(file: BinaryIO, size: int) -> Summary | None:
    """Read the summary; None where it is missing, damaged or has no use for finding every message."""
    tail = FOOTER_BYTES + len(MAGIC)
    if size < len(MAGIC) + tail:
        return None
    file.seek(size - tail)
    footer = file.read(tail)
    opcode, length, start, _, crc = struct.unpack_from("<BQQQI", footer)
    if footer[FOOTER_BYTES:] != MAGIC or opcode != 0x02 or length != 20:
        return None
    if not len(MAGIC) <= start < size - tail or size - tail - start > MAX_SUMMARY_BYTES:
        return None
    file.seek(start)
    content = file.read(size - tail - start)
    if crc and zlib.crc32(content + footer[: FOOTER_BYTES - 4]) != crc:
        return None
    return _parse(content)


def _parse(content: bytes) -> Summary | None:
    summary = Summary()
    statistics: Statistics | None = None
    stream = BytesIO(content)
    try:
        reader = StreamReader(stream, skip_magic=True, record_size_limit=MAX_SUMMARY_BYTES).records
        # The footer is not part of the content, so the end is told by the position.
        while stream.tell() < len(content):
            record = next(reader)
            if isinstance(record, Schema):
                summary.schemas[record.id] = record
            elif isinstance(record, Channel):
                summary.channels[record.id] = record
            elif isinstance(record, ChunkIndex):
                summary.chunks.append(record)
            elif isinstance(record, Statistics):
                statistics = record
    except (McapError, struct.error, UnicodeDecodeError, StopIteration):
        return None
    # Without these, messages outside of indexed chunks cannot be ruled out.
    if statistics is None or statistics.chunk_count != len(summary.chunks):
        return None
    if statistics.message_count and not (summary.chunks and summary.channels):
        return None
    summary.counts = dict(statistics.channel_message_counts)
    if statistics.message_count:
        summary.times = statistics.message_start_time, statistics.message_end_time
    return summary
