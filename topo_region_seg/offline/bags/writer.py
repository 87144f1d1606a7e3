# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Writes recordings: MCAP, whole or not at all."""

from __future__ import annotations

import os
import shutil
import tempfile
import time
from contextlib import suppress
from pathlib import Path
from types import TracebackType
from typing import Any

import yaml
from mcap.writer import CompressionType, Writer

from topo_region_seg.offline.bags.records import BagError
from topo_region_seg.offline.bags.types import typestore

_FOREVER = {"sec": 9223372036, "nsec": 854775807}
_QOS = [
    {
        "history": "keep_last",
        "depth": 1,
        "reliability": "reliable",
        "durability": "volatile",
        "deadline": _FOREVER,
        "lifespan": _FOREVER,
        "liveliness": "automatic",
        "liveliness_lease_duration": _FOREVER,
        "avoid_ros_namespace_conventions": False,
    }
]


COMPRESSIONS = {"zstd": CompressionType.ZSTD, "lz4": CompressionType.LZ4, "none": CompressionType.NONE}
"""Of the chunks, as MCAP names them; lz4 takes a quarter of the time of zstd, and half as much space again."""


class _Dumper(yaml.SafeDumper):  # type: ignore[misc,unused-ignore]
    """Repeats equal parts instead of referring to them, which rosbag2 expects."""

    def ignore_aliases(self, data: Any) -> bool:
        return True


def _yaml(value: Any) -> str:
    return str(yaml.dump(value, Dumper=_Dumper, sort_keys=False))


class BagWriter:
    """A recording that appears under its name when it is closed.

    ``NAME.mcap`` gives one plain file, any other name a rosbag2 folder. All is written to a hidden folder beside it,
    which is gone afterwards; a run that is killed leaves no torn file under the final name.

    Parameters
    ----------
    path : Path
        Where to; a file that is there is replaced, a folder is not.
    compression : str
        One of :data:`COMPRESSIONS`.

    Raises
    ------
    BagError
        The folder is there already, or nothing can be written at that place.
    """

    def __init__(self, path: str | Path, *, compression: str = "zstd") -> None:
        self.path = Path(path)
        self._plain = self.path.suffix == ".mcap"
        if self.path.is_dir() or (self.path.exists() and not self._plain):
            raise BagError(f"{self.path}: exists already; remove it or choose another name")
        self._channels: dict[str, int] = {}
        self._topics: dict[str, dict[str, Any]] = {}
        self._schemas: dict[str, int] = {}
        self._times: tuple[int, int] | None = None
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            self._work = Path(tempfile.mkdtemp(prefix=f".{self.path.name}.", suffix=".part", dir=self.path.parent))
            self._bag = self._work / self.path.name
            self._bag.mkdir()
            self._name = self.path.name if self._plain else f"{self.path.name}_0.mcap"
            self._file = (self._bag / self._name).open("wb")
        except OSError as error:
            raise BagError(f"{self.path}: cannot be written ({error.strerror}); choose another place") from None
        self._writer = Writer(self._file, compression=COMPRESSIONS[compression])
        self._writer.start(profile="ros2", library="topo_region_seg")

    def add_topic(self, name: str, kind: str) -> None:
        """Declare a topic of type `kind`, such as ``std_msgs/msg/UInt32``; topics without messages are kept too."""
        if name in self._channels:
            return
        types = typestore()
        if kind not in self._schemas:
            definition, _ = types.generate_msgdef(kind, ros_version=2)
            self._schemas[kind] = self._writer.register_schema(kind, "ros2msg", definition.encode())
        type_hash = types.hash_rihs01(kind)
        qos = _yaml(_QOS)
        self._channels[name] = self._writer.register_channel(
            name, "cdr", self._schemas[kind], {"offered_qos_profiles": qos, "topic_type_hash": type_hash}
        )
        self._topics[name] = {
            "topic_metadata": {
                "name": name,
                "type": kind,
                "serialization_format": "cdr",
                "offered_qos_profiles": _QOS,
                "type_description_hash": type_hash,
            },
            "message_count": 0,
        }

    def write(self, topic: str, log_time: int, message: Any) -> None:
        """Append a message, one of rosbags' or already serialized in CDR; `log_time` in nanoseconds.

        Raises
        ------
        BagError
            Nothing more can be written, as when the disk is full.
        """
        kind = self._topics[topic]["topic_metadata"]["type"]
        data = message if isinstance(message, bytes) else typestore().serialize_cdr(message, kind)
        count = self._topics[topic]["message_count"]
        try:
            self._writer.add_message(self._channels[topic], log_time, data, publish_time=log_time, sequence=count)
        except OSError as error:
            raise BagError(
                f"{self.path}: cannot be written ({error.strerror}); make room or choose another place"
            ) from None
        self._topics[topic]["message_count"] = count + 1
        first, last = self._times or (log_time, log_time)
        self._times = min(first, log_time), max(last, log_time)

    def attach(self, name: str, media_type: str, data: bytes) -> None:
        """Add a whole file beside the messages, such as a description of the recording.

        Raises
        ------
        BagError
            Nothing more can be written, as when the disk is full.
        """
        try:
            now = time.time_ns()
            self._writer.add_attachment(now, now, name, media_type, data)
        except OSError as error:
            raise BagError(
                f"{self.path}: cannot be written ({error.strerror}); make room or choose another place"
            ) from None

    def close(self) -> None:
        """Finish the recording and give it its name."""
        information = self._information()
        try:
            text = _yaml(information)
            self._writer.add_metadata("rosbag2", {"serialized_metadata": text})
            self._writer.finish()
            self._file.flush()
            os.fsync(self._file.fileno())
            self._file.close()
            if self._plain:
                os.replace(self._bag / self._name, self.path)
            else:
                metadata = _yaml({"rosbag2_bagfile_information": information})
                (self._bag / "metadata.yaml").write_text(metadata, encoding="utf-8")
                os.rename(self._bag, self.path)
        except OSError as error:
            raise BagError(
                f"{self.path}: cannot be written ({error.strerror}); make room or choose another place"
            ) from None
        finally:
            self.discard()

    def discard(self) -> None:
        """Give up: nothing appears under the name."""
        with suppress(OSError):
            self._file.close()
        shutil.rmtree(self._work, ignore_errors=True)

    def _information(self) -> dict[str, Any]:
        """Return the content of metadata.yaml (version 9, that of Jazzy)."""
        first, last = self._times or (0, 0)
        count = sum(topic["message_count"] for topic in self._topics.values())
        start, duration = {"nanoseconds_since_epoch": first}, {"nanoseconds": last - first}
        return {
            "version": 9,
            "storage_identifier": "mcap",
            "duration": duration,
            "starting_time": start,
            "message_count": count,
            "topics_with_message_count": list(self._topics.values()),
            "compression_format": "",
            "compression_mode": "",
            "relative_file_paths": [self._name],
            "files": [{"path": self._name, "starting_time": start, "duration": duration, "message_count": count}],
            "custom_data": None,
            "ros_distro": "jazzy",
        }

    def __enter__(self) -> BagWriter:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if kind is None:
            self.close()
        else:
            self.discard()
