# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""sqlite3 recordings that are cut short or damaged: all whole messages that lie in their pages."""

from __future__ import annotations

import mmap
import sqlite3
from collections import Counter
from collections.abc import Collection, Iterator
from pathlib import Path

from topo_region_seg.offline.bags.records import BagError, BagReader, Record, Storage, Topic, merge_topics
from topo_region_seg.offline.bags.recovery.sqlite_pages import Pages, Row, is_cut

TOPICS = "SELECT id, name, type FROM topics"
DEFINITIONS = "SELECT topic_type, encoded_message_definition FROM message_definitions WHERE encoding = 'ros2msg'"
SUMS = "SELECT count(*), sum(id), sum(timestamp & 4294967295), sum(timestamp >> 32) FROM messages {}"
MESSAGE_COLUMNS = 4
"""id, topic_id, timestamp, data"""


class SqliteScan(BagReader):
    """A rosbag2 sqlite3 file that SQLite refuses, or should.

    Parameters
    ----------
    path : Path
        The file.
    name : Path, optional
        What messages call it, if that is another.

    Raises
    ------
    BagError
        No message of it is whole.
    """

    def __init__(self, path: Path, name: Path | None = None) -> None:
        self.path = name or path
        self.problems = []
        self._rows: dict[int, Row] = {}
        try:
            with path.open("rb") as file:
                self._data = mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ)
        except ValueError:
            raise BagError(f"{self.path}: the file is empty; nothing was recorded") from None
        try:
            self._topics, definitions = _topics(path)
            for row in Pages(self._data).rows(MESSAGE_COLUMNS):
                if row.values[0] in self._topics:
                    self._rows.setdefault(row.number, row)
        except (ValueError, sqlite3.Error):
            pass  # said below: nothing of it is whole
        if not self._rows:
            self._data.close()
            raise BagError(f"{self.path}: is cut short or damaged before its first whole message; record it again")
        self.truncated = is_cut(path)
        if not self.truncated:
            self.problems.append(f"{self.path}: is damaged; {len(self._rows)} whole messages were found in it")
        counts = Counter(row.values[0] for row in self._rows.values())
        self.topics = merge_topics(
            [
                Topic(topic, kind, counts[number], definitions.get(kind, ""))
                for number, (topic, kind) in self._topics.items()
            ]
        )

    def messages(self, topics: Collection[str]) -> Iterator[Record]:
        """Iterate over the messages of some topics in the order of log times."""
        for row in sorted(self._rows.values(), key=lambda row: (row.values[1], row.number)):
            topic, kind = self._topics[row.values[0]]
            if topic in topics:
                data = b"".join(self._data[start:end] for start, end in row.spans)
                yield Record(topic, kind, row.values[1], data)

    def storage(self) -> Storage:
        """Return how the recording is stored."""
        times = [row.values[1] for row in self._rows.values()]
        return Storage("sqlite3", 1, (), (min(times), max(times)))

    def close(self) -> None:
        """Close the file."""
        self._data.close()


def index_agrees(path: Path) -> bool:
    """Whether the index by time, where there is one, has the times of all messages; both are read, no message is.

    SQLite answers from the index alone where it can, so that a damaged one loses messages or changes their times.
    """
    database = _opened(path)
    try:
        (table,) = database.execute(SUMS.format("NOT INDEXED"))
        for _, name, _, _, partial in database.execute("PRAGMA index_list(messages)").fetchall():
            columns = [column for *_, column in database.execute(f'PRAGMA index_info("{name}")')]
            if columns == ["timestamp"] and not partial:
                (index,) = database.execute(SUMS.format(f'INDEXED BY "{name}"'))
                if index != table:
                    return False
        return True
    except (sqlite3.Error, ValueError):  # the latter where an error names what is no text
        return False
    finally:
        database.close()


def _opened(path: Path) -> sqlite3.Connection:
    return sqlite3.connect(f"{path.resolve().as_uri()}?mode=ro&immutable=1", uri=True)


def _topics(path: Path) -> tuple[dict[int, tuple[str, str]], dict[str, str]]:
    """Return name and type by number of topic, and message definitions by type; they stand at the file's beginning."""
    database = _opened(path)
    try:
        # Otherwise SQLite refuses a file that is shorter than its header says.
        database.execute("PRAGMA writable_schema = ON")
        database.execute("PRAGMA trusted_schema = OFF")
        topics = {number: (str(topic), str(kind)) for number, topic, kind in database.execute(TOPICS)}
        try:
            definitions = {str(kind): str(text) for kind, text in database.execute(DEFINITIONS)}
        except (sqlite3.Error, ValueError):
            definitions = {}  # recorders before Jazzy's write none
        return topics, definitions
    finally:
        database.close()
