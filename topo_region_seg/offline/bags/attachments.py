# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Attachments: whole files that an MCAP recording carries beside its messages."""

from __future__ import annotations

from pathlib import Path

from mcap.reader import SeekingReader

from topo_region_seg.offline.bags.records import BagError
from topo_region_seg.offline.bags.recovery.bounded import BoundedFile
from topo_region_seg.offline.bags.recovery.mcap_chunks import DAMAGE

MAX_BYTES = 2**28
"""A larger attachment is refused; the record of a run takes about 400 bytes a frame."""


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
        with BoundedFile(path) as stream:
            # 1 MB beyond the data for the names and the rest of the record.
            reader = SeekingReader(stream, record_size_limit=MAX_BYTES + 2**20)
            summary = reader.get_summary()
            if summary is None or not any(index.name == name for index in summary.attachment_indexes):
                return None
            summary.attachment_indexes = [index for index in summary.attachment_indexes if index.name == name]
            *_, last = reader.iter_attachments()
            return bytes(last.data)
    except OSError as error:
        raise BagError(f"{path}: cannot be read ({error.strerror}); check the name and the permissions") from None
    except (*DAMAGE, StopIteration, EOFError, ValueError):
        return None
