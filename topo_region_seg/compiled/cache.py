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
from contextlib import contextmanager
from functools import cache
from pathlib import Path

import numba

PACKAGE = Path(__file__).resolve().parent.parent
ROOMS = ("compiled", "steps", "beyond", "cloud")
"""Folders of the package that hold kernels."""
OUTDATED = 24 * 3600.0
"""Seconds after which kernels of other sources, beside the code, are deleted: until then they may still be in use."""


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
            if place == beside:
                _delete_outdated(beside, name)
            return place / name
    return None


def _digest() -> str:
    digest = hashlib.sha256(numba.__version__.encode())
    for source in sorted(source for room in ROOMS for source in (PACKAGE / room).rglob("*.py")):
        digest.update(source.read_bytes())
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


def _delete_outdated(place: Path, current: str) -> None:
    for folder in place.glob("kernels-*"):
        if folder.name != current and folder.stat().st_mtime < time.time() - OUTDATED:
            shutil.rmtree(folder, ignore_errors=True)
