# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Recordings that rosbags reads: ROS 1 bags and sqlite3 storage."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Collection, Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

from rosbags.interfaces import MessageDefinitionFormat
from rosbags.rosbag1 import Reader as Ros1Reader
from rosbags.rosbag2 import Reader as Ros2Reader

from topo_region_seg.offline.bags.records import BagError, BagReader, Record, Storage, Topic, merge_topics
from topo_region_seg.offline.bags.recovery.ros1_scan import Ros1Scan, count_records
from topo_region_seg.offline.bags.recovery.sqlite_pages import is_cut
from topo_region_seg.offline.bags.recovery.sqlite_scan import SqliteScan, index_agrees


class RosbagsFile(BagReader):
    """A recording behind one of rosbags' readers; where it fails midway, `recover` opens what is left.

    Parameters
    ----------
    path : Path
        The file.
    reader : callable
        Makes rosbags' reader of a path.
    advice : str
        What to try if the file cannot be opened.
    recover : callable
        Opens the file record by record.
    name : Path, optional
        What messages call it, if that is another.
    """

    def __init__(
        self,
        path: Path,
        reader: Callable[[Path], Any],
        advice: str,
        recover: Callable[[], BagReader],
        name: Path | None = None,
    ) -> None:
        self.path = name or path
        self.problems = []
        self._recover = recover
        try:
            self._reader = reader(path)
            self._reader.open()
        except Exception as error:  # rosbags lets those of its storage libraries through
            raise BagError(f"{self.path}: {_one_line(error)}; {advice}") from error
        self._ros1 = isinstance(self._reader, Ros1Reader)
        connections = self._reader.connections
        if not all(isinstance(text, str) for c in connections for text in (c.topic, c.msgtype)) or (
            self._ros1 and not _whole_index(self._reader, path)
        ):
            self.close()
            raise BagError(f"{self.path}: its index is damaged; {advice}")
        self.topics = merge_topics(
            [Topic(c.topic, c.msgtype, c.msgcount, "" if self._ros1 else _definition(c)) for c in connections]
        )
        if lost := self._reader.message_count - sum(c.msgcount for c in connections):
            self.problems.append(f"{self.path}: {lost} messages of topics that no whole part of the file describes")

    def messages(self, topics: Collection[str]) -> Iterator[Record]:
        """Iterate over the messages of some topics in the order of log times."""
        connections = [c for c in self._reader.connections if c.topic in topics]
        if not connections:
            return
        messages = self._reader.messages(connections)
        last, latest = -1, Counter[str]()
        left = sum(c.msgcount for c in connections)
        while True:
            try:
                connection, log_time, data = next(messages)
                if not isinstance(log_time, int) or not isinstance(data, bytes):
                    raise TypeError("a message is of no possible type")
            except StopIteration:
                if left > 0:
                    self.problems.append(f"{self.path}: its index is damaged; {left} messages lost")
                return
            except Exception as error:  # any byte may be wrong, so anything may be raised
                yield from self._rest(topics, last, latest, error)
                return
            if log_time != last:
                last, latest = log_time, Counter()
            latest[connection.topic] += 1
            left -= 1
            yield Record(connection.topic, connection.msgtype, log_time, data, "ros1" if self._ros1 else "cdr")

    def _rest(self, topics: Collection[str], last: int, latest: Counter[str], error: Exception) -> Iterator[Record]:
        """Yield what recovery finds beyond the messages of log time `last`, of which `latest` were read by topic."""
        self.problems.append(f"{self.path}: is damaged ({_one_line(error)}); only whole messages of the rest are used")
        try:
            recovered = self._recover()
        except BagError:
            return
        with recovered:
            for record in recovered.messages(topics):
                if record.log_time < last:
                    continue
                if record.log_time == last and latest[record.topic] > 0:
                    latest[record.topic] -= 1
                    continue
                yield record
            self.problems += recovered.problems

    def storage(self) -> Storage:
        """Return how the recording is stored."""
        reader = self._reader
        times = (reader.start_time, reader.end_time - 1) if reader.message_count else None
        return Storage("ROS 1 bag" if self._ros1 else "sqlite3", 1, (), times)

    def close(self) -> None:
        """Close the files."""
        self._reader.close()


def open_ros1(path: Path) -> BagReader:
    """Open a ROS 1 bag; one without an index, as a killed recorder leaves it, is read record by record."""
    try:
        return RosbagsFile(
            path, Ros1Reader, "if it is a ROS 1 bag, 'rosbag reindex' may repair it", lambda: Ros1Scan(path)
        )
    except BagError:
        return Ros1Scan(path)


def open_sqlite(path: Path, name: Path | None = None) -> BagReader:
    """Open a .db3 file; one that is cut short or damaged is read page by page."""
    try:
        usable = not is_cut(path) and index_agrees(path)
    except OSError as error:
        raise BagError(
            f"{name or path}: cannot be opened ({error.strerror}); check the name and the permissions"
        ) from None
    reader: BagReader | None = None
    if usable:
        with suppress(BagError):
            advice = "'ros2 bag reindex' on the folder may repair it"
            reader = RosbagsFile(path, Ros2Reader, advice, lambda: SqliteScan(path, name), name)
    reader = reader or SqliteScan(path, name)
    log = path.with_name(f"{path.name}-wal")
    if log.is_file() and log.stat().st_size:
        reader.problems.append(
            f"{reader.path}: what a killed recorder left in {log.name} is not read; to bring it in, run on a copy of "
            f"both: sqlite3 {path.name} 'PRAGMA wal_checkpoint(TRUNCATE)'"
        )
    return reader


def _whole_index(reader: Ros1Reader, path: Path) -> bool:
    """Whether the index of a ROS 1 bag leads to every chunk of the file, and to every message that it counts."""
    counted, found = Counter[int](), Counter({c.id: c.msgcount for c in reader.connections})
    for chunk in reader.chunk_infos:
        counted.update(chunk.connection_counts)
    records = len(reader.chunk_infos), sum(len(chunk.connection_counts) for chunk in reader.chunk_infos)
    return counted == found and count_records(path) in (None, records)


def _definition(connection: Any) -> str:
    text = connection.msgdef.data
    return text if connection.msgdef.format is MessageDefinitionFormat.MSG and isinstance(text, str) else ""


def _one_line(error: Exception) -> str:
    return " ".join(str(error).split()).rstrip(".") or type(error).__name__
