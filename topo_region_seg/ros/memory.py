# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""How the process gets its memory: clouds of megabytes come and go, and fresh pages cost more than copying them."""

from __future__ import annotations

import ctypes

M_TRIM_THRESHOLD, M_MMAP_THRESHOLD = -1, -3  # of glibc's malloc.h
LARGEST_MMAP_THRESHOLD = 32 << 20
KEPT = 512 << 20


def keep_freed_memory() -> bool:
    """Let the C library reuse the memory of a cloud for the next one; return whether it can (glibc).

    By default it hands blocks of a cloud's size back to the system each time, and the system clears every page again:
    about 20 ms a frame of 640x480 points on the way through DDS alone. The process keeps the most that it ever needed.
    """
    mallopt = getattr(ctypes.CDLL(None), "mallopt", None)
    if mallopt is None:
        return False
    return bool(mallopt(M_MMAP_THRESHOLD, LARGEST_MMAP_THRESHOLD) and mallopt(M_TRIM_THRESHOLD, KEPT))
