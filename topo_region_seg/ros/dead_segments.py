# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Shared memory that killed processes left behind, as `fastdds shm clean` finds it.

Each process that uses Fast DDS has a segment ``fastrtps_`` and 16 hexadecimal digits in ``/dev/shm``, and beside it a
file ``..._el`` that it holds locked while it lives: the system takes the lock from a process that dies in any way.
"""

from __future__ import annotations

import fcntl
import os
import re
import time
from pathlib import Path

LOCK = re.compile(r"(fast(?:rtps|dds)_[0-9a-f]{16})_el")
YOUNG = 1.0
"""Age in seconds below which a lock file is left alone: a process makes it first and locks it then."""


def remove_dead_segments(folder: Path) -> tuple[int, int]:
    """Remove the segments whose processes are dead, and return how many there were and their size in bytes.

    What belongs to another user, or to a process that lives in any container, stays.
    """
    count, size = 0, 0
    try:
        locks = [path for path in folder.iterdir() if LOCK.fullmatch(path.name)]
    except OSError:
        return 0, 0
    for lock in locks:
        try:
            size += _remove_if_dead(lock)
            count += 1
        except OSError:
            continue  # it is alive, of somebody else, or was removed meanwhile
    return count, size


def _remove_if_dead(lock: Path) -> int:
    """Remove a segment and its lock file and return its size in bytes; raise OSError if that must not be."""
    held = os.open(lock, os.O_RDONLY | os.O_NOFOLLOW)
    try:
        fcntl.flock(held, fcntl.LOCK_EX | fcntl.LOCK_NB)
        if time.time() - os.fstat(held).st_mtime < YOUNG:
            raise BlockingIOError
        segment = lock.with_name(lock.name.removesuffix("_el"))
        size = 0
        if segment.exists():
            size = 512 * segment.stat().st_blocks
            segment.unlink()
        lock.unlink()
        return size
    finally:
        os.close(held)
