# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Attachments: whole files that an MCAP recording carries beside its messages."""

from __future__ import annotations

import struct
import zlib
from io import BytesIO
from pathlib import Path

from mcap.data_stream import ReadDataStream
from mcap.opcode import Opcode
from mcap.reader import SeekingReader
from mcap.records import Attachment, AttachmentIndex

from topo_region_seg.offline.bags.records import BagError
from topo_region_seg.offline.bags.recovery.bounded import BoundedFile
from topo_region_seg.offline.bags.recovery.mcap_chunks import DAMAGE, RECORD_HEAD

MAX_BYTES = 2**28
"""A larger attachment is refused; the record of a run takes about 400 bytes a frame."""
MAX_RECORD = MAX_BYTES + 2**20
"""1 MB beyond the data for the names and the rest of the record."""
CHECKSUM = struct.Struct("<I")


def read_attachment(path: str | Path, name: str) -> bytes | None:
    """Return the data of an attachment of an .mcap file, or of those in a rosbag2 folder; None if it is not there.

    Of several of that name it is the last one. A file without index, such as one cut short, has none.

    Raises
    ------
    BagError
        The file cannot be opened, or the attachment is damaged.
    """
    path = Path(path)
    found: bytes | None = None
    for file in sorted(path.glob("*.mcap")) if path.is_dir() else [path]:
        data = _read(file, name)
        found = found if data is None else data
    return found


def _read(path: Path, name: str) -> bytes | None:
    try:
        with BoundedFile(path) as file:
            found = [index for index in _indexes(file) if index.name == name]
            if not found:
                return None
            file.seek(found[-1].offset)
            record = file.read(min(found[-1].length, MAX_RECORD))
    except OSError as error:
        raise BagError(f"{path}: cannot be read ({error.strerror}); check the name and the permissions") from None
    # The library does not check the attachment's checksum.
    content = record[RECORD_HEAD.size :]
    fields = ReadDataStream(BytesIO(content))
    try:
        attachment = Attachment.read(fields)
    except DAMAGE:
        raise BagError(f"{path}: its attachment '{name}' is damaged; make the file again") from None
    end = fields.count - CHECKSUM.size
    (checksum,) = CHECKSUM.unpack_from(content, end)
    if record[0] != Opcode.ATTACHMENT or attachment.name != name or checksum not in (0, zlib.crc32(content[:end])):
        raise BagError(f"{path}: its attachment '{name}' is damaged (wrong checksum); make the file again")
    return bytes(attachment.data)


def _indexes(file: BoundedFile) -> list[AttachmentIndex]:
    try:
        summary = SeekingReader(file, record_size_limit=MAX_RECORD).get_summary()
    except (*DAMAGE, StopIteration, EOFError, ValueError):
        return []
    return summary.attachment_indexes if summary else []
