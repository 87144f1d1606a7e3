# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Opens a recording, whatever its kind."""

from __future__ import annotations

from pathlib import Path

from topo_region_seg.offline.bags.folder import open_folder
from topo_region_seg.offline.bags.mcap_file import McapFile
from topo_region_seg.offline.bags.records import BagError, BagReader
from topo_region_seg.offline.bags.recovery.mcap_chunks import MAGIC
from topo_region_seg.offline.bags.rosbags_file import open_ros1, open_sqlite

ROS1_MAGIC = b"#ROSBAG V"
SQLITE_MAGIC = b"SQLite format 3\0"


def open_bag(path: str | Path) -> BagReader:
    """Open a rosbag2 folder, a plain .mcap or .db3 file, or a ROS 1 .bag; the content of a file shows its kind.

    Raises
    ------
    BagError
        The file is missing, no recording or damaged beyond use.
    """
    path = Path(path)
    if path.is_dir():
        return open_folder(path)
    try:
        with path.open("rb") as file:
            head = file.read(16)
    except FileNotFoundError:
        raise BagError(f"{path}: no such file or folder; check the name") from None
    except (OSError, ValueError) as error:
        raise BagError(f"{path}: cannot be opened ({error}); check the name and the permissions") from None
    if not head:
        raise BagError(f"{path}: the file is empty; nothing was recorded")
    if head.startswith(ROS1_MAGIC):
        return open_ros1(path)
    if head.startswith(SQLITE_MAGIC):
        return open_sqlite(path)
    if head.startswith(MAGIC):
        return McapFile(path)
    if path.name == "metadata.yaml":
        raise BagError(f"{path}: is only the metadata of a recording; give the folder {path.parent}")
    raise BagError(f"{path}: is no recording (unknown first bytes); give a rosbag2 folder, a .mcap or a .bag")
