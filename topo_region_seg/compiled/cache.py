# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Where compiled kernels are kept on disk: one folder for each state of their sources.

Kernels are compiled into each other, but numba asks only whether the file of the outer one has changed. The name of the
folder therefore holds a digest of all sources, and kernels of another version are never looked at.
"""

from __future__ import annotations

import hashlib
import os
import shutil
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from functools import cache
from pathlib import Path
from typing import Any

import numba

try:
    import fcntl
except ImportError:  # not on Windows
    fcntl = None  # type: ignore[assignment]

PACKAGE = Path(__file__).resolve().parent.parent
ROOMS = ("compiled", "steps", "beyond", "cloud")
"""Folders of the package that hold kernels."""
DAY = 24 * 3600.0
OUTDATED_BESIDE, OUTDATED_ELSEWHERE = DAY, 30.0 * DAY
"""Seconds since kernels of other sources were last used after which they are deleted. Beside the code these are older
versions of it, which a running process may still use; elsewhere they may belong to another installation."""


@contextmanager
def kept_on_disk() -> Iterator[bool]:
    """Let numba use the folder for what is declared inside; yields False where there is none."""
    folder, before = cache_folder(), numba.config.CACHE_DIR
    numba.config.CACHE_DIR = str(folder or before)
    try:
        yield folder is not None
    finally:
        numba.config.CACHE_DIR = before


@cache
def cache_folder() -> Path | None:
    """Return the first of these that can be written to: ``NUMBA_CACHE_DIR``, beside the code, the user's cache.

    None if there is none; kernels are then compiled in every process.
    """
    name = f"kernels-{_digest()}"
    beside = PACKAGE / "__pycache__"
    chosen = os.environ.get("NUMBA_CACHE_DIR")
    places = [Path(chosen) / PACKAGE.name] if chosen else []
    places += [beside, _user_cache() / PACKAGE.name]
    for place in places:
        if _writable(place / name):
            os.utime(place / name)
            _delete_outdated(place, name, OUTDATED_BESIDE if place == beside else OUTDATED_ELSEWHERE)
            return place / name
    return None


def environment() -> dict[str, str]:
    """Return the environment of a process of its own that compiles kernels of this package, wherever it is started."""
    path = os.pathsep.join(filter(None, [str(PACKAGE.parent), os.environ.get("PYTHONPATH")]))
    return {**os.environ, "PYTHONPATH": path}


def save_one_at_a_time(compiled: Any) -> None:
    """Let no two processes save code of one kernel at once: numba numbers the files of a kernel by what is there."""
    file = getattr(getattr(compiled, "_cache", None), "_cache_file", None)
    folder = cache_folder()
    if file is None or folder is None or fcntl is None:
        return
    save = file.save

    def save_alone(key: Any, data: Any) -> None:
        with open(folder / "lock", "ab") as lock:
            fcntl.flock(lock, fcntl.LOCK_EX)
            save(key, data)

    file.save = save_alone


def _digest() -> str:
    digest = hashlib.sha256(numba.__version__.encode())
    for source in sorted(source for room in ROOMS for source in (PACKAGE / room).rglob("*.py")):
        digest.update(str(source.relative_to(PACKAGE)).encode() + source.read_bytes())
    return digest.hexdigest()[:16]


def _user_cache() -> Path:
    chosen = os.environ.get("XDG_CACHE_HOME")
    return Path(chosen) if chosen else Path(os.path.expanduser("~")) / ".cache"


def _writable(folder: Path) -> bool:
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            return True
    except OSError:
        return False


def _delete_outdated(place: Path, current: str, seconds: float) -> None:
    for folder in place.glob("kernels-*"):
        # Another process may delete it at the same time.
        with suppress(OSError):
            if folder.name != current and folder.stat().st_mtime < time.time() - seconds:
                shutil.rmtree(folder, ignore_errors=True)
