# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""How the process gets its memory: clouds of megabytes come and go, and fresh pages cost more than copying them."""

from __future__ import annotations

import ctypes
from contextlib import suppress
from pathlib import Path

M_TRIM_THRESHOLD, M_MMAP_THRESHOLD = -1, -3  # of glibc's malloc.h
LARGEST_MMAP_THRESHOLD = 32 << 20
KEPT = 512 << 20
MADV_DONTNEED = 4  # of linux/mman.h
COMPILER = "libllvmlite"


def keep_freed_memory() -> bool:
    """Let the C library reuse the memory of a cloud for the next one; return whether it can (glibc).

    By default it hands blocks of a cloud's size back to the system each time, and the system clears every page again:
    about 20 ms a frame of 640x480 points on the way through DDS alone. The process keeps the most that it ever needed.
    """
    mallopt = getattr(ctypes.CDLL(None), "mallopt", None)
    if mallopt is None:
        return False
    return bool(mallopt(M_MMAP_THRESHOLD, LARGEST_MMAP_THRESHOLD) and mallopt(M_TRIM_THRESHOLD, KEPT))


def release_compiler() -> None:
    """Give up the pages of LLVM's code that loading the kernels has read, 50 MB; what is used again is mapped again.

    Harmless where there is no such library, or no /proc.
    """
    libc = ctypes.CDLL(None)
    with suppress(OSError, AttributeError):
        for line in Path("/proc/self/maps").read_text(encoding="utf-8").splitlines():
            span, access, *_, file = line.split(maxsplit=5)
            if access == "r-xp" and COMPILER in file:
                start, end = (int(address, 16) for address in span.split("-"))
                libc.madvise(ctypes.c_void_p(start), ctypes.c_size_t(end - start), MADV_DONTNEED)
