# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""MCAP chunks: decompression within limits, with the checksum checked, and the records inside."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass

import lz4.frame
import zstandard

MAX_CHUNK_BYTES = 2 * 2**30
"""A chunk that claims more than this uncompressed is refused; recorders write about 1 MB, or one large message."""

RECORD_HEAD = struct.Struct("<BQ")
MESSAGE_HEAD = struct.Struct("<BQHIQQ")
SCHEMA, CHANNEL, MESSAGE, CHUNK, MESSAGE_INDEX, DATA_END = 0x03, 0x04, 0x05, 0x06, 0x07, 0x0F


class ChunkError(Exception):
    """A chunk is damaged."""


@dataclass(frozen=True)
class ChunkHead:
    """The fields of a chunk record before its data."""

    uncompressed_size: int
    crc: int
    compression: str
    data_offset: int
    """Where the compressed data begins, bytes from the start of the record's content."""


def parse_head(content: bytes) -> ChunkHead:
    """Read the head of a chunk from the beginning of a record's content; :class:`ChunkError` if it is no head."""
    try:
        _, _, size, crc, length = struct.unpack_from("<QQQII", content)
        compression = content[32 : 32 + length].decode("ascii")
    except (struct.error, UnicodeDecodeError) as error:
        raise ChunkError(f"damaged chunk head ({error})") from None
    if compression not in ("", "zstd", "lz4"):
        raise ChunkError(f"unknown compression {compression!r}")
    if size > MAX_CHUNK_BYTES:
        raise ChunkError(f"claims {size} bytes uncompressed, more than the limit of {MAX_CHUNK_BYTES}")
    return ChunkHead(size, crc, compression, 32 + length + 8)


def decompress(content: bytes, *, partial: bool = False) -> bytes:
    """Return the records of a chunk, given the content of its record.

    With `partial`, `content` may end early: what can be decompressed is returned, unchecked.
    """
    head = parse_head(content)
    packed = memoryview(content)[head.data_offset :]
    # Never more than the checked size, whatever the compressed frame claims about itself.
    limit = head.uncompressed_size + 1
    try:
        if head.compression == "zstd":
            data = _unzstd(packed, limit, partial)
        elif head.compression == "lz4":
            data = lz4.frame.LZ4FrameDecompressor().decompress(packed, max_length=limit)
        else:
            data = bytes(packed[:limit])
    except (zstandard.ZstdError, RuntimeError, EOFError, MemoryError) as error:
        raise ChunkError(f"does not decompress ({error})") from None
    if partial:
        return data
    if len(data) != head.uncompressed_size:
        raise ChunkError(f"claims {head.uncompressed_size} bytes uncompressed, which is not what it holds")
    if head.crc and zlib.crc32(data) != head.crc:
        raise ChunkError("checksum (CRC) does not match")
    return data


def _unzstd(packed: memoryview, limit: int, partial: bool) -> bytes:
    with zstandard.ZstdDecompressor().stream_reader(packed) as stream:
        if not partial:
            return stream.read(limit)
        pieces: list[bytes] = []
        try:
            while limit > 0 and (piece := stream.read(min(limit, 2**17))):
                pieces.append(piece)
                limit -= len(piece)
        except zstandard.ZstdError:
            pass  # the end of what was written before the recorder died
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
