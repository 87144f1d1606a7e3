# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""All kernels that the node uses: ``python -m topo_region_seg.ros.kernels`` compiles them into the cache."""

from __future__ import annotations

import atexit
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

from topo_region_seg.beyond.boxes.oriented import warm_up_boxes
from topo_region_seg.beyond.boxes.surfaces import warm_up_surfaces
from topo_region_seg.compiled.cache import cache_folder, environment
from topo_region_seg.pipeline import warm_up

COMPILE = (sys.executable, "-m", "topo_region_seg.ros.kernels")
"""What fills the cache."""
COMPLETE = "complete"
"""A file in the cache that is there once all kernels are."""


def load_kernels() -> None:
    """Load all kernels, and compile those that the cache does not hold."""
    warm_up()
    warm_up_boxes()
    warm_up_surfaces()
    if (mark := _mark()) is not None:
        mark.touch()


def fill_cache(wanted: Callable[[], bool]) -> None:
    """Have a process of its own compile the kernels, unless the cache holds them or there is none.

    What a compiler takes, 200 MB, stays with the process that it works in; and it cannot be interrupted, but ended,
    which is done if `wanted` becomes false. If it fails, the kernels are compiled where they are loaded.
    """
    mark = _mark()
    if mark is None or mark.exists():
        return
    quiet = subprocess.DEVNULL
    try:
        child = subprocess.Popen(COMPILE, env=environment(), stdout=quiet, stderr=quiet)
    except OSError:
        return
    atexit.register(child.kill)  # this thread may not live to do it
    while child.poll() is None:
        if not wanted():
            child.kill()
        time.sleep(0.05)
    atexit.unregister(child.kill)


def _mark() -> Path | None:
    folder = cache_folder()
    return None if folder is None else folder / COMPLETE


if __name__ == "__main__":
    load_kernels()
