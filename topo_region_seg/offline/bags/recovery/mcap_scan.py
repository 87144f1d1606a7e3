# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""MCAP files without a usable index, cut or damaged: channels and messages, found by a walk over the records."""

from __future__ import annotations

import struct
import zlib
from typing import BinaryIO

from mcap.opcode import Opcode

from topo_region_seg.offline.bags.recovery.mcap_chunks import (
    LOOSE,
    MAGIC,
    RECORD_HEAD,
    ChunkError,
    Definitions,
    Entry,
    entries_in,
    read_chunk,
)

_PIECE = 2**20
_MESSAGE = struct.Struct("<HIQQ")


class McapScan:
    """What a walk over a file finds.

    Parameters
    ----------
    file : file
        Open for reading.
    size : int
        Its length, bytes.

    Attributes
    ----------
    definitions : Definitions
        Schemas and channels.
    entries : list of Entry
        All messages, in the order of the file.
    compressions : set of str
        Of its chunks.
    damage : list of (int, ChunkError)
        Damaged chunks, by their place in the file.
    truncated : bool
        Whether the file ends before its end is written.
    changed : bool
        Whether the checksum of all data is wrong where nothing else is.
    """

    def __init__(self, file: BinaryIO, size: int) -> None:
        self.definitions = Definitions()
        self.entries: list[Entry] = []
        self.compressions: set[str] = set()
        self.damage: list[tuple[int, ChunkError]] = []
        self.changed = False
        self._file = file
        self.truncated = not self._walk(size)

    def _walk(self, size: int) -> bool:
        """Visit record by record; return whether the file is whole."""
        position = len(MAGIC)
        while position + RECORD_HEAD.size <= size:
            self._file.seek(position)
            opcode, length = RECORD_HEAD.unpack(self._file.read(RECORD_HEAD.size))
            end = position + RECORD_HEAD.size + length
            if opcode == Opcode.DATA_END:  # what follows is the summary, which is damaged or of no use
                self.changed = not self.damage and self._wrong_checksum(position)
                self._file.seek(size - len(MAGIC))
                return self._file.read() == MAGIC
            if opcode == 0 or (end > size and opcode != Opcode.CHUNK):
                return False
            try:
                self._visit(position, opcode, length, cut=end > size)
            except ChunkError as error:
                if end > size:
                    return False
                self.damage.append((position, error))
            position = end
        return False

    def _wrong_checksum(self, data_end: int) -> bool:
        """Whether the data before the record that ends it is not what its checksum says; 0 stands for none."""
        expected = self._file.read(4)
        checksum = 0
        self._file.seek(0)
        while data_end > 0 and (piece := self._file.read(min(data_end, _PIECE))):
            checksum = zlib.crc32(piece, checksum)
            data_end -= len(piece)
        return expected not in (bytes(4), struct.pack("<I", checksum))

    def _visit(self, position: int, opcode: int, length: int, cut: bool) -> None:
        if opcode == Opcode.CHUNK:
            data, compression = read_chunk(self._file, position, may_be_cut=cut)
            self.compressions.add(compression)
            self.entries += entries_in(data, position, self.definitions)
        elif opcode in (Opcode.SCHEMA, Opcode.CHANNEL):
            self.definitions.learn(opcode, self._file.read(length))
        elif opcode == Opcode.MESSAGE and length >= _MESSAGE.size:
            number, _, log_time, _ = _MESSAGE.unpack(self._file.read(_MESSAGE.size))
            self.entries.append(Entry(log_time, position, LOOSE, number))
