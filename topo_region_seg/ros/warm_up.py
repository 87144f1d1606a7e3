# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Compiling the kernels without keeping anybody from stopping the node."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from typing import TYPE_CHECKING

from rclpy.executors import ExternalShutdownException

from topo_region_seg.compiled.cache import cache_folder
from topo_region_seg.ros.kernels import fill_cache, load_kernels
from topo_region_seg.ros.memory import release_compiler

if TYPE_CHECKING:
    from rclpy.impl.rcutils_logger import RcutilsLogger

PATIENCE = 2.0
"""Seconds after which it is clear that kernels are being compiled, not loaded from the cache."""

UNWRITABLE = "no folder can be written to; set NUMBA_CACHE_DIR to one"


def warm_up_kernels(logger: RcutilsLogger, wanted: Callable[[], bool]) -> None:
    """Compile or load the kernels, so that the first frame is as fast as the others.

    Both take long and cannot be interrupted, so they get a thread of their own, which is left behind if `wanted`
    becomes false.

    Raises
    ------
    ExternalShutdownException
        If `wanted` became false.
    """
    failure: list[Exception] = []

    def work() -> None:
        try:
            fill_cache(wanted)
            if wanted():
                load_kernels()
                release_compiler()
        except Exception as error:
            failure.append(error)

    started = time.monotonic()
    thread = threading.Thread(target=work, name="warm_up", daemon=True)
    thread.start()
    told = False
    while thread.is_alive():
        thread.join(0.05)
        if not wanted():
            raise ExternalShutdownException
        if not told and time.monotonic() - started > PATIENCE:
            told = True
            often = "once per machine" if cache_folder() else f"at every start, as {UNWRITABLE}"
            logger.info(f"compiling the kernels: {often}; takes about a minute ...")
    if failure:
        raise failure[0]
    seconds = time.monotonic() - started
    where = cache_folder() or f"nowhere: {UNWRITABLE}"
    logger.info(f"kernels {'compiled' if told else 'ready'} in {seconds:.1f} s; their cache is {where}")
