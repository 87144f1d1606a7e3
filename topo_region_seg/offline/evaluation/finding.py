# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Finding recordings by name or in folders, and identifying their content."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Iterable, Iterator
from pathlib import Path

from topo_region_seg.offline.bags.records import BagError

_FILES = (".mcap", ".bag", ".db3")
_METADATA = "metadata.yaml"
_PIECE = 2**20  # bytes read at a time


def find_bags(paths: Iterable[Path]) -> list[Path]:
    """Return the recordings that `paths` name; other folders are searched, with all folders below them.

    Each recording is returned once, those of a folder sorted by name. Hidden files and folders are left out:
    recordings have such names while they are being written.

    Raises
    ------
    BagError
        A path does not exist, or a folder contains no recording.
    """
    found: dict[Path, Path] = {}
    for path in paths:
        if not path.exists():
            raise BagError(f"{path}: no such file or folder; check the name")
        bags = [path] if path.is_file() or (path / _METADATA).is_file() else sorted(_below(path))
        if not bags:
            raise BagError(f"{path}: no recording in this folder or below; give a rosbag2 folder, a .mcap or a .bag")
        for bag in bags:
            found.setdefault(bag.resolve(), bag)
    return list(found.values())


def content_id(bag: Path) -> str:
    """Return an identifier of the content of a recording: a hash over all bytes of its files.

    Raises
    ------
    BagError
        A file cannot be read.
    """
    digest = hashlib.blake2b(digest_size=16)
    for file in sorted(bag.iterdir()) if bag.is_dir() else [bag]:
        if not file.is_file():
            continue
        try:
            digest.update(file.stat().st_size.to_bytes(8, "little"))
            with file.open("rb") as stream:
                while piece := stream.read(_PIECE):
                    digest.update(piece)
        except OSError as error:
            raise BagError(f"{file}: cannot be read ({error.strerror}); check the permissions") from None
    return digest.hexdigest()


def _below(folder: Path) -> Iterator[Path]:
    for name, folders, files in os.walk(folder):
        here = Path(name)
        visible = sorted(f for f in folders if not f.startswith("."))
        yield from (here / f for f in visible if (here / f / _METADATA).is_file())
        folders[:] = [f for f in visible if not (here / f / _METADATA).is_file()]
        yield from (here / f for f in sorted(files) if f.endswith(_FILES) and not f.startswith("."))
