# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The compression of rosbag2 itself, of whole files or of each message, beside that of the MCAP chunks."""

from __future__ import annotations

from pathlib import Path

import zstandard

from topo_region_seg.offline.bags.recovery.mcap_chunks import MAX_CHUNK_BYTES, unzstd

ZSTD_MAGIC = b"\x28\xb5\x2f\xfd"
_PIECE = 2**20


def is_packed(path: Path) -> bool:
    """Whether a file begins as a zstd file does; the last file of a killed recorder does not."""
    with path.open("rb") as file:
        return file.read(len(ZSTD_MAGIC)) == ZSTD_MAGIC


def unpack_file(path: Path, target: Path) -> str:
    """Decompress a file as far as it goes; return what is wrong with it, empty where nothing is.

    A file that merely ends early is no error here: what it holds ends early too, which its reader notices.
    """
    with path.open("rb") as packed, target.open("wb") as unpacked:
        stream = zstandard.ZstdDecompressor().stream_reader(packed, read_across_frames=True)
        try:
            while piece := stream.read(_PIECE):
                unpacked.write(piece)
        except zstandard.ZstdError as error:
            return f"does not decompress to its end ({error})"
    return ""


def unpack_message(data: bytes) -> bytes:
    """Decompress a message.

    Raises
    ------
    ValueError
        It is damaged, or larger than any message may be.
    """
    try:
        message = unzstd(data, MAX_CHUNK_BYTES + 1)
        size = zstandard.frame_content_size(data)
    except zstandard.ZstdError as error:
        raise ValueError(f"does not decompress ({error})") from None
    if len(message) > MAX_CHUNK_BYTES:
        raise ValueError(f"is larger than the limit of {MAX_CHUNK_BYTES} bytes")
    if size >= 0 and len(message) != size:
        raise ValueError(f"ends after {len(message)} of {size} bytes")
    return message
