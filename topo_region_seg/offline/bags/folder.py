# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""rosbag2 folders: metadata.yaml and the files it names."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator
from dataclasses import replace
from pathlib import Path, PurePath
from tempfile import TemporaryDirectory
from typing import Any

import yaml

from topo_region_seg.offline.bags.mcap_file import McapFile
from topo_region_seg.offline.bags.records import BagError, BagReader, Record, Storage, merge_topics
from topo_region_seg.offline.bags.rosbags_file import open_sqlite
from topo_region_seg.offline.bags.unpacking import is_packed, unpack_file, unpack_message

REINDEX = "run 'ros2 bag reindex {path}' to make it again"
PARTS: dict[Any, Callable[[Path, Path], BagReader]] = {"mcap": McapFile, "sqlite3": open_sqlite}
"""By storage identifier: opens one file; also takes what messages call it."""


def open_folder(path: Path) -> BagReader:
    """Open a rosbag2 folder, of MCAP or sqlite3 storage, of one file or split, compressed or not."""
    information = _information(path)
    storage = information.get("storage_identifier")
    if storage not in PARTS:
        raise BagError(f"{path}: storage '{storage}' is not known; use 'ros2 bag convert' to mcap")
    return Folder(path, information, PARTS[storage])


class Folder(BagReader):
    """The files of a rosbag2 folder, one after the other in the order of the metadata.

    A part that cannot be opened goes to `problems`, unless it is the only one.

    Parameters
    ----------
    path : Path
        The folder.
    information : dict
        Its metadata.
    part : callable
        One of :data:`PARTS`.
    """

    def __init__(self, path: Path, information: dict[str, Any], part: Callable[[Path, Path], BagReader]) -> None:
        self.path = path
        self.problems = []
        self._part = part
        self._mode = _compression_mode(path, information)
        # Old recorders wrote names relative to the working directory; only the last part is to be trusted.
        files = [path / PurePath(str(name)).name for name in information.get("relative_file_paths") or ()]
        for file in files:
            if not file.is_file():
                raise BagError(
                    f"{path}: {file.name} is missing, which metadata.yaml names; {REINDEX.format(path=path)}"
                )
        if not files:
            raise BagError(f"{path}: metadata.yaml names no files; {REINDEX.format(path=path)}")
        self._files: list[BagReader] = []
        self._unpacked: TemporaryDirectory[str] | None = None
        try:
            for file in files:
                try:
                    self._files.append(self._opened(file))
                except BagError as error:
                    if file == files[-1] and not self._files:
                        raise
                    self.problems.append(str(error))
        except BaseException:
            self.close()
            raise
        self.truncated = any(file.truncated for file in self._files)
        self.topics = merge_topics([topic for file in self._files for topic in file.topics])
        for opened in self._files:
            # One list for all, so that what a file finds while it is read is seen here.
            self.problems += opened.problems
            opened.problems = self.problems

    def messages(self, topics: Collection[str]) -> Iterator[Record]:
        """Iterate over the messages of some topics, file by file."""
        for file in self._files:
            for record in file.messages(topics):
                if self._mode != "message":
                    yield record
                    continue
                try:
                    yield replace(record, data=unpack_message(record.data))
                except ValueError as error:
                    self.problems.append(f"{file.path}: message of log time {record.log_time}: {error}; 1 message lost")

    def storage(self) -> Storage:
        """Return how the recording is stored."""
        parts = [file.storage() for file in self._files]
        times = [time for part in parts for time in part.times or ()]
        compression = dict.fromkeys(name for part in parts for name in part.compression)
        packed = (f"zstd {self._mode}s",) if self._mode else ()
        return Storage(parts[0].kind, len(parts), (*packed, *compression), (min(times), max(times)) if times else None)

    def close(self) -> None:
        """Close the files."""
        for file in self._files:
            file.close()
        if self._unpacked is not None:
            self._unpacked.cleanup()

    def _opened(self, file: Path) -> BagReader:
        """Open one file, unpacked first where it is compressed as a whole."""
        if self._mode != "file" or not is_packed(file):
            return self._part(file, file)
        if self._unpacked is None:
            self._unpacked = TemporaryDirectory(prefix="topo_region_seg-")
        target = Path(self._unpacked.name, f"{len(self._files)}{PurePath(file.stem).suffix}")
        try:
            wrong = unpack_file(file, target)
        except OSError as error:
            raise BagError(
                f"{file}: cannot be unpacked to {target.parent} ({error.strerror}); make room there, or set TMPDIR"
            ) from None
        if target.stat().st_size == 0:
            raise BagError(f"{file}: nothing of it can be decompressed; copy or record it again")
        if wrong:
            self.problems.append(f"{file}: {wrong}")
        return self._part(target, file)


def _compression_mode(path: Path, information: dict[str, Any]) -> str:
    """Return "file", "message" or "", what rosbag2 itself has compressed."""
    mode = str(information.get("compression_mode") or "").lower()
    if mode in ("", "none"):
        return ""
    kind = information.get("compression_format")
    if mode not in ("file", "message") or kind != "zstd":
        raise BagError(f"{path}: compression '{kind}' of each {mode} is not known; use 'ros2 bag convert' to zstd")
    return mode


def _information(path: Path) -> dict[str, Any]:
    metadata = path / "metadata.yaml"
    try:
        text = metadata.read_text(encoding="utf-8")
    except FileNotFoundError:
        raise BagError(f"{path}: no recording in this folder (no metadata.yaml); {_advice(path)}") from None
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


def _advice(path: Path) -> str:
    found = sorted([*path.glob("*.mcap"), *path.glob("*.db3"), *path.glob("*.bag"), *path.glob("*/metadata.yaml")])
    if not found:
        return "give a rosbag2 folder, a .mcap, a .db3 or a .bag"
    first = found[0].parent if found[0].name == "metadata.yaml" else found[0]
    return f"give {first}" + (f" or another of the {len(found)} in it" if len(found) > 1 else " itself")
