# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""MCAP files with every combination of what the specification leaves to the writer: https://mcap.dev/spec."""

from __future__ import annotations

import itertools
import struct
import zlib
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field

import lz4.frame
import zstandard
from bag_maker import Entry

from topo_region_seg.offline.bags.types import typestore

MAGIC = b"\x89MCAP0\r\n"
HEADER, FOOTER, SCHEMA, CHANNEL, MESSAGE, CHUNK, MESSAGE_INDEX, CHUNK_INDEX = range(1, 9)
ATTACHMENT, ATTACHMENT_INDEX, STATISTICS, METADATA, METADATA_INDEX, SUMMARY_OFFSET, DATA_END = range(9, 16)
PRIVATE = 0x90
"""An opcode that no reader knows and all have to pass over."""
COMPRESS = {
    "": bytes,
    "lz4": lz4.frame.compress,
    "zstd": zstandard.ZstdCompressor().compress,
}


@dataclass(frozen=True)
class Kind:
    """What a writer does; the defaults are those of most."""

    chunking: str = "each"
    """Messages in chunks: "none", "each" in its own, "pairs", "mixed" with messages outside of chunks."""
    compression: str = "zstd"
    message_index: bool = True
    chunk_index: bool = True
    statistics: str = "full"
    """ "none", "full", or "uncounted": without the counts of the channels."""
    repeat_schemas: bool = True
    repeat_channels: bool = True
    summary: bool = True
    summary_offsets: bool = True
    checksums: bool = True
    attachments: bool = False
    metadata: bool = False
    private_records: bool = False
    padding: bool = False
    """Bytes after the known fields of records, as a later version of the format may have."""
    definitions_outside: bool = False
    """Schemas and channels before the chunks, not in them."""
    schemaless: bool = False
    """A channel without a schema, with messages."""
    empty_chunk: bool = False

    @property
    def name(self) -> str:
        """Return what differs from the defaults."""
        changed = [f"{k}={v}" for k, v in vars(self).items() if v != getattr(Kind(), k)]
        return ", ".join(changed) or "plain"


def kinds() -> list[Kind]:
    """Return all combinations of chunks, indexes and summary, with the other features varied along with them."""
    core = itertools.product(
        ("none", "each", "pairs", "mixed"),
        (True, False),
        (True, False),
        ("full", "uncounted", "none"),
        (True, False),
        (True, False),
        (False, True),
    )
    found = []
    for number, (chunking, message_index, chunk_index, statistics, schemas, channels, padding) in enumerate(core):
        if chunking == "none" and not (message_index and chunk_index):
            continue
        # Each of these goes through its values at a pace of its own, so that all pairs with the above occur.
        found.append(
            Kind(
                chunking=chunking,
                compression=("", "lz4", "zstd")[number % 3],
                message_index=message_index,
                chunk_index=chunk_index,
                statistics=statistics,
                repeat_schemas=schemas,
                repeat_channels=channels,
                padding=padding,
                summary_offsets=number % 5 < 3,
                checksums=number % 7 < 4,
                attachments=number % 11 < 4,
                metadata=number % 13 < 4,
                private_records=number % 17 < 6,
                definitions_outside=number % 19 < 7,
                schemaless=number % 23 < 8,
                empty_chunk=number % 29 < 9,
            )
        )
    found += [
        Kind(summary=False, chunking=chunking, compression=compression, padding=padding)
        for chunking in ("none", "each", "pairs", "mixed")
        for compression in COMPRESS
        for padding in (False, True)
    ]
    return found


@dataclass
class _Writer:
    kind: Kind
    data: bytearray = field(default_factory=bytearray)

    def add(self, opcode: int, content: bytes, *, extensible: bool = True) -> int:
        """Append a record; return where it begins."""
        start = len(self.data)
        content += b"later" if extensible and self.kind.padding else b""
        self.data += struct.pack("<BQ", opcode, len(content)) + content
        return start

    def private(self) -> None:
        if self.kind.private_records:
            self.add(PRIVATE, b"nobody knows")


def text(value: str) -> bytes:
    return struct.pack("<I", len(value)) + value.encode()


def blob(value: bytes) -> bytes:
    return struct.pack("<I", len(value)) + value


def make(entries: Sequence[Entry], kind: Kind) -> bytes:
    """Return an MCAP file that holds the entries, and where the kind has a schemaless channel a message of that."""
    topics = list(dict.fromkeys((topic, name) for topic, name, _, _ in entries))
    names = list(dict.fromkeys(name for _, name in topics))
    schemas = [
        struct.pack("<H", i + 1) + text(name) + text("ros2msg") + blob(_definition(name))
        for i, name in enumerate(names)
    ]
    channels = [
        struct.pack("<HH", i + 1, names.index(name) + 1) + text(topic) + text("cdr") + blob(text("a") + text("b"))
        for i, (topic, name) in enumerate(topics)
    ]
    messages = [(topics.index((topic, name)) + 1, log_time, _data(name, msg)) for topic, name, log_time, msg in entries]
    if kind.schemaless:
        channels.append(struct.pack("<HH", len(channels) + 1, 0) + text("/anything") + text("json") + blob(b""))
        messages.insert(1, (len(channels), messages[0][1] + 1, b"{}"))
    return _Layout(kind, schemas, channels, messages).file()


def _definition(name: str) -> bytes:
    return typestore().generate_msgdef(name, ros_version=2)[0].encode()


def _data(name: str, message: object) -> bytes:
    return message if isinstance(message, bytes) else bytes(typestore().serialize_cdr(message, name))


class _Layout:
    def __init__(
        self, kind: Kind, schemas: list[bytes], channels: list[bytes], messages: list[tuple[int, int, bytes]]
    ) -> None:
        self.kind, self.schemas, self.channels, self.messages = kind, schemas, channels, messages
        self.out = _Writer(kind, bytearray(MAGIC))
        self.chunk_indexes: list[bytes] = []
        self.attachment_indexes: list[bytes] = []
        self.metadata_indexes: list[bytes] = []

    def file(self) -> bytes:
        kind, out = self.kind, self.out
        out.add(HEADER, text("ros2") + text("test"))
        if kind.chunking == "none" or kind.definitions_outside:
            self._define(out)
        for part in self._parts():
            out.private()
            if isinstance(part, list):
                self._chunk(part)
            else:
                out.add(MESSAGE, _message(part), extensible=False)
        if kind.attachments:
            self._attach()
        if kind.metadata:
            content = text("about") + blob(text("made") + text("here"))
            start = out.add(METADATA, content)
            self.metadata_indexes.append(struct.pack("<QQ", start, len(out.data) - start) + text("about"))
        out.add(DATA_END, struct.pack("<I", zlib.crc32(out.data) if kind.checksums else 0))
        start, offsets = self._summary() if kind.summary else (0, 0)
        footer = struct.pack("<BQQQ", FOOTER, 20, start, offsets)
        checksum = zlib.crc32(bytes(out.data[start:]) + footer) if kind.checksums and start else 0
        return bytes(out.data) + footer + struct.pack("<I", checksum) + MAGIC

    def _parts(self) -> list[list[tuple[int, int, bytes]] | tuple[int, int, bytes]]:
        """Return the chunks as lists, and the messages outside of them."""
        if self.kind.chunking == "none":
            return list(self.messages)
        step = 1 if self.kind.chunking == "each" else 2
        parts: list[list[tuple[int, int, bytes]] | tuple[int, int, bytes]] = [
            self.messages[i : i + step] for i in range(0, len(self.messages), step)
        ]
        if self.kind.chunking == "mixed":
            parts = [*parts[:-1], *self.messages[(len(parts) - 1) * step :]]
        if self.kind.empty_chunk:
            parts.insert(1, [])
        return parts

    def _define(self, writer: _Writer) -> None:
        for content in self.schemas:
            writer.add(SCHEMA, content)
        for content in self.channels:
            writer.add(CHANNEL, content)

    def _chunk(self, messages: list[tuple[int, int, bytes]]) -> None:
        inside = _Writer(self.kind)
        if messages and not self.kind.definitions_outside:
            self._define(inside)
        inside.private()
        index: dict[int, list[tuple[int, int]]] = {}
        for message in messages:
            place = inside.add(MESSAGE, _message(message), extensible=False)
            index.setdefault(message[0], []).append((message[1], place))
        times = [log_time for _, log_time, _ in messages] or [0]
        packed = COMPRESS[self.kind.compression](bytes(inside.data))
        checksum = zlib.crc32(inside.data) if self.kind.checksums else 0
        sizes = struct.pack("<QI", len(inside.data), checksum) + text(self.kind.compression)
        span = struct.pack("<QQ", min(times), max(times))
        start = self.out.add(CHUNK, span + sizes + struct.pack("<Q", len(packed)) + packed)
        length, offsets = len(self.out.data) - start, b""
        if self.kind.message_index:
            for number, pairs in index.items():
                offsets += struct.pack("<HQ", number, len(self.out.data))
                rows = b"".join(struct.pack("<QQ", *pair) for pair in pairs)
                self.out.add(MESSAGE_INDEX, struct.pack("<H", number) + blob(rows))
        indexed = len(self.out.data) - start - length
        self.chunk_indexes.append(
            span
            + struct.pack("<QQ", start, length)
            + blob(offsets)
            + struct.pack("<Q", indexed)
            + text(self.kind.compression)
            + struct.pack("<QQ", len(packed), len(inside.data))
        )

    def _attach(self) -> None:
        content = struct.pack("<QQ", 1, 2) + text("notes.txt") + text("text/plain") + struct.pack("<Q", 5) + b"hello"
        start = self.out.add(ATTACHMENT, content + struct.pack("<I", zlib.crc32(content)), extensible=False)
        place = struct.pack("<QQQQQ", start, len(self.out.data) - start, 1, 2, 5)
        self.attachment_indexes.append(place + text("notes.txt") + text("text/plain"))

    def _summary(self) -> tuple[int, int]:
        kind, out = self.kind, self.out
        first, groups = len(out.data), []
        content = (
            (SCHEMA, self.schemas if kind.repeat_schemas else []),
            (CHANNEL, self.channels if kind.repeat_channels else []),
            (STATISTICS, [] if kind.statistics == "none" else [self._statistics()]),
            (CHUNK_INDEX, self.chunk_indexes if kind.chunk_index else []),
            (ATTACHMENT_INDEX, self.attachment_indexes),
            (METADATA_INDEX, self.metadata_indexes),
        )
        for opcode, records in content:
            start = len(out.data)
            for record in records:
                out.add(opcode, record)
            if records:
                groups.append(struct.pack("<BQQ", opcode, start, len(out.data) - start))
        out.private()
        if first == len(out.data):
            return 0, 0
        offsets = len(out.data) if kind.summary_offsets else 0
        for group in groups if kind.summary_offsets else []:
            out.add(SUMMARY_OFFSET, group)
        return first, offsets

    def _statistics(self) -> bytes:
        times = [log_time for _, log_time, _ in self.messages]
        counts = Counter(number for number, _, _ in self.messages)
        counted = b"".join(struct.pack("<HQ", *pair) for pair in counts.items())
        sizes = len(self.messages), len(self.schemas), len(self.channels)
        others = len(self.attachment_indexes), len(self.metadata_indexes), len(self.chunk_indexes)
        totals = struct.pack("<QHIIIIQQ", *sizes, *others, min(times), max(times))
        return totals + blob(counted if self.kind.statistics == "full" else b"")


def _message(message: tuple[int, int, bytes]) -> bytes:
    number, log_time, data = message
    return struct.pack("<HIQQ", number, 0, log_time, log_time) + data
