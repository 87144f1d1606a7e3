# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Recordings as they come: split, compressed, cut, damaged, out of order, our own; and ours, as others read them."""

from __future__ import annotations

import json
import os
import re
import shutil
import struct
import zlib
from pathlib import Path
from typing import Any

import bag_maker
import numpy as np
import pytest
import yaml
import zstandard
from bag_maker import (
    CLOUD,
    COUNT,
    SECOND,
    Entry,
    chunks_of,
    cloud_entries,
    count_entry,
    damage,
    first_x,
    ros1_message,
    write_folder,
    write_mcap,
    write_split_folder,
)
from mcap.reader import make_reader
from mcap.writer import CompressionType, IndexType
from rosbags.rosbag1 import Writer as Ros1Writer
from rosbags.rosbag2 import Reader, StoragePlugin
from rosbags.rosbag2 import Writer as Ros2Writer
from rosbags.rosbag2.enums import CompressionFormat, CompressionMode
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from topo_region_seg.cloud.messages.topics import OUTPUTS
from topo_region_seg.offline.bags import BagError, BagWriter, open_bag
from topo_region_seg.offline.bags.clouds import cloud_topic, decode_message
from topo_region_seg.offline.bags.types import typestore
from topo_region_seg.offline.cli.main import main

ENTRIES = [*cloud_entries(3), count_entry()]
SMALL = ["--set", "normal_radius=0.02", "--set", "min_region_size=100"]
ROS1_COMPRESSION = {
    "none": None,
    "bz2": Ros1Writer.CompressionFormat.BZ2,
    "lz4": Ros1Writer.CompressionFormat.LZ4,
}


def read(path: Path) -> tuple[list[float], Any]:
    with open_bag(path) as reader:
        topic = cloud_topic(reader)
        return [first_x(decode_message(r, topic)) for r in reader.messages([topic.name])], reader


def write_compressed(path: Path, plugin: StoragePlugin, mode: CompressionMode) -> Path:
    """Write a rosbag2 folder as `ros2 bag record --compression-mode` does."""
    writer = Ros2Writer(path, version=9, storage_plugin=plugin)
    writer.set_compression(mode, CompressionFormat.ZSTD)
    with writer:
        connections: dict[str, Any] = {}
        for topic, kind, log_time, message in ENTRIES:
            if topic not in connections:
                connections[topic] = writer.add_connection(topic, kind, typestore=typestore())
            writer.write(connections[topic], log_time, typestore().serialize_cdr(message, kind))
    return path


def write_ros1(path: Path, compression: str, chunk_threshold: int = 2**20, entries: list[Entry] | None = None) -> Path:
    store = get_typestore(Stores.ROS1_NOETIC)
    writer = Ros1Writer(path)
    if ROS1_COMPRESSION[compression]:
        writer.set_compression(ROS1_COMPRESSION[compression])
    writer.chunk_threshold = chunk_threshold
    with writer:
        connection = writer.add_connection("/camera/points", CLOUD, typestore=store)
        for number, (_, kind, log_time, message) in enumerate(entries or cloud_entries(3)):
            writer.write(connection, log_time, store.serialize_ros1(ros1_message(store, message, number), kind))
    return path


def replay(bag: Path, folder: Path, *arguments: str, status: int = 0) -> dict[str, Any]:
    summary = folder / "s.json"
    assert main(["replay", str(bag), "--json", str(summary), *SMALL, *arguments]) == status
    return dict(json.loads(summary.read_text()))


def labels_of(bag: Path) -> list[Any]:
    with open_bag(bag) as reader:
        topic = next(topic for topic in reader.topics if topic.name == "/labeled_points")
        messages = [decode_message(record, topic) for record in reader.messages([topic.name])]
    return [np.asarray(msg.data).reshape(-1, 20)[:, 16:].copy().view("<u4")[:, 0] for msg in messages]


# --- split and compressed ---


def test_split_sqlite3(tmp_path: Path) -> None:
    parts = [write_folder(tmp_path / f"p{i}", cloud_entries(2, start=1 + 2 * i), StoragePlugin.SQLITE3) for i in (0, 1)]
    whole = tmp_path / "whole"
    whole.mkdir()
    content = yaml.safe_load((parts[0] / "metadata.yaml").read_text())
    information = content["rosbag2_bagfile_information"]
    information["relative_file_paths"] = [f"p{i}.db3" for i in (0, 1)]
    information["topics_with_message_count"][0]["message_count"] = information["message_count"] = 4
    (whole / "metadata.yaml").write_text(yaml.safe_dump(content))
    for part in parts:
        shutil.copy(part / f"{part.name}.db3", whole)
    numbers, reader = read(whole)
    assert numbers == [1.0, 2.0, 3.0, 4.0]
    assert reader.count("/camera/points") == 4
    assert [frame["stamp"] for frame in replay(whole, tmp_path)["frames"]] == [n + 2e-9 for n in (1, 2, 3, 4)]


@pytest.mark.parametrize("plugin", [StoragePlugin.MCAP, StoragePlugin.SQLITE3], ids=lambda plugin: plugin.name)
@pytest.mark.parametrize("mode", [CompressionMode.FILE, CompressionMode.MESSAGE], ids=lambda mode: mode.name)
def test_compressed_by_rosbag2(plugin: StoragePlugin, mode: CompressionMode, tmp_path: Path) -> None:
    path = write_compressed(tmp_path / "a", plugin, mode)
    numbers, reader = read(path)
    assert numbers == [1.0, 2.0, 3.0]
    assert not reader.truncated and reader.problems == []
    assert reader.count("/count") == 1
    found = replay(path, tmp_path)
    assert [frame["stamp"] for frame in found["frames"]] == [n + 2e-9 for n in (1, 2, 3)]


def test_a_file_that_is_compressed_and_cut(tmp_path: Path) -> None:
    path = write_compressed(tmp_path / "a", StoragePlugin.MCAP, CompressionMode.FILE)
    (packed,) = path.glob("*.zstd")
    inner = zstandard.ZstdDecompressor().stream_reader(packed.read_bytes()).read()
    # Incompressible enough to be of many blocks: the recording again, each message in a chunk of its own.
    mcap = write_mcap(tmp_path / "b.mcap", ENTRIES, compression=CompressionType.NONE)
    assert len(inner) > 0
    cut = mcap.read_bytes()[: chunks_of(mcap)[1][1] + 30]
    packed.write_bytes(zstandard.ZstdCompressor().compress(cut))
    numbers, reader = read(path)
    assert numbers == [1.0, 2.0] and reader.truncated and reader.problems == []
    assert replay(path, tmp_path, status=3)["truncated"]

    whole = zstandard.ZstdCompressor(level=-50).compress(mcap.read_bytes() + os.urandom(400_000))
    packed.write_bytes(whole[: len(whole) // 2])
    numbers, reader = read(path)
    assert numbers == [1.0, 2.0, 3.0][: len(numbers)] and numbers and reader.truncated

    packed.write_bytes(b"\x28\xb5\x2f\xfd" + os.urandom(200))
    with pytest.raises(BagError, match="nothing of it can be decompressed") as caught:
        open_bag(path)
    assert str(caught.value).startswith(str(packed))


def test_the_last_file_of_a_killed_recorder_is_not_compressed_yet(tmp_path: Path) -> None:
    path = write_compressed(tmp_path / "a", StoragePlugin.MCAP, CompressionMode.FILE)
    (packed,) = path.glob("*.zstd")
    write_mcap(packed, cloud_entries(2, start=7))
    assert read(path)[0] == [7.0, 8.0]


def test_a_compressed_message_that_is_damaged_is_left_out(tmp_path: Path) -> None:
    def pack(message: Any) -> bytes:
        return zstandard.ZstdCompressor(write_checksum=True).compress(bytes(typestore().serialize_cdr(message, CLOUD)))

    entries: list[Entry] = [(topic, kind, time, pack(msg)) for topic, kind, time, msg in cloud_entries(3)]
    spoiled = bytearray(entries[1][3])
    spoiled[len(spoiled) // 2] ^= 0x10
    for bad in (bytes(spoiled), entries[1][3][:-40], b""):
        entries[1] = (*entries[1][:3], bad)
        path = tmp_path / f"{len(bad)}"
        write_split_folder(path, [entries])
        text = (path / "metadata.yaml").read_text()
        (path / "metadata.yaml").write_text(f"{text}  compression_format: zstd\n  compression_mode: MESSAGE\n")
        numbers, reader = read(path)
        assert numbers == [1.0, 3.0], bad[:4]
        assert len(reader.problems) == 1 and f"log time {2 * SECOND}" in reader.problems[0]


def test_a_compression_that_is_not_known(tmp_path: Path) -> None:
    path = write_split_folder(tmp_path / "a", [ENTRIES])
    text = (path / "metadata.yaml").read_text()
    (path / "metadata.yaml").write_text(f"{text}  compression_format: brotli\n  compression_mode: FILE\n")
    with pytest.raises(BagError, match="'brotli'"):
        open_bag(path)


# --- cut, damaged, empty ---


@pytest.mark.parametrize("compression", ROS1_COMPRESSION)
def test_every_cut_of_a_ros1_bag(compression: str, tmp_path: Path) -> None:
    whole = write_ros1(tmp_path / "a.bag", compression)
    data = whole.read_bytes()
    cut = tmp_path / "cut.bag"
    seen = set()
    for size in (*range(len(data) // 40, len(data) - 1, len(data) // 25), len(data) - 300):
        cut.write_bytes(data[:size])
        try:
            numbers, reader = read(cut)
        except BagError as error:
            assert str(error).startswith(str(cut)) and "\n" not in str(error)
            continue
        assert numbers == [1.0, 2.0, 3.0][: len(numbers)] and numbers
        assert reader.truncated
        seen.add(len(numbers))
    assert 3 in seen
    if compression == "none":
        assert seen == {1, 2, 3}
    cut.write_bytes(data[:-300])
    assert replay(cut, tmp_path, status=3)["truncated"]


@pytest.mark.parametrize("cut", [0, 300])
def test_a_ros1_bag_is_read_in_the_order_of_the_log(cut: int, tmp_path: Path) -> None:
    """Whole, and without the index that its end holds; equal times in the order in which they were written."""
    times = [5 * SECOND + 7, SECOND, 5 * SECOND + 3, SECOND]
    given = [
        (name, kind, time, message) for time, (name, kind, _, message) in zip(times, cloud_entries(4), strict=True)
    ]
    path = bag_maker.write_ros1(tmp_path / "a.bag", given)
    data = path.read_bytes()
    path.write_bytes(data[: len(data) - cut])
    numbers, reader = read(path)
    assert reader.truncated == bool(cut)
    assert numbers == [2.0, 4.0, 3.0, 1.0]
    with open_bag(path) as opened:
        assert [record.log_time for record in opened.messages(["/camera/points"])] == sorted(times)
        assert opened.storage().times == (SECOND, 5 * SECOND + 7)


@pytest.mark.parametrize("damaged", [0, 1, 2])
@pytest.mark.parametrize("compression", ["bz2", "lz4"])
def test_a_damaged_chunk_of_a_ros1_bag_costs_only_itself(
    compression: str, damaged: int, tmp_path: Path, capsys: Any
) -> None:
    """The first chunk describes the connections, too, which the end of the file repeats."""
    path = write_ros1(tmp_path / "a.bag", compression, chunk_threshold=0)
    data = bytearray(path.read_bytes())
    places = [found.start() for found in re.finditer(b"compression=" + compression.encode(), data)]
    assert len(places) == 3
    for place in range(places[damaged] + 200, places[damaged] + 400):
        data[place] ^= 0x5A
    path.write_bytes(data)
    numbers, reader = read(path)
    assert numbers == [number for number in (1.0, 2.0, 3.0) if number != damaged + 1]
    assert not reader.truncated
    (problem,) = [text for text in reader.problems if "chunk at byte" in text]
    place = int(problem.partition("chunk at byte ")[2].partition(":")[0])
    assert 0 < places[damaged] - place < 100
    assert len(replay(path, tmp_path, status=1)["frames"]) == 2
    assert f"chunk at byte {place}" in capsys.readouterr().err


def test_equal_log_times_around_a_damaged_chunk_are_read_once(tmp_path: Path) -> None:
    entries = [(topic, kind, SECOND, message) for topic, kind, _, message in cloud_entries(3)]
    path = write_ros1(tmp_path / "a.bag", "lz4", chunk_threshold=0, entries=entries)
    data = bytearray(path.read_bytes())
    places = [found.start() for found in re.finditer(b"compression=lz4", data)]
    for place in range(places[1] + 200, places[1] + 400):
        data[place] ^= 0x5A
    path.write_bytes(data)
    assert read(path)[0] == [1.0, 3.0]


def test_a_ros1_bag_whose_records_do_not_fit_says_where(tmp_path: Path) -> None:
    path = write_ros1(tmp_path / "a.bag", "none")
    data = bytearray(path.read_bytes())
    third = [found.start() for found in re.finditer(b"conn=", data)]
    second_message = next(place for place in third if data[place - 20 : place + 60].count(b"time=") and place > 30_000)
    data[second_message - 4] ^= 0xFF  # the length of a field of its header
    path.write_bytes(data)
    numbers, reader = read(path)
    assert numbers == [1.0, 2.0, 3.0][: len(numbers)] and 0 < len(numbers) < 3
    assert any("its records are damaged from byte" in problem for problem in reader.problems)


def test_a_ros1_bag_with_a_damaged_index_is_whole(tmp_path: Path) -> None:
    path = write_ros1(tmp_path / "a.bag", "lz4")
    data = bytearray(path.read_bytes())
    place = data.rindex(b"chunk_pos=")
    data[place - 4 : place] = b"\xff\xff\xff\xff"
    path.write_bytes(data)
    numbers, reader = read(path)
    assert numbers == [1.0, 2.0, 3.0]
    assert len(reader.problems) == 1 or reader.truncated


def test_noise_behind_the_magic_of_a_ros1_bag(tmp_path: Path) -> None:
    random = np.random.default_rng(0)
    whole = write_ros1(tmp_path / "a.bag", "none").read_bytes()
    path = tmp_path / "b.bag"
    for size in (0, 3, 100, 5000):
        path.write_bytes(whole[:13] + random.integers(0, 256, size, np.uint8).tobytes())
        with pytest.raises(BagError):
            open_bag(path)
    for _ in range(40):
        spoiled = bytearray(whole[:-3000])
        for place in random.integers(13, len(spoiled), 5):
            spoiled[place] ^= 1 << int(random.integers(8))
        path.write_bytes(spoiled)
        try:
            with open_bag(path) as reader:
                list(reader.messages([topic.name for topic in reader.topics]))
        except BagError:
            continue


@pytest.mark.parametrize("compression", list(CompressionType))
def test_a_checksum_error_costs_its_chunk(compression: CompressionType, tmp_path: Path, capsys: Any) -> None:
    path = write_mcap(tmp_path / "a.mcap", ENTRIES, compression=compression)
    start, end = chunks_of(path)[1]
    data = bytearray(path.read_bytes())
    struct.pack_into("<I", data, start + 9 + 24, 0xDEADBEEF)  # the checksum itself
    path.write_bytes(data)
    found = replay(path, tmp_path, status=1)
    assert len(found["frames"]) == 2 and not found["truncated"]
    err = capsys.readouterr().err
    assert f"chunk at byte {start}: checksum (CRC) does not match; 1 message lost" in err
    assert end > start


@pytest.mark.parametrize("index", [IndexType.ALL, IndexType.NONE])
@pytest.mark.parametrize("compression", ["", "zstd", "lz4"])
def test_empty_chunks(index: IndexType, compression: str, tmp_path: Path) -> None:
    path = write_mcap(tmp_path / "a.mcap", ENTRIES, index_types=index)
    data = path.read_bytes()
    name = compression.encode()
    content = struct.pack("<QQQII", 0, 0, 0, zlib.crc32(b""), len(name)) + name + struct.pack("<Q", 0)
    chunk = struct.pack("<BQ", 0x06, len(content)) + content
    start, _ = chunks_of(path)[1]
    # Offsets of the summary no longer fit: it is found through a scan, as after a repair by hand.
    path.write_bytes(data[:start] + chunk + data[start:])
    numbers, reader = read(path)
    assert numbers == [1.0, 2.0, 3.0]
    assert not reader.truncated and reader.problems == []


# --- several topics, order, our own ---


def test_stamps_out_of_order_are_kept_and_processed_in_the_order_of_the_log(tmp_path: Path) -> None:
    entries = cloud_entries(4)
    for entry, second in zip(entries, (5, 3, 3, 9), strict=True):
        entry[3].header.stamp.sec = second
    shuffled = [entries[i] for i in (2, 0, 3, 1)]
    found = replay(write_mcap(tmp_path / "a.mcap", shuffled), tmp_path, "-o", str(tmp_path / "o.mcap"))
    assert [frame["stamp"] for frame in found["frames"]] == [second + 2e-9 for second in (5, 3, 3, 9)]
    with open_bag(tmp_path / "o.mcap") as reader:
        assert [r.log_time for r in reader.messages(["/labeled_points"])] == [n * SECOND for n in (1, 2, 3, 4)]


def test_each_of_several_topics_can_be_replayed(tmp_path: Path) -> None:
    left, right = cloud_entries(2, "/left"), cloud_entries(3, "/right", start=4)
    bag = write_split_folder(tmp_path / "a", [[*left, *right[:1]], right[1:]])
    assert main(["replay", str(bag)]) == 2
    assert len(replay(bag, tmp_path, "--topic", "/left")["frames"]) == 2
    assert len(replay(bag, tmp_path, "--topic", "/right")["frames"]) == 3


@pytest.mark.parametrize("name", ["out.mcap", "out"])
@pytest.mark.parametrize("compression", ["lz4", "zstd", "none"])
def test_our_own_output_can_be_replayed(name: str, compression: str, tmp_path: Path) -> None:
    bag = write_mcap(tmp_path / "a.mcap", ENTRIES)
    first, second = tmp_path / name, tmp_path / f"again_{name}"
    before = replay(bag, tmp_path, "-o", str(first), "--all", "--compression", compression)
    after = replay(first, tmp_path, "-o", str(second), "--topic", "/labeled_points")
    assert [f["stamp"] for f in before["frames"]] == [f["stamp"] for f in after["frames"]]
    for one, two in zip(labels_of(first), labels_of(second), strict=True):
        np.testing.assert_array_equal(one, two)
    with open_bag(first) as reader:
        wanted = () if compression == "none" else (f"{compression} chunks",)
        assert reader.storage().compression == wanted


# --- what we write, as others read it ---


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("written")
    bag = write_mcap(folder / "a.mcap", ENTRIES)
    assert main(["replay", str(bag), "-o", str(folder / "out"), "--all", "--with-input", *SMALL]) == 0
    return folder / "out"


def test_types_carry_all_they_need_and_the_hash_of_ros(written: Path) -> None:
    with (written / "out_0.mcap").open("rb") as file:
        reader = make_reader(file, validate_crcs=True)
        assert reader.get_header().profile == "ros2"
        summary = reader.get_summary()
        assert summary is not None and summary.statistics is not None
        messages = list(reader.iter_messages())
    assert len(messages) == summary.statistics.message_count == 3 * (1 + len(OUTPUTS))
    assert {channel.message_encoding for channel in summary.channels.values()} == {"cdr"}
    store = typestore()
    for channel in summary.channels.values():
        schema = summary.schemas[channel.schema_id]
        assert schema.encoding == "ros2msg"
        # Every type that the text names is described in it, as Foxglove wants it.
        described = get_types_from_msg(schema.data.decode(), schema.name)
        assert schema.name in described
        for name, (_, fields) in described.items():
            for needed in _named_types(fields):
                assert needed in described, f"{name} needs {needed}"
            assert fields == store.fielddefs[name][1]
        assert channel.metadata["topic_type_hash"] == _hash_of_ros(schema.name, channel.metadata["topic_type_hash"])


def _named_types(fields: Any) -> set[str]:
    """Names of the message types among the fields that rosbags parsed, whatever arrays they are in."""
    text = repr(fields)
    return {part for part in text.replace("'", " ").split() if part.count("/msg/") == 1}


def _hash_of_ros(kind: str, ours: str) -> str:
    """The hash in the type description that ROS installs; ours, checked for its form, where ROS is not there."""
    package, _, name = kind.split("/")
    for prefix in os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep):
        description = Path(prefix, "share", package, "msg", f"{name}.json")
        if prefix and description.exists():
            hashes = json.loads(description.read_text())["type_hashes"]
            return str(next(entry["hash_string"] for entry in hashes if entry["type_name"] == kind))
    assert ours.startswith("RIHS01_") and len(ours) == 71
    # Of recordings made by ROS 2 Jazzy.
    known = {CLOUD: "RIHS01_9198cabf7da3796ae6fe19c4cb3bdd3525492988c70522628af5daa124bae2b5"}
    return known.get(kind, ours)


def test_metadata_is_that_of_ros2_bag_record_in_jazzy(written: Path) -> None:
    information = yaml.safe_load((written / "metadata.yaml").read_text())["rosbag2_bagfile_information"]
    assert list(information) == [
        "version",
        "storage_identifier",
        "duration",
        "starting_time",
        "message_count",
        "topics_with_message_count",
        "compression_format",
        "compression_mode",
        "relative_file_paths",
        "files",
        "custom_data",
        "ros_distro",
    ]
    assert (information["version"], information["storage_identifier"]) == (9, "mcap")
    assert information["starting_time"] == {"nanoseconds_since_epoch": SECOND}
    assert information["duration"] == {"nanoseconds": 2 * SECOND}
    assert information["relative_file_paths"] == ["out_0.mcap"] == [entry["path"] for entry in information["files"]]
    topics = {entry["topic_metadata"]["name"]: entry for entry in information["topics_with_message_count"]}
    assert {name: entry["message_count"] for name, entry in topics.items()} == dict.fromkeys(
        ("/camera/points", *(f"/{output.name}" for output in OUTPUTS)), 3
    )
    with (written / "out_0.mcap").open("rb") as file:
        reader = make_reader(file)
        summary = reader.get_summary()
        assert summary is not None
        inside = {record.name: record.metadata for record in reader.iter_metadata()}
    assert yaml.safe_load(inside["rosbag2"]["serialized_metadata"]) == information
    for channel in summary.channels.values():
        described = topics[channel.topic]["topic_metadata"]
        assert described["type_description_hash"] == channel.metadata["topic_type_hash"]
        (profile,) = yaml.safe_load(channel.metadata["offered_qos_profiles"])
        assert [profile] == described["offered_qos_profiles"]
        # The names and values that rosbag2 reads from version 9 on.
        assert profile["history"] in ("keep_last", "keep_all", "system_default", "unknown")
        assert (profile["reliability"], profile["durability"], profile["liveliness"]) == (
            "reliable",
            "volatile",
            "automatic",
        )
        assert set(profile) == {
            "history",
            "depth",
            "reliability",
            "durability",
            "deadline",
            "lifespan",
            "liveliness",
            "liveliness_lease_duration",
            "avoid_ros_namespace_conventions",
        }
        assert all(set(profile[name]) == {"sec", "nsec"} for name in ("deadline", "lifespan"))


def test_rosbags_reads_every_message_of_ours(written: Path) -> None:
    with Reader(written) as reader:
        assert {c.topic: c.msgtype for c in reader.connections}["/region_count"] == COUNT
        assert all(c.digest.startswith("RIHS01_") for c in reader.connections)
        for connection, _, data in reader.messages():
            message = typestore().deserialize_cdr(data, connection.msgtype)
            assert message.__msgtype__ == connection.msgtype
        assert reader.duration == 2 * SECOND + 1


def test_a_recording_without_messages_is_whole(tmp_path: Path) -> None:
    with BagWriter(tmp_path / "out") as writer:
        writer.add_topic("/silent", COUNT)
    with Reader(tmp_path / "out") as reader:
        assert reader.message_count == 0
    with open_bag(tmp_path / "out") as bag:
        assert [topic.name for topic in bag.topics] == ["/silent"] and bag.storage().times is None
    damage(tmp_path / "out" / "out_0.mcap", 20)  # the header, which nobody needs
    with open_bag(tmp_path / "out") as bag:
        assert list(bag.messages(["/silent"])) == []
