# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Small recordings of every kind with one bit flipped, or cut anywhere: what is lost is told, and no read runs away."""

from __future__ import annotations

import os
import resource
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

import clouds
import lz4.frame
import numpy as np
import pytest
from bag_maker import CLOUD, SECOND, Entry, count_entry, first_x
from mcap_maker import Kind, make
from recording_maker import Ros1Kind, SqliteKind, write_ros1, write_sqlite

from topo_region_seg.cloud.layout import CloudFormatError
from topo_region_seg.offline.bags import BagError, open_bag
from topo_region_seg.offline.bags.attachments import read_attachment
from topo_region_seg.offline.bags.clouds import cloud_topic, decode_message
from topo_region_seg.offline.bags.recovery.bounded import BoundedFile

COUNT = 4
HEADROOM = 2**27
"""Bytes of memory to ask for beyond what the process has; no file here is larger than 10 kB."""
TEXT = 24
"""Bytes of a run of letters and spaces, such as a definition of a type, of which not each one is tried."""


class Case(NamedTuple):
    """A kind of recording, and whether checksums tell of its clouds' points."""

    write: Callable[[Path], Path]
    checked: bool


def small() -> list[Entry]:
    """Clouds of two points, whose x tells which one it is, and another message."""
    found: list[Entry] = []
    for i in range(1, COUNT + 1):
        xyz = np.array([[i, 0, 1], [i, 1, 1]], np.float32)
        found.append(("/points", CLOUD, i * SECOND, clouds.message(xyz, np.full((2, 3), i, np.uint8), sec=i)))
    return [*found[:2], count_entry(2 * SECOND), *found[2:]]


def mcap(**kind: Any) -> Case:
    def write(folder: Path) -> Path:
        path = folder / "a.mcap"
        path.write_bytes(make(small(), Kind(**kind)))
        return path

    return Case(write, bool(kind.get("checksums", True)))


def ros1(compression: str, checked: bool) -> Case:
    kind = Ros1Kind(compression=compression, chunk_threshold=500)
    return Case(lambda folder: write_ros1(folder / "a.bag", small(), kind), checked)


CASES = {
    "mcap": mcap(compression="", chunking="pairs"),
    "mcap zstd": mcap(compression="zstd", definitions_outside=True),
    "mcap lz4": mcap(compression="lz4", chunking="pairs", attachments=True, metadata=True),
    "mcap unchecked": mcap(compression="", definitions_outside=True, checksums=False, summary_offsets=False),
    "mcap without chunks": mcap(chunking="none"),
    "mcap without summary": mcap(summary=False, chunking="pairs"),
    "mcap without indexes": mcap(message_index=False, chunk_index=False, definitions_outside=True),
    "ROS 1": ros1("none", False),
    "ROS 1 bz2": ros1("bz2", True),
    "ROS 1 lz4": ros1("lz4", False),
    "sqlite3": Case(lambda folder: write_sqlite(folder / "a", small(), SqliteKind(5, page_size=512)), False),
}


def tried(data: bytes, checked: bool) -> list[int]:
    """Return the places of a file that are tried: all but most of its texts, and points that nothing protects."""
    wanted = np.ones(len(data), bool)
    if not checked:
        points = [message.data.tobytes() for _, kind, _, message in small() if kind == CLOUD]
        for one in points:
            start = data.find(one)
            wanted[start : start + len(one)] = start < 0
        start = data.find(b"\x04\x22\x4d\x18")
        while start >= 0:
            stream = lz4.frame.LZ4FrameDecompressor()
            stream.decompress(data[start:])
            end = len(data) - len(stream.unused_data or b"")
            wanted[start:end] = False
            start = data.find(b"\x04\x22\x4d\x18", end)
    run = 0
    for place, byte in enumerate(data):
        run = run + 1 if 32 <= byte < 127 or byte == 10 else 0
        wanted[place] &= run < TEXT or run % 61 == 0
    return [int(place) for place in np.flatnonzero(wanted)]


@pytest.fixture
def little_memory() -> Iterator[None]:
    """Let a read fail that asks for all that a damaged length claims."""
    pages = int(Path("/proc/self/statm").read_text().split()[0])
    before = resource.getrlimit(resource.RLIMIT_AS)
    resource.setrlimit(resource.RLIMIT_AS, (pages * os.sysconf("SC_PAGE_SIZE") + HEADROOM, before[1]))
    yield
    resource.setrlimit(resource.RLIMIT_AS, before)


def wrong(path: Path) -> str:
    """Return what is wrong with how a recording is read, "" where nothing is."""
    found, refused = [], 0
    try:
        with open_bag(path) as reader:
            topic = cloud_topic(reader)
            for record in reader.messages([topic.name]):
                try:
                    found.append((first_x(decode_message(record, topic)), record.log_time))
                except CloudFormatError:
                    refused += 1
    except BagError as error:
        return "" if str(error).startswith(str(path)) and "\n" not in str(error) else f"an error of {error!r}"
    except Exception as error:  # all others are what is looked for
        return f"raises {error!r}"
    if any("\n" in problem or not problem.startswith(str(path)) for problem in reader.problems):
        return f"problems of {reader.problems}"
    whole = found == [(float(i), i * SECOND) for i in range(1, COUNT + 1)]
    return "" if whole or refused or reader.problems or reader.truncated else f"not a word about {found}"


@pytest.mark.parametrize("name", CASES)
def test_whatever_bit_is_flipped(name: str, tmp_path: Path, little_memory: None) -> None:
    """All clouds, or a word about what is wrong."""
    path = CASES[name].write(tmp_path)
    file = next(path.glob("*.db3")) if path.is_dir() else path
    data = file.read_bytes()
    assert wrong(path) == ""
    places = tried(data, CASES[name].checked)
    assert len(places) > 700
    bad = {}
    for place in places:
        for bit in (place % 3, 5 + place % 3):
            flipped = bytearray(data)
            flipped[place] ^= 1 << bit
            file.write_bytes(flipped)
            if found := wrong(path):
                bad[place, bit] = found
    assert bad == {}


@pytest.mark.parametrize("name", CASES)
def test_wherever_a_file_is_cut(name: str, tmp_path: Path, little_memory: None) -> None:
    path = CASES[name].write(tmp_path)
    file = next(path.glob("*.db3")) if path.is_dir() else path
    data = file.read_bytes()
    bad = {}
    for size in tried(data, True)[::3]:
        file.write_bytes(data[:size])
        if found := wrong(path):
            bad[size] = found
    assert bad == {}


def test_an_attachment_with_a_flipped_bit_is_not_used(tmp_path: Path, little_memory: None) -> None:
    path = CASES["mcap lz4"].write(tmp_path)
    data = path.read_bytes()
    assert read_attachment(path, "notes.txt") == b"hello"
    start = data.index(b"notes.txt") - 29
    for place in range(start, data.index(b"hello") + 9):
        for bit in range(8):
            flipped = bytearray(data)
            flipped[place] ^= 1 << bit
            path.write_bytes(flipped)
            if start < place < start + 9:  # the length of the record is told by the index, too
                assert read_attachment(path, "notes.txt") == b"hello"
                continue
            with pytest.raises(BagError, match=r"^\S+: its attachment 'notes.txt' is damaged.*; make the file again$"):
                read_attachment(path, "notes.txt")
    for place in range(data.index(b"hello") + 9, len(data)):
        flipped = bytearray(data)
        flipped[place] ^= 1 << (place * 3) % 8
        path.write_bytes(flipped)
        try:
            assert read_attachment(path, "notes.txt") in (b"hello", None)
        except BagError as error:  # its index points elsewhere
            assert str(error).endswith("make the file again")


def test_a_read_ends_where_the_file_does(tmp_path: Path, little_memory: None) -> None:
    path = tmp_path / "a"
    path.write_bytes(b"0123456789")
    with BoundedFile(path) as file:
        assert file.length == 10
        assert [file.read(3), file.read(2**40), file.read(2**64), file.read(0)] == [b"012", b"3456789", b"", b""]
        assert (file.seek(2**70), file.read(1), file.read(-1)) == (10, b"", b"")
        assert (file.seek(-4, os.SEEK_END), file.read(None), file.seek(8), file.read()) == (6, b"6789", 8, b"89")
