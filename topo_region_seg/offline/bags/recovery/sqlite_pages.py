# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Rows out of the pages of an sqlite3 file, whether or not its trees still lead to them.

The layout is that of https://www.sqlite.org/fileformat2.html. A row lies in a cell of a leaf page and, where it is
long, goes on in a chain of overflow pages. SQLite allocates the page above the first leaves after them, so that a file
that is cut may hold thousands of rows that no query reaches.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple, Protocol

LEAF = 0x0D
INTEGERS = {1: 1, 2: 2, 3: 3, 4: 4, 5: 6, 6: 8, 8: 0, 9: 0}
"""Bytes of a whole number by its serial type; the last two are the constants 0 and 1."""


class Bytes(Protocol):
    """A file in memory, such as ``mmap.mmap``."""

    def __len__(self) -> int:
        """Return the number of bytes."""

    def __getitem__(self, key: slice, /) -> bytes:
        """Return some of them."""


class Row(NamedTuple):
    """A whole row: its number, the numbers before its last column, and where the bytes of that column lie."""

    number: int
    values: tuple[int, ...]
    spans: tuple[tuple[int, int], ...]


def is_cut(path: Path) -> bool:
    """Return whether a file ends before its last page; SQLite takes what is missing of that one for zeros."""
    with path.open("rb") as file:
        head = file.read(100)
    if len(head) < 100:
        return True
    size, changes, pages, valid_for = struct.unpack(">16xH6xII60xI", head[:96])
    return bool(changes == valid_for and path.stat().st_size < (65536 if size == 1 else size) * pages)


class Pages:
    """The whole pages of a file; those of the last part of a page are left out.

    Raises
    ------
    ValueError
        The file begins with no header of sqlite3.
    """

    def __init__(self, data: Bytes) -> None:
        head = data[:100]
        if len(head) < 100 or head[:15] != b"SQLite format 3":
            raise ValueError("no sqlite3 header")
        size, reserved = struct.unpack(">16xH2xB", head[:21])
        self._size = 65536 if size == 1 else size
        self._usable = self._size - reserved
        if self._size < 512 or self._size & (self._size - 1) or self._usable < 480:
            raise ValueError(f"no possible page size ({self._size})")
        self._data = data
        self._count = len(data) // self._size
        # A page is in one chain only; this also bounds the time that a forged file can take.
        self._taken = bytearray(self._count + 1)

    def rows(self, columns: int) -> Iterator[Row]:
        """Yield the whole rows of `columns` columns: the number of the row, whole numbers, and bytes last."""
        kinds = self._data[:: self._size] if self._count else b""
        for page in range(1, self._count):
            if kinds[page] == LEAF:
                yield from self._leaf(page * self._size, columns)

    def _leaf(self, start: int, columns: int) -> Iterator[Row]:
        page = self._data[start : start + self._usable]
        (cells,) = struct.unpack_from(">H", page, 3)
        # Two bytes that point at a cell and seven that its row needs at least: a forged page cannot have more of them.
        if 8 + 9 * cells > len(page):
            return
        for place in struct.unpack_from(f">{cells}H", page, 8):
            try:
                row = self._cell(page, start, place, columns)
            except IndexError:
                continue  # beyond the page: no cell
            if row is not None:
                yield row

    def _cell(self, page: bytes, start: int, place: int, columns: int) -> Row | None:
        payload, place = _varint(page, place)
        number, place = _varint(page, place)
        usable = self._usable
        most, least = usable - 35, (usable - 12) * 32 // 255 - 23
        wanted = least + (payload - least) % (usable - 4)
        local = payload if payload <= most else wanted if wanted <= most else least
        if place + local + (4 if local < payload else 0) > usable:
            return None
        header, at = _varint(page, place)
        kinds: list[int] = []
        while at < place + header and len(kinds) <= columns:
            kind, at = _varint(page, at)
            kinds.append(kind)
        if at != place + header or len(kinds) != columns:
            return None
        first, *middle, last = kinds
        if first != 0 or last < 12 or last % 2 or any(kind not in INTEGERS for kind in middle):
            return None
        values = []
        for kind in middle:
            raw = page[at : at + INTEGERS[kind]]
            values.append(int.from_bytes(raw, "big", signed=True) if raw else kind - 8)
            at += len(raw)
        if at - place + (last - 12) // 2 != payload or at > place + local:
            return None
        spans = [(start + at, start + place + local)]
        if local < payload:
            (following,) = struct.unpack_from(">I", page, place + local)
            rest = self._chain(following, payload - local)
            if rest is None:
                return None
            spans += rest
        return Row(number, tuple(values), tuple(spans))

    def _chain(self, page: int, size: int) -> list[tuple[int, int]] | None:
        """Return where `size` bytes lie that begin on overflow page `page`, counted from 1; None if any is missing."""
        spans = []
        while size > 0:
            if not 1 < page <= self._count or self._taken[page]:
                return None
            self._taken[page] = 1
            start = (page - 1) * self._size
            length = min(size, self._usable - 4)
            spans.append((start + 4, start + 4 + length))
            size -= length
            (page,) = struct.unpack(">I", self._data[start : start + 4])
        return spans if page == 0 else None


def _varint(data: bytes, place: int) -> tuple[int, int]:
    """Read a number of one to nine bytes; return it and the place behind it."""
    value = 0
    for _ in range(8):
        byte = data[place]
        place += 1
        value = value << 7 | byte & 0x7F
        if byte < 0x80:
            return value, place
    return value << 8 | data[place], place + 1
