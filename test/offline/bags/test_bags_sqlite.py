# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""sqlite3 recordings that are cut, damaged or split."""

from __future__ import annotations

import json
import shutil
import sqlite3
import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from bag_maker import cloud_entries, count_entry, first_x, write_folder, write_mcap, write_split_folder
from recording_maker import SqliteKind, write_sqlite
from rosbags.rosbag2 import StoragePlugin

from topo_region_seg.offline.bags import BagError, open_bag
from topo_region_seg.offline.bags.records import Record
from topo_region_seg.offline.bags.recovery.sqlite_pages import Pages
from topo_region_seg.offline.bags.types import typestore
from topo_region_seg.offline.cli.main import main

CLOUDS = 40
PAGE = 4096
LEAF = 9
"""The start of a row, from which the rest is found, is written with those of so many clouds or fewer."""


def records(path: Path) -> tuple[list[Record], Any]:
    with open_bag(path) as reader:
        return list(reader.messages([topic.name for topic in reader.topics])), reader


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A plain .db3: clouds of several pages each, with small messages between them."""
    folder = tmp_path_factory.mktemp("whole")
    entries = sorted([*cloud_entries(CLOUDS), *(count_entry(i * 10**9) for i in range(1, CLOUDS))], key=lambda e: e[2])
    return write_folder(folder / "a", entries, StoragePlugin.SQLITE3) / "a.db3"


def split(folder: Path, files: list[Path]) -> Path:
    folder.mkdir()
    for file in files:
        shutil.copy(file, folder)
    text = {"version": 9, "storage_identifier": "sqlite3", "relative_file_paths": [file.name for file in files]}
    (folder / "metadata.yaml").write_text(yaml.safe_dump({"rosbag2_bagfile_information": text}))
    return folder


def test_every_cut_gives_the_whole_messages_before_it(whole: Path, tmp_path: Path) -> None:
    data, (wanted, reader) = whole.read_bytes(), records(whole)
    assert len(wanted) == 2 * CLOUDS - 1 and not reader.truncated
    cut = tmp_path / "cut.db3"
    seen = []
    places = np.random.default_rng(0).integers(0, len(data) - 1, 60)
    for size in (*sorted(places.tolist()), *range(0, len(data) - 1, 7 * PAGE), len(data) - 1):
        cut.write_bytes(data[:size])
        try:
            found, reader = records(cut)
        except BagError as error:
            assert str(error).startswith(str(cut)) and "\n" not in str(error)
            assert size < len(data) * LEAF / CLOUDS + 10 * PAGE
            continue
        assert reader.truncated and reader.problems == []
        # In the order in which they were written, which for this recording is that of the log. Only of those whose
        # rows begin in the last leaf may one be missing before another.
        kept = {(record.topic, record.log_time) for record in found}
        assert found == [record for record in wanted if (record.topic, record.log_time) in kept]
        assert found[: -2 * LEAF] == wanted[: max(0, len(found) - 2 * LEAF)]
        assert len(found) > len(wanted) * size / len(data) - 2 * LEAF
        assert sum(topic.count for topic in reader.topics) == len(found)
        assert reader.storage().kind == "sqlite3"
        assert all(topic.definition for topic in reader.topics)
        seen.append((size, len(found)))
    assert len({count for _, count in seen}) > CLOUDS // LEAF
    assert [count for _, count in sorted(seen)] == sorted(count for _, count in seen)


@pytest.mark.parametrize("cut", [False, True])
def test_messages_come_in_the_order_of_the_log_whatever_the_order_of_their_rows(cut: bool, tmp_path: Path) -> None:
    """Equal times in the order in which they were written."""
    written = [5, 2, 9, 2, 7, 1, 8, 3, 9, 4] * 3
    entries = [
        (name, kind, written[i] * 10**9, message) for i, (name, kind, _, message) in enumerate(cloud_entries(30))
    ]
    path = write_folder(tmp_path / "a", entries, StoragePlugin.SQLITE3) / "a.db3"
    if cut:
        path.write_bytes(path.read_bytes()[: -3 * PAGE])
    found, reader = records(path)
    assert reader.truncated == cut
    numbers = [int(first_x(typestore().deserialize_cdr(record.data, record.type))) - 1 for record in found]
    assert len(numbers) == 30 if not cut else 15 < len(numbers) < 30
    assert numbers == sorted(numbers, key=lambda number: (written[number], number))
    assert [record.log_time for record in found] == [written[number] * 10**9 for number in numbers]


def test_replay_of_a_cut_file_does_what_is_whole_and_says_so(whole: Path, tmp_path: Path) -> None:
    data = whole.read_bytes()
    cut, summary = tmp_path / "cut.db3", tmp_path / "s.json"
    cut.write_bytes(data[: len(data) // 2])
    arguments = ["--set", "voxel_size=0", "--json", str(summary)]
    assert main(["replay", str(cut), *arguments]) == 3
    found = json.loads(summary.read_text())
    assert found["truncated"] and 1 < len(found["frames"]) < CLOUDS
    assert [frame["stamp"] for frame in found["frames"]] == [i + 2e-9 for i in range(1, len(found["frames"]) + 1)]


def test_noise_in_the_file_costs_messages_but_never_invents_a_topic_or_hangs(whole: Path, tmp_path: Path) -> None:
    random = np.random.default_rng(1)
    data, (wanted, _) = whole.read_bytes(), records(whole)
    names = {record.topic for record in wanted}
    path = tmp_path / "noisy.db3"
    problems = 0
    for _ in range(40):
        spoiled = bytearray(data)
        # From the second half of the first pages, where tables begin, to the end.
        for page in random.integers(8, len(data) // PAGE, 2):
            spoiled[page * PAGE : page * PAGE + 64] = random.integers(0, 256, 64, np.uint8).tobytes()
        path.write_bytes(spoiled)
        try:
            found, reader = records(path)
        except BagError as error:
            assert str(error).startswith(str(path)) and "\n" not in str(error)
            continue
        assert len(found) <= len(wanted) and {record.topic for record in found} <= names
        assert len(found) == len(wanted) or reader.problems
        problems += bool(reader.problems)
    assert problems


def test_forged_pages_cost_no_more_than_their_bytes(whole: Path, tmp_path: Path) -> None:
    """Every page is a leaf whose cells all claim the same long chain."""
    data = bytearray(whole.read_bytes())
    first = next(page for page in range(8, len(data) // PAGE) if data[page * PAGE] == 0x0D)
    leaf = data[first * PAGE : (first + 1) * PAGE]
    cells = (PAGE - 8) // 9
    (place,) = struct.unpack_from(">H", leaf, 8)  # a cloud
    struct.pack_into(">H", leaf, 3, cells)
    struct.pack_into(f">{cells // 2}H", leaf, 8, *([place] * (cells // 2)))
    wanted, _ = records(whole)
    path = tmp_path / "forged.db3"
    path.write_bytes(data + leaf * 100)
    with path.open("r+b") as file:
        file.seek(28)
        file.write(struct.pack(">I", len(data) // PAGE + 200))  # so that it is read page by page
    taken = [row for row in Pages(path.read_bytes()).rows(4) if len(row.spans) > 1]
    pages = [start // PAGE for row in taken for start, _ in row.spans[1:]]
    assert pages and len(pages) == len(set(pages)), "no page is in two rows"
    found, _ = records(path)
    assert len(found) <= len(wanted)


@pytest.mark.parametrize("schema", ["CREATE VIEW messages AS SELECT 1", "CREATE TABLE messages (id INTEGER)"])
def test_tables_that_are_not_those_of_a_recording(schema: str, tmp_path: Path) -> None:
    path = tmp_path / "a.db3"
    with sqlite3.connect(path) as database:
        database.executescript(f"CREATE TABLE topics (id INTEGER, name TEXT, type TEXT); {schema}")
    database.close()
    with pytest.raises(BagError, match=r"a\.db3"):
        open_bag(path)


def test_what_a_killed_recorder_left_in_its_log_is_told(tmp_path: Path) -> None:
    path = write_sqlite(tmp_path / "a", cloud_entries(2), SqliteKind(journal="wal", folder=False))
    assert records(path)[1].problems == []
    killed = tmp_path / "killed"
    with sqlite3.connect(path) as database:
        database.execute("PRAGMA wal_autocheckpoint = 0")
        database.execute("INSERT INTO messages (topic_id, timestamp, data) VALUES (1, 3000000000, x'00')")
        database.commit()
        shutil.copytree(path.parent, killed)
    database.close()
    found, reader = records(killed / path.name)
    assert [record.log_time for record in found] == [10**9, 2 * 10**9]
    assert len(reader.problems) == 1 and f"{path.name}-wal is not read" in reader.problems[0]


def test_a_damaged_part_of_a_split_recording_costs_only_itself(whole: Path, tmp_path: Path) -> None:
    more = write_folder(tmp_path / "b", cloud_entries(3, start=50), StoragePlugin.SQLITE3) / "b.db3"
    data = whole.read_bytes()
    cut, noise = tmp_path / "cut.db3", tmp_path / "noise.db3"
    cut.write_bytes(data[: len(data) // 2])
    noise.write_bytes(data[:16] + bytes(3 * PAGE))

    found, reader = records(split(tmp_path / "one", [cut, more]))
    assert reader.truncated and reader.problems == []
    assert [record.log_time // 10**9 for record in found][-3:] == [50, 51, 52] and len(found) > 10

    found, reader = records(split(tmp_path / "two", [more, noise]))
    assert [record.log_time // 10**9 for record in found] == [50, 51, 52]
    assert not reader.truncated
    assert len(reader.problems) == 1 and str(tmp_path / "two" / "noise.db3") in reader.problems[0]

    with pytest.raises(BagError, match=r"noise\.db3"):
        open_bag(split(tmp_path / "three", [noise]))
    noise.write_bytes(b"")
    with pytest.raises(BagError, match=r"noise\.db3: the file is empty"):
        open_bag(split(tmp_path / "four", [noise]))


def test_a_part_that_is_no_mcap_file_costs_only_itself(tmp_path: Path, capsys: Any) -> None:
    folder = write_split_folder(
        tmp_path / "a", [cloud_entries(2), cloud_entries(2, start=3), cloud_entries(1, start=5)]
    )
    (folder / "split_1.mcap").write_bytes(b"no recording")
    assert main(["replay", str(folder), "--json", str(tmp_path / "s.json")]) == 1
    frames = json.loads((tmp_path / "s.json").read_text())["frames"]
    assert [frame["stamp"] for frame in frames] == [i + 2e-9 for i in (1, 2, 5)]
    assert str(folder / "split_1.mcap") in capsys.readouterr().err


def test_a_folder_without_metadata_names_the_database_in_it(whole: Path, tmp_path: Path) -> None:
    shutil.copy(whole, tmp_path)
    with pytest.raises(BagError, match=r"give .*a\.db3 itself"):
        open_bag(tmp_path)


def test_a_storage_that_is_not_known(tmp_path: Path) -> None:
    folder = split(tmp_path / "a", [write_mcap(tmp_path / "a.mcap", cloud_entries(1))])
    text = (folder / "metadata.yaml").read_text().replace("sqlite3", "tape")
    (folder / "metadata.yaml").write_text(text)
    with pytest.raises(BagError, match="storage 'tape' is not known"):
        open_bag(folder)
