# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""What every reader of recordings gives: topics and raw messages."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType


class BagError(Exception):
    """A recording cannot be read or written; the message names the file, the reason and what to do, in one line."""


@dataclass(frozen=True)
class Topic:
    """A topic of a recording; `definition` is the recorded message definition, empty where there is none."""

    name: str
    type: str
    count: int
    definition: str = ""


@dataclass(frozen=True)
class Record:
    """One recorded message: `log_time` in nanoseconds, `data` serialized as `encoding` says, "cdr" or "ros1"."""

    topic: str
    type: str
    log_time: int
    data: bytes
    encoding: str = "cdr"


@dataclass(frozen=True)
class Storage:
    """How a recording is stored.

    Parameters
    ----------
    kind : str
        "mcap", "sqlite3" or "ROS 1 bag".
    files : int
        Number of files.
    compression : tuple of str
        Kinds of compression in it, such as "zstd chunks"; empty for none.
    times : (int, int) or None
        First and last log time, nanoseconds; None without messages.
    """

    kind: str
    files: int
    compression: tuple[str, ...]
    times: tuple[int, int] | None


class BagReader:
    """A recording, open for reading.

    Messages come in the order of their log times; equal times keep the order of the file. The files of a split
    recording follow each other in the order of its metadata.

    Attributes
    ----------
    path : Path
        File or folder, as it was given.
    topics : tuple of Topic
        Sorted by name.
    truncated : bool
        Whether the recording ends in the middle, as that of a killed recorder does.
    problems : list of str
        One line for each damaged part that was left out; grows while messages are read.
    """

    path: Path
    topics: tuple[Topic, ...] = ()
    truncated: bool = False
    problems: list[str]

    def messages(self, topics: Collection[str]) -> Iterator[Record]:
        """Iterate over the messages of some topics."""
        raise NotImplementedError

    def storage(self) -> Storage:
        """Return how the recording is stored."""
        raise NotImplementedError

    def close(self) -> None:
        """Close the files."""
        raise NotImplementedError

    def count(self, topic: str) -> int:
        """Return the number of messages of a topic, 0 for one that is not there."""
        return sum(t.count for t in self.topics if t.name == topic)

    def __enter__(self) -> BagReader:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


def ros2_name(name: str) -> str:
    """Return the ROS 2 form of a type's name: ``std_msgs/Header`` becomes ``std_msgs/msg/Header``."""
    package, _, last = name.partition("/")
    return f"{package}/msg/{last}" if last and "/" not in last else name


def merge_topics(topics: Collection[Topic]) -> tuple[Topic, ...]:
    """Return one entry per name and type, counts added, sorted by name."""
    merged: dict[tuple[str, str], Topic] = {}
    for topic in topics:
        known = merged.get((topic.name, topic.type), Topic(topic.name, topic.type, 0))
        merged[topic.name, topic.type] = Topic(
            topic.name, topic.type, known.count + topic.count, known.definition or topic.definition
        )
    return tuple(merged[key] for key in sorted(merged))
