# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""rosbag2 folders: metadata.yaml and the files it names."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from pathlib import Path, PurePath
from typing import Any

import yaml

from topo_region_seg.bags.mcap_file import McapFile
from topo_region_seg.bags.records import BagError, BagReader, Record, Storage, merge_topics
from topo_region_seg.bags.rosbags_file import open_ros2

REINDEX = "run 'ros2 bag reindex {path}' to make it anew"


def open_folder(path: Path) -> BagReader:
    """Open a rosbag2 folder, of MCAP or sqlite3 storage, of one file or split."""
    information = _information(path)
    if information.get("storage_identifier") != "mcap" or information.get("compression_mode"):
        return open_ros2(path)
    return McapFolder(path, information)


class McapFolder(BagReader):
    """The MCAP files of a rosbag2 folder, one after the other in the order of the metadata."""

    def __init__(self, path: Path, information: dict[str, Any]) -> None:
        self.path = path
        self.problems = []
        # Old recorders wrote names relative to the working directory; only the last part is to be trusted.
        files = [path / PurePath(str(name)).name for name in information.get("relative_file_paths") or ()]
        for file in files:
            if not file.is_file():
                raise BagError(
                    f"{path}: {file.name} is missing, which metadata.yaml names; {REINDEX.format(path=path)}"
                )
        if not files:
            raise BagError(f"{path}: metadata.yaml names no files; {REINDEX.format(path=path)}")
        self._files: list[McapFile] = []
        try:
            for file in files:
                self._files.append(McapFile(file))
        except BaseException:
            self.close()
            raise
        self.truncated = any(file.truncated for file in self._files)
        self.topics = merge_topics([topic for file in self._files for topic in file.topics])
        for part in self._files:
            # One list for all, so that what a file finds while it is read is seen here.
            self.problems += part.problems
            part.problems = self.problems

    def messages(self, topics: Collection[str]) -> Iterator[Record]:
        """Iterate over the messages of some topics, file by file."""
        for file in self._files:
            yield from file.messages(topics)

    def storage(self) -> Storage:
        """Return how the recording is stored."""
        parts = [file.storage() for file in self._files]
        times = [time for part in parts for time in part.times or ()]
        compression = dict.fromkeys(name for part in parts for name in part.compression)
        return Storage("mcap", len(parts), tuple(compression), (min(times), max(times)) if times else None)

    def close(self) -> None:
        """Close the files."""
        for file in self._files:
            file.close()


def _information(path: Path) -> dict[str, Any]:
    metadata = path / "metadata.yaml"
    try:
        text = metadata.read_text(encoding="utf-8")
    except FileNotFoundError:
        raise BagError(f"{path}: no recording in this folder (no metadata.yaml); {_mend(path)}") from None
    except (OSError, UnicodeDecodeError) as error:
        raise BagError(f"{metadata}: cannot be read ({error}); {REINDEX.format(path=path)}") from None
    try:
        information = yaml.safe_load(text)["rosbag2_bagfile_information"]
        if not isinstance(information, dict):
            raise TypeError("rosbag2_bagfile_information is no mapping")
    except (yaml.YAMLError, TypeError, KeyError) as error:
        reason = " ".join(str(error).split())
        raise BagError(
            f"{metadata}: is not the metadata of a recording ({reason}); {REINDEX.format(path=path)}"
        ) from None
    return information


def _mend(path: Path) -> str:
    found = sorted([*path.glob("*.mcap"), *path.glob("*.bag"), *path.glob("*/metadata.yaml")])
    if not found:
        return "give a rosbag2 folder, a .mcap or a .bag"
    first = found[0].parent if found[0].name == "metadata.yaml" else found[0]
    return f"give {first}" + (f" or another of the {len(found)} in it" if len(found) > 1 else " itself")
