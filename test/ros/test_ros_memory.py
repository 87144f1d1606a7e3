# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The memory of one cloud serves the next: counted by the pages that the system had to clear."""

from __future__ import annotations

import platform
import subprocess
import sys
from pathlib import Path

import pytest
from places import ROOT

CLOUDS, BYTES = 30, 10_000_000
PROGRAM = f"""
import ctypes, resource, sys, threading
from topo_region_seg.ros.memory import keep_freed_memory
if sys.argv[1] == "keep":
    assert keep_freed_memory()
c = ctypes.CDLL(None)
c.malloc.restype, c.malloc.argtypes, c.free.argtypes = ctypes.c_void_p, [ctypes.c_size_t], [ctypes.c_void_p]

def clouds():
    for _ in range({CLOUDS}):
        blocks = [c.malloc({BYTES}) for _ in range(3)]
        for block in blocks:
            ctypes.memset(block, 1, {BYTES})
        for block in blocks:
            c.free(block)

before = resource.getrusage(resource.RUSAGE_SELF).ru_minflt
thread = threading.Thread(target=clouds)  # as the middleware's and the node's
thread.start()
thread.join()
print(resource.getrusage(resource.RUSAGE_SELF).ru_minflt - before)
"""


@pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="mallopt is glibc's")
def test_the_memory_of_a_cloud_is_reused() -> None:
    def cleared_pages(how: str) -> int:
        done = subprocess.run([sys.executable, "-c", PROGRAM, how], capture_output=True, text=True, check=True)
        return int(done.stdout)

    assert cleared_pages("keep") < cleared_pages("as it is") / 5


RELEASE = """
from pathlib import Path
import numba
from topo_region_seg.ros import memory

def pages():
    status = Path("/proc/self/status").read_text()
    return int(status.split("RssFile:")[1].split()[0])

add = numba.njit(lambda a, b: a + b)
assert add(1, 2) == 3
before = pages()
memory.release_compiler()
after = pages()
assert numba.njit(lambda a, b: a * b)(3, 4) == 12 and add(3, 4) == 7
print(before - after)
"""


@pytest.mark.skipif(not Path("/proc/self/maps").exists(), reason="needs Linux's /proc")
def test_the_pages_of_the_compiler_are_released_and_it_still_compiles() -> None:
    done = subprocess.run([sys.executable, "-c", RELEASE], capture_output=True, text=True, check=True, cwd=ROOT)
    assert int(done.stdout) > 10_000, "kB"
