# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Kernels side by side: they release the GIL, so plain threads will do."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise
from typing import Any

WORKERS = 2


def side_by_side(function: Callable[..., Any], tasks: Iterable[tuple[Any, ...]]) -> None:
    """Call `function` with each tuple of arguments, in threads, and wait for all."""
    with ThreadPoolExecutor(WORKERS) as pool:
        for done in [pool.submit(function, *task) for task in tasks]:
            done.result()


def in_parts(n: int, parts: int = 4 * WORKERS) -> list[tuple[int, int]]:
    """Cut range(n) into consecutive parts; more than there are workers, as some parts take longer."""
    bounds = [n * part // parts for part in range(parts + 1)]
    return [(first, end) for first, end in pairwise(bounds) if first < end]
