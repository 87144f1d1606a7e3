# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Every combination of what the MCAP specification leaves to the writer is read, whole and in order."""

from __future__ import annotations

import struct
from collections import defaultdict
from io import BytesIO
from pathlib import Path

import pytest
from bag_maker import CLOUD, COUNT, SECOND, Entry, cloud_entries, count_entry
from mcap.reader import NonSeekingReader
from mcap_maker import CHUNK_INDEX, Kind, kinds, make

from topo_region_seg.offline.bags import open_bag
from topo_region_seg.offline.bags.clouds import cloud_topic, decode_message
from topo_region_seg.offline.bags.mcap_index import read_index
from topo_region_seg.offline.bags.types import typestore

GROUPS: dict[str, list[Kind]] = defaultdict(list)
for _kind in kinds():
    GROUPS[f"{_kind.chunking} {_kind.statistics if _kind.summary else 'no summary'}"].append(_kind)


def entries() -> list[Entry]:
    """Clouds and counts whose log times are not in the order of the file."""
    clouds = cloud_entries(5)
    shuffled = [clouds[i] for i in (1, 0, 3, 2, 4)]
    return [*shuffled[:2], count_entry(2 * SECOND), *shuffled[2:], count_entry(4 * SECOND + 1)]


ENTRIES = entries()
WANTED = sorted(
    ((topic, time, bytes(typestore().serialize_cdr(msg, kind))) for topic, kind, time, msg in ENTRIES),
    key=lambda record: record[1],
)


def test_there_are_enough_of_them() -> None:
    assert len(kinds()) > 300
    assert len({kind.name for kind in kinds()}) == len(kinds())


@pytest.mark.parametrize("group", GROUPS)
def test_all_messages_are_read_in_order(group: str, tmp_path: Path) -> None:
    for kind in GROUPS[group]:
        path = tmp_path / "a.mcap"
        path.write_bytes(make(ENTRIES, kind))
        with open_bag(path) as reader:
            assert (reader.truncated, reader.problems) == (False, []), kind.name
            counts = {topic.name: (topic.type, topic.count) for topic in reader.topics}
            json = {"/anything": ("", 1)} if kind.schemaless else {}
            assert counts == {"/camera/points": (CLOUD, 5), "/count": (COUNT, 2), **json}, kind.name
            found = [(r.topic, r.log_time, r.data) for r in reader.messages(["/camera/points", "/count"])]
            assert found == WANTED, kind.name
            topic = cloud_topic(reader)
            assert topic.name == "/camera/points" and topic.definition, kind.name
            first = next(reader.messages([topic.name]))
            assert decode_message(first, topic).width == 32, kind.name
            wanted = () if kind.chunking == "none" or not kind.compression else (f"{kind.compression} chunks",)
            assert reader.storage().compression == wanted, kind.name
            assert reader.storage().times == (SECOND, 5 * SECOND), kind.name
            if kind.schemaless:
                assert [(r.data, r.encoding) for r in reader.messages(["/anything"])] == [(b"{}", "json")]


def test_an_index_that_leads_to_every_message_is_used() -> None:
    used = 0
    for kind in kinds():
        file = make(ENTRIES, kind)
        complete = kind.chunking in ("each", "pairs") and kind.message_index and kind.chunk_index and kind.summary
        defined = (kind.repeat_schemas and kind.repeat_channels) or not kind.definitions_outside
        found = read_index(BytesIO(file), len(file))
        assert (found is not None) == (complete and kind.statistics != "none" and defined), kind.name
        used += found is not None
    assert used > 20


@pytest.mark.parametrize("place", [16, 24, 46], ids=["offset", "length", "indexes"])
def test_an_index_that_points_out_of_the_file_is_not_used(place: int, tmp_path: Path) -> None:
    """Without a checksum of the summary, only its numbers can tell."""
    content = bytearray(make(ENTRIES, Kind(checksums=False, summary_offsets=False)))
    start = content.rindex(struct.pack("<BQ", CHUNK_INDEX, 78))
    content[start + 9 + place : start + 9 + place + 8] = b"\xff" * 8
    path = tmp_path / "a.mcap"
    path.write_bytes(content)
    with open_bag(path) as reader:
        found = [(r.topic, r.log_time, r.data) for r in reader.messages(["/camera/points", "/count"])]
    assert found == WANTED


@pytest.mark.parametrize("group", GROUPS)
def test_the_files_are_what_the_library_takes_for_valid(group: str) -> None:
    for kind in GROUPS[group]:
        if kind.padding:
            continue  # the library cannot pass over what follows the known fields of records inside of chunks
        reader = NonSeekingReader(BytesIO(make(ENTRIES, kind)), validate_crcs=True)
        found = [
            (channel.topic, message.log_time, message.data)
            for _, channel, message in reader.iter_messages()
            if channel.topic != "/anything"
        ]
        assert found == WANTED, kind.name
