# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""MCAP chunks: decompression within limits, with the checksum checked, and the records inside."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator
from io import BytesIO
from typing import BinaryIO, NamedTuple

import lz4.frame
import zstandard
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Channel, Chunk, Schema

MAGIC = b"\x89MCAP0\r\n"
MAX_CHUNK_BYTES = 2 * 2**30
"""A chunk that claims more than this uncompressed is refused; recorders write about 1 MB, or one large message."""

_PIECE = 2**17

RECORD_HEAD = struct.Struct("<BQ")
MESSAGE_HEAD = struct.Struct("<BQHIQQ")


DAMAGE = (McapError, struct.error, UnicodeDecodeError, OverflowError)
"""What the library raises for records that are damaged."""


class ChunkError(Exception):
    """A chunk is damaged."""


class Entry(NamedTuple):
    """Where a message lies; entries sort as messages are read: by log time (ns), then as in the file."""

    log_time: int
    position: int
    """Of the chunk in the file, or of the message itself where it lies in no chunk."""
    offset: int
    """Of the message among the decompressed records of the chunk; LOOSE where it lies in no chunk."""
    channel: int


LOOSE = -1


class Definitions:
    """The schemas and channels met so far, by id; the first of an id counts."""

    def __init__(self) -> None:
        self.schemas: dict[int, Schema] = {}
        self.channels: dict[int, Channel] = {}

    def learn(self, opcode: int, content: bytes) -> None:
        """Take a schema or channel from the content of its record; :class:`ChunkError` if it is none."""
        stream = ReadDataStream(BytesIO(content))
        try:
            if opcode == Opcode.SCHEMA:
                schema = Schema.read(stream)
                self.schemas.setdefault(schema.id, schema)
            else:
                channel = Channel.read(stream)
                self.channels.setdefault(channel.id, channel)
        except DAMAGE as error:
            raise ChunkError(f"damaged schema or channel ({error})") from None

    def describe(self, channels: set[int]) -> bool:
        """Whether the channels of these ids are known, with their schemas; a channel of schema 0 has none."""
        found = [self.channels.get(number) for number in channels]
        return all(channel and (channel.schema_id in self.schemas or not channel.schema_id) for channel in found)


def read_chunk(file: BinaryIO, position: int, *, may_be_cut: bool = False) -> tuple[bytes, str]:
    """Return the records of the chunk whose record begins at `position`, and its compression.

    With `may_be_cut`, the file may end in the chunk: then what can be decompressed is returned, unchecked.

    Raises
    ------
    ChunkError
        There is no chunk, or it is damaged.
    """
    file.seek(position)
    head = file.read(RECORD_HEAD.size)
    if len(head) < RECORD_HEAD.size or head[0] != Opcode.CHUNK:
        raise ChunkError("there is no chunk where the index says")
    length = RECORD_HEAD.unpack(head)[1]
    content = file.read(length)
    try:
        chunk = Chunk.read(ReadDataStream(BytesIO(content)))
    except DAMAGE as error:
        raise ChunkError(f"damaged chunk head ({str(error) or 'it ends early'})") from None
    return _decompress(chunk, partial=may_be_cut and len(content) < length), chunk.compression


def _decompress(chunk: Chunk, *, partial: bool) -> bytes:
    if chunk.compression not in ("", "zstd", "lz4"):
        raise ChunkError(f"unknown compression {chunk.compression!r}")
    size = chunk.uncompressed_size
    if size > MAX_CHUNK_BYTES:
        raise ChunkError(f"claims {size} bytes uncompressed, more than the limit of {MAX_CHUNK_BYTES}")
    # Never more than the checked size, whatever the compressed frame claims about itself.
    limit = size + 1
    try:
        if chunk.compression == "zstd":
            data = unzstd(chunk.data, limit, partial=partial)
        elif chunk.compression == "lz4":
            data = lz4.frame.LZ4FrameDecompressor().decompress(chunk.data, max_length=limit)
        else:
            data = chunk.data[:limit]
    except (zstandard.ZstdError, RuntimeError, EOFError, MemoryError) as error:
        raise ChunkError(f"does not decompress ({str(error) or 'memory is short'})") from None
    if partial:
        return data
    if len(data) != size:
        raise ChunkError(f"claims {size} bytes uncompressed, which is not what it holds")
    if chunk.uncompressed_crc and zlib.crc32(data) != chunk.uncompressed_crc:
        raise ChunkError("checksum (CRC) does not match")
    return data


def unzstd(packed: bytes, limit: int, *, partial: bool = False) -> bytes:
    """Decompress at most `limit` bytes, in memory that grows with what is there; with `partial`, as far as it goes.

    Raises
    ------
    zstandard.ZstdError
        It is damaged.
    """
    pieces: list[bytes] = []
    with zstandard.ZstdDecompressor().stream_reader(packed) as stream:
        try:
            while limit > 0 and (piece := stream.read(min(limit, _PIECE))):
                pieces.append(piece)
                limit -= len(piece)
        except zstandard.ZstdError:
            if not partial:
                raise
    return b"".join(pieces)


def records(data: bytes) -> Iterator[tuple[int, int, int]]:
    """Walk whole records: yields (opcode, offset of the record, end of the record)."""
    offset = 0
    while offset + RECORD_HEAD.size <= len(data):
        opcode, length = RECORD_HEAD.unpack_from(data, offset)
        end = offset + RECORD_HEAD.size + length
        if end > len(data):
            return
        yield opcode, offset, end
        offset = end


def entries_in(data: bytes, position: int, definitions: Definitions) -> list[Entry]:
    """List the messages of a decompressed chunk that begins at `position`, learning its schemas and channels."""
    entries: list[Entry] = []
    for opcode, start, end in records(data):
        if opcode in (Opcode.SCHEMA, Opcode.CHANNEL):
            definitions.learn(opcode, data[start + RECORD_HEAD.size : end])
        elif opcode == Opcode.MESSAGE and end - start >= MESSAGE_HEAD.size:
            _, _, number, _, log_time, _ = MESSAGE_HEAD.unpack_from(data, start)
            entries.append(Entry(log_time, position, start, number))
    return entries


def message_in(data: bytes, entry: Entry) -> bytes:
    """Return the data of a message of a decompressed chunk; :class:`ChunkError` if it is not there."""
    try:
        opcode, length, found, _, log_time, _ = MESSAGE_HEAD.unpack_from(data, entry.offset)
    except (struct.error, OverflowError):
        raise ChunkError("its index points behind its end") from None
    end = entry.offset + RECORD_HEAD.size + length
    if opcode != Opcode.MESSAGE or (found, log_time) != (entry.channel, entry.log_time) or end > len(data):
        raise ChunkError("its index does not fit its messages")
    return data[entry.offset + MESSAGE_HEAD.size : end]
