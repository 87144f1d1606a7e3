# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

import struct

import pytest
from bag_maker import (
    CLOUD,
    SECOND,
    chunks_of,
    cloud_entries,
    count_entry,
    damage,
    first_x,
    write_folder,
    write_mcap,
    write_ros1,
    write_split_folder,
)
from mcap.writer import CompressionType, IndexType
from places import SHARED
from rosbags.rosbag2 import Reader, StoragePlugin

from topo_region_seg.cloud.pointcloud2 import CloudFormatError
from topo_region_seg.offline.bags import BagError, BagWriter, open_bag
from topo_region_seg.offline.bags.clouds import cdr, cloud_topic, decode_message
from topo_region_seg.offline.bags.types import typestore


def read(path, topic=None):
    """The numbers of the clouds that are read, and the reader."""
    with open_bag(path) as reader:
        chosen = cloud_topic(reader, topic)
        return [first_x(decode_message(r, chosen)) for r in reader.messages([chosen.name])], reader


def error_of(path):
    with pytest.raises(BagError) as caught:
        read(path)
    text = str(caught.value)
    assert text.startswith(str(path)) and "\n" not in text
    return text


ENTRIES = [*cloud_entries(3), count_entry()]
MAKERS = {
    "mcap": lambda path: write_mcap(path / "a.mcap", ENTRIES),
    "mcap, one chunk": lambda path: write_mcap(path / "a.mcap", ENTRIES, chunk_size=2**24),
    "mcap, lz4": lambda path: write_mcap(path / "a.mcap", ENTRIES, compression=CompressionType.LZ4),
    "mcap, not compressed": lambda path: write_mcap(path / "a.mcap", ENTRIES, compression=CompressionType.NONE),
    "mcap, no chunks": lambda path: write_mcap(path / "a.mcap", ENTRIES, use_chunking=False),
    "mcap, no index": lambda path: write_mcap(path / "a.mcap", ENTRIES, index_types=IndexType.NONE),
    "mcap, no message index": lambda path: write_mcap(path / "a.mcap", ENTRIES, index_types=IndexType.CHUNK),
    "mcap, no statistics": lambda path: write_mcap(path / "a.mcap", ENTRIES, use_statistics=False),
    "mcap, no repeated channels": lambda path: write_mcap(
        path / "a.mcap", ENTRIES, repeat_channels=False, repeat_schemas=False
    ),
    "folder, mcap": lambda path: write_folder(path / "a", ENTRIES, StoragePlugin.MCAP),
    "folder, sqlite3": lambda path: write_folder(path / "a", ENTRIES, StoragePlugin.SQLITE3),
    "ROS 1": lambda path: write_ros1(path / "a.bag", ENTRIES),
}


@pytest.mark.parametrize("kind", MAKERS)
def test_reads_every_kind(kind, tmp_path):
    path = MAKERS[kind](tmp_path)
    numbers, reader = read(path)
    assert numbers == [1.0, 2.0, 3.0]
    assert not reader.truncated and reader.problems == []
    assert [(t.name, t.type, t.count) for t in reader.topics] == [
        ("/camera/points", CLOUD, 3),
        ("/count", "std_msgs/msg/UInt32", 1),
    ]


def test_plain_sqlite3_file(tmp_path):
    folder = write_folder(tmp_path / "a", ENTRIES, StoragePlugin.SQLITE3)
    assert read(folder / "a.db3")[0] == [1.0, 2.0, 3.0]


def test_ros1_clouds_equal_those_of_ros2(tmp_path):
    path = write_ros1(tmp_path / "a.bag", ENTRIES)
    with open_bag(path) as reader:
        topic = cloud_topic(reader)
        records = list(reader.messages([topic.name]))
    for record, (_, kind, log_time, message) in zip(records, ENTRIES, strict=False):
        assert record.log_time == log_time
        assert cdr(record) == bytes(typestore().serialize_cdr(message, kind))


@pytest.mark.parametrize("chunk_size", [1, 2**24])
@pytest.mark.parametrize("index", [IndexType.ALL, IndexType.NONE])
def test_order_is_that_of_log_times(chunk_size, index, tmp_path):
    entries = cloud_entries(5)
    shuffled = [entries[i] for i in (3, 0, 4, 2, 1)]
    path = write_mcap(tmp_path / "a.mcap", shuffled, chunk_size=chunk_size, index_types=index)
    assert read(path)[0] == [1.0, 2.0, 3.0, 4.0, 5.0]


def test_equal_log_times_keep_the_order_of_the_file(tmp_path):
    entries = [(topic, kind, SECOND, message) for topic, kind, _, message in cloud_entries(4)]
    assert read(write_mcap(tmp_path / "a.mcap", entries[::-1]))[0] == [4.0, 3.0, 2.0, 1.0]


def test_split_files_follow_in_the_order_of_the_metadata(tmp_path):
    parts = [cloud_entries(2, start=5), cloud_entries(2, start=1)]
    numbers, reader = read(write_split_folder(tmp_path / "a", parts))
    assert numbers == [5.0, 6.0, 1.0, 2.0]
    assert reader.count("/camera/points") == 4


def test_missing_split_file(tmp_path):
    path = write_split_folder(tmp_path / "a", [cloud_entries(1), cloud_entries(1)])
    (path / "split_1.mcap").unlink()
    assert "split_1.mcap is missing" in error_of(path)


@pytest.mark.parametrize("compression", list(CompressionType))
def test_every_cut_of_a_recording(compression, tmp_path):
    whole = write_mcap(tmp_path / "a.mcap", ENTRIES, compression=compression)
    data = whole.read_bytes()
    ends = [end for _, end in chunks_of(whole)]
    cut = tmp_path / "cut.mcap"
    for size in sorted({*range(9, len(data), len(data) // 60), *ends, ends[0] - 1, len(data) - 1}):
        cut.write_bytes(data[:size])
        with open_bag(cut) as reader:
            assert reader.truncated
            numbers = [
                first_x(typestore().deserialize_cdr(r.data, r.type)) for r in reader.messages(["/camera/points"])
            ]
            # At least what lies in whole chunks, and nothing that is not whole.
            assert numbers == [1.0, 2.0, 3.0][: len(numbers)]
            assert len(numbers) >= sum(end <= size for end in ends[:3])


def test_whole_messages_of_a_cut_chunk(tmp_path):
    whole = write_mcap(tmp_path / "a.mcap", ENTRIES, chunk_size=2**24, compression=CompressionType.NONE)
    (start, end), *_ = chunks_of(whole)
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(whole.read_bytes()[: start + (end - start) // 2])
    numbers, reader = read(cut)
    assert numbers == [1.0] and reader.truncated


def test_cut_split_of_a_folder(tmp_path):
    path = write_split_folder(tmp_path / "a", [cloud_entries(2), cloud_entries(2, start=3)])
    last = path / "split_1.mcap"
    last.write_bytes(last.read_bytes()[: chunks_of(last)[0][1] + 20])
    numbers, reader = read(path)
    assert numbers == [1.0, 2.0, 3.0] and reader.truncated


@pytest.mark.parametrize("index", [IndexType.ALL, IndexType.NONE])
def test_bit_flip_in_a_chunk(index, tmp_path):
    path = write_mcap(tmp_path / "a.mcap", ENTRIES, index_types=index)
    start, end = chunks_of(path)[1]
    damage(path, (start + end) // 2)
    numbers, reader = read(path)
    assert numbers == [1.0, 3.0]
    assert len(reader.problems) == 1 and f"chunk at byte {start}" in reader.problems[0]
    assert not reader.truncated


def test_bit_flip_in_the_summary(tmp_path):
    path = write_mcap(tmp_path / "a.mcap", ENTRIES)
    whole = path.read_bytes()
    footer = len(whole) - 8 - 20
    (start,) = struct.unpack_from("<Q", whole, footer)
    for position in range(start, footer - 9, 11):
        path.write_bytes(whole)
        damage(path, position)
        numbers, reader = read(path)
        assert (numbers, reader.problems, reader.truncated) == ([1.0, 2.0, 3.0], [], False)


@pytest.mark.parametrize("size", [2**31 + 1, 2**50])
def test_chunk_that_claims_a_huge_size(size, tmp_path):
    path = write_mcap(tmp_path / "a.mcap", ENTRIES)
    start, _ = chunks_of(path)[0]
    data = bytearray(path.read_bytes())
    struct.pack_into("<Q", data, start + 9 + 16, size)
    path.write_bytes(data)
    numbers, reader = read(path)
    assert numbers == [2.0, 3.0]
    assert "more than the limit" in reader.problems[0]


def test_chunk_that_holds_more_than_it_claims(tmp_path):
    path = write_mcap(tmp_path / "a.mcap", ENTRIES)
    start, _ = chunks_of(path)[0]
    data = bytearray(path.read_bytes())
    struct.pack_into("<Q", data, start + 9 + 16, 1000)
    path.write_bytes(data)
    numbers, reader = read(path)
    assert numbers == [2.0, 3.0]
    assert "is not what it holds" in reader.problems[0]


def test_message_with_garbage_is_refused_and_the_rest_read(tmp_path):
    entries = cloud_entries(3)
    for garbage in (b"", b"\0\1\0\0", b"\0\1\0\0" + b"\xff" * 64):
        entries[1] = (*entries[1][:3], garbage)
        path = write_mcap(tmp_path / "a.mcap", entries)
        with open_bag(path) as reader:
            topic = cloud_topic(reader)
            first, second, third = reader.messages([topic.name])
            decode_message(first, topic)
            decode_message(third, topic)
            with pytest.raises(CloudFormatError) as caught:
                decode_message(second, topic)
            assert caught.value.reason == "undecodable"


def test_type_of_the_right_name_with_another_layout(tmp_path):
    path = write_mcap(tmp_path / "a.mcap", cloud_entries(1), definitions={CLOUD: "uint32 height\nuint8[] data\n"})
    with open_bag(path) as reader:
        topic = cloud_topic(reader)
        (record,) = reader.messages([topic.name])
        with pytest.raises(CloudFormatError) as caught:
            decode_message(record, topic)
    assert caught.value.reason == "schema_mismatch"


def test_encoding_that_is_not_known(tmp_path):
    path = write_mcap(tmp_path / "a.mcap", cloud_entries(1), encoding="json")
    with open_bag(path) as reader:
        (record,) = reader.messages(["/camera/points"])
        with pytest.raises(CloudFormatError, match="json"):
            cdr(record)


def test_what_is_no_recording(tmp_path):
    missing, empty, magic, text = (tmp_path / name for name in ("missing", "empty.mcap", "magic.mcap", "text.mcap"))
    empty.touch()
    magic.write_bytes(b"\x89MCAP0\r\n")
    text.write_text("not a recording")
    assert "no such file or folder" in error_of(missing)
    assert "is empty" in error_of(empty)
    assert "cut short before its first whole message" in error_of(magic)
    assert "is no recording" in error_of(text)
    assert "no metadata.yaml" in error_of(tmp_path)


def test_folder_without_metadata_names_the_file_in_it(tmp_path):
    inner = write_mcap(tmp_path / "a.mcap", ENTRIES)
    assert f"give {inner} itself" in error_of(tmp_path)
    write_mcap(tmp_path / "b.mcap", ENTRIES)
    assert f"give {inner} or another of the 2 in it" in error_of(tmp_path)
    write_folder(tmp_path / "c" / "d", ENTRIES, StoragePlugin.MCAP)
    assert f"give {tmp_path / 'c' / 'd'} itself" in error_of(tmp_path / "c")


def test_the_metadata_alone_names_the_folder(tmp_path):
    folder = write_folder(tmp_path / "a", ENTRIES, StoragePlugin.MCAP)
    assert f"is only the metadata of a recording; give the folder {folder}" in error_of(folder / "metadata.yaml")


@pytest.mark.parametrize("text", ["", "a: [", "a: 1", "rosbag2_bagfile_information: 3", "\x00"])
def test_damaged_metadata(text, tmp_path):
    path = tmp_path / "a"
    path.mkdir()
    (path / "metadata.yaml").write_text(text)
    with pytest.raises(BagError, match="metadata"):
        open_bag(path)


def test_damaged_ros1_and_sqlite3_files(tmp_path):
    bag = write_ros1(tmp_path / "a.bag", ENTRIES)
    bag.write_bytes(bag.read_bytes()[:5000])
    assert "cut short before its first whole message" in error_of(bag)
    database = write_folder(tmp_path / "a", ENTRIES, StoragePlugin.SQLITE3) / "a.db3"
    database.write_bytes(database.read_bytes()[:50])
    assert "before its first whole message" in error_of(database)


# --- the topic of the clouds ---


def test_recording_without_clouds(tmp_path):
    assert "/count (std_msgs/msg/UInt32)" in error_of(write_mcap(tmp_path / "a.mcap", [count_entry()]))


def test_a_cut_recording_does_not_name_its_clouds_as_other_things(tmp_path):
    clouds = cloud_entries(2)
    path = write_mcap(tmp_path / "a.mcap", [count_entry(1), *clouds], compression=CompressionType.NONE)
    (_, first_end), (start, _), *_ = chunks_of(path)
    assert first_end <= start
    path.write_bytes(path.read_bytes()[: start + 4_000])  # in the first cloud, after its channel
    error = error_of(path)
    assert "cut short before the first whole cloud of /camera/points" in error and "holds" not in error
    # A flipped bit of compressed data may change nothing that is read.
    plain = CompressionType.NONE
    damaged = write_mcap(tmp_path / "b.mcap", cloud_entries(1), index_types=IndexType.NONE, compression=plain)
    start, end = chunks_of(damaged)[0]
    damage(damaged, (start + end) // 2)
    assert f"has no whole message (chunk at byte {start}" in error_of(damaged)


def test_a_topic_on_which_nothing_was_recorded(tmp_path):
    with BagWriter(tmp_path / "out.mcap") as writer:
        writer.add_topic("/camera/points", CLOUD)
    assert "nothing was recorded on /camera/points" in error_of(tmp_path / "out.mcap")


def test_several_topics_are_listed_ready_to_paste(tmp_path):
    path = write_mcap(tmp_path / "a.mcap", [*cloud_entries(1, "/left"), *cloud_entries(1, "/right")])
    assert "--topic /left, --topic /right" in error_of(path)
    assert read(path, "/right")[0] == [1.0]
    assert read(path, "left")[0] == [1.0]
    for wanted, why in (("/nowhere", "has no topic /nowhere"), ("/count", "has no topic /count")):
        with open_bag(path) as reader, pytest.raises(BagError, match=why) as caught:
            cloud_topic(reader, wanted)
        assert "--topic /left" in str(caught.value)


def test_topic_of_another_type(tmp_path):
    path = write_mcap(tmp_path / "a.mcap", ENTRIES)
    with open_bag(path) as reader, pytest.raises(BagError, match="is of type std_msgs/msg/UInt32"):
        cloud_topic(reader, "/count")


@pytest.mark.parametrize("name", ["label", "intensity"])
def test_clouds_that_need_no_segmentation_are_passed_over(name, tmp_path):
    """Ground truth has no coordinates, results have labels, lidars have no color."""
    from clouds import TYPES

    others = cloud_entries(1, "/other")
    fields = others[0][3].fields
    fields[3] = TYPES.PointField(name=name, offset=16, datatype=6, count=1)
    if name == "label":
        fields.append(TYPES.PointField(name="rgb", offset=20, datatype=7, count=1))
    path = write_mcap(tmp_path / "a.mcap", [*others, *cloud_entries(2, "/wanted")])
    with open_bag(path) as reader:
        assert cloud_topic(reader).name == "/wanted"


# --- writing ---


def copy(path, entries):
    with BagWriter(path) as writer:
        writer.add_topic("/silent", "std_msgs/msg/UInt32")
        for topic, kind, log_time, message in entries:
            writer.add_topic(topic, kind)
            writer.write(topic, log_time, message)


@pytest.mark.parametrize("name", ["out.mcap", "out"])
def test_written_recordings_are_read_by_others(name, tmp_path):
    path = tmp_path / "new" / name
    copy(path, ENTRIES)
    assert path.is_dir() == (name == "out")
    assert read(path)[0] == [1.0, 2.0, 3.0]
    with Reader(path) as reader:
        assert reader.message_count == 4
        connection = next(c for c in reader.connections if c.topic == "/camera/points")
        assert [time for _, time, _ in reader.messages([connection])] == [SECOND, 2 * SECOND, 3 * SECOND]
        assert "MSG: sensor_msgs/PointField" in connection.msgdef.data
        assert connection.ext.offered_qos_profiles[0].reliability.name == "RELIABLE"
        assert any(c.topic == "/silent" and c.msgcount == 0 for c in reader.connections)
    assert [p.name for p in path.parent.iterdir()] == [name]


def test_nothing_appears_when_the_work_fails(tmp_path):
    with pytest.raises(ZeroDivisionError), BagWriter(tmp_path / "out.mcap") as writer:
        writer.add_topic("/count", "std_msgs/msg/UInt32")
        writer.write("/count", 1, count_entry()[3])
        raise ZeroDivisionError
    assert list(tmp_path.iterdir()) == []


def test_nothing_appears_before_the_end(tmp_path):
    writer = BagWriter(tmp_path / "out.mcap")
    assert not (tmp_path / "out.mcap").exists()
    writer.close()
    assert (tmp_path / "out.mcap").exists()


def test_a_file_is_replaced_and_a_folder_is_not(tmp_path):
    old = tmp_path / "out.mcap"
    old.write_text("old")
    copy(old, ENTRIES)
    assert read(old)[0] == [1.0, 2.0, 3.0]
    (tmp_path / "out").mkdir()
    with pytest.raises(BagError, match="exists already"):
        BagWriter(tmp_path / "out")


def test_places_that_cannot_be_written(tmp_path):
    (tmp_path / "file").touch()
    with pytest.raises(BagError, match="cannot be written"):
        BagWriter(tmp_path / "file" / "out.mcap")


def test_full_disk(tmp_path, monkeypatch):
    writer = BagWriter(tmp_path / "out.mcap")
    writer.add_topic("/count", "std_msgs/msg/UInt32")

    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("os.fsync", full)
    with pytest.raises(BagError, match="No space left on device"):
        writer.close()
    assert list(tmp_path.iterdir()) == []


# --- real recordings ---


@pytest.mark.skipif(not SHARED.is_dir(), reason="the recordings of ../shared/data are not here")
@pytest.mark.parametrize(
    ("name", "count", "points"),
    [
        ("bags/tabletop_labelled", 12, 307_200),
        ("bags/tabletop_labelled/tabletop_labelled.mcap", 12, 307_200),
        ("bags/laptop_stream", 3, 307_200),
        ("clouds/watercan.bag", 1, 13_966),
    ],
)
def test_real_recordings(name, count, points):
    from topo_region_seg.cloud.pointcloud2 import decode

    with open_bag(SHARED / name) as reader:
        topic = cloud_topic(reader)
        decoded = [decode(decode_message(r, topic), max_points=10**6) for r in reader.messages([topic.name])]
    assert [len(cloud) for cloud in decoded] == [points] * count
    assert all(cloud.rgb is not None for cloud in decoded)
