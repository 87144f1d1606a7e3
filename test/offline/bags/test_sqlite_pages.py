# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Rows read out of the pages of a file that SQLite wrote: all of a table of messages, and none of any other."""

from __future__ import annotations

import random
import sqlite3
from pathlib import Path

import pytest

from topo_region_seg.offline.bags.recovery.sqlite_pages import Pages

EDGES = [0, 1, *(sign * 2**bits + one for bits in (7, 15, 23, 31, 47) for sign in (1, -1) for one in (-1, 0, 1))]
EDGES += [2**63 - 1, -(2**63), 2, -1]
NUMBERS = [2**14, 2**21 - 1, 2**28, 2**35, 2**42, 2**49, 2**56 - 1, 2**56, 2**62, 2**63 - 1, -1, -(2**63), *range(130)]


@pytest.mark.parametrize("page_size", [512, 1024, 4096, 65536])
@pytest.mark.parametrize("reserved", [0, 12])
def test_rows_of_all_sizes(page_size: int, reserved: int, tmp_path: Path) -> None:
    dice = random.Random(page_size)
    usable = page_size - reserved
    sizes = [
        *range(5),
        *(usable + step for step in range(-60, 10)),
        3 * usable,
        *(dice.randint(0, 9999) for _ in range(60)),
    ]
    path = tmp_path / "a.db3"
    database = sqlite3.connect(path)
    database.execute(f"PRAGMA page_size = {page_size}")
    if reserved:
        database.execute("VACUUM")
        database.close()
        _reserve(path, reserved)
        database = sqlite3.connect(path)
    database.execute("CREATE TABLE others (id INTEGER PRIMARY KEY, a, b, c)")
    database.execute("CREATE TABLE messages (id INTEGER PRIMARY KEY, a INTEGER, b INTEGER, c BLOB)")
    wanted = {}
    for number, size in zip(NUMBERS[: len(sizes)], sizes, strict=True):
        row = dice.choice(EDGES), dice.choice(EDGES), dice.randbytes(size)
        wanted[number % 2**64] = row  # as it stands there
        database.execute("INSERT INTO messages VALUES (?, ?, ?, ?)", (number, *row))
    other = ["text", 1.5, None, 7, b"bytes"]
    for a in other:
        for b in other:
            for c in other:
                if not (isinstance(a, int) and isinstance(b, int) and isinstance(c, bytes)):
                    database.execute("INSERT INTO others (a, b, c) VALUES (?, ?, ?)", (a, b, c))
    for columns in (3, 5):
        names = ", ".join("cdefg"[: columns - 2])
        database.execute(f"CREATE TABLE t{columns} (id INTEGER PRIMARY KEY, {names}, blob BLOB)")
        database.execute(f"INSERT INTO t{columns} VALUES ({', '.join('1' * (columns - 1))}, x'00')")
    database.commit()
    database.close()
    data = path.read_bytes()
    assert len(data) % page_size == 0 and data[20] == reserved
    found = {}
    for row in Pages(data).rows(4):
        assert row.number not in found
        found[row.number] = (*row.values, b"".join(data[start:end] for start, end in row.spans))
    assert found == wanted
    # Of a file that is cut, the rows that are whole.
    for size in (len(data) // 3, len(data) // 2, len(data) - 1):
        some = {row.number: row.spans for row in Pages(data[:size]).rows(4)}
        assert some.keys() <= wanted.keys()
        for number, spans in some.items():
            assert b"".join(data[start:end] for start, end in spans) == wanted[number][2]
            assert all(end <= size for _, end in spans)


def _reserve(path: Path, reserved: int) -> None:
    """Let the end of each page be reserved, as encryption does; the file has one page, the empty schema."""
    data = bytearray(path.read_bytes())
    page_size = len(data)
    assert data[100] == 0x0D and data[103:105] == b"\0\0"
    data[20] = reserved
    data[105:107] = ((page_size - reserved) % 65536).to_bytes(2, "big")
    path.write_bytes(data)


@pytest.mark.parametrize("head", [b"", b"SQLite format 3\0", b"SQLite format 4\0" + b"\x10\0" * 50, bytes(200)])
def test_what_is_no_file_of_sqlite(head: bytes) -> None:
    with pytest.raises(ValueError, match="no sqlite3 header"):
        Pages(head)


@pytest.mark.parametrize("size", [0, 2, 256, 513, 1000, 4097])
def test_impossible_page_sizes(size: int) -> None:
    with pytest.raises(ValueError, match="no possible page size"):
        Pages(b"SQLite format 3\0" + size.to_bytes(2, "big") + bytes(8192))
