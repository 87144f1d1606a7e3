# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Compiling the kernels without keeping anybody from stopping the node."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from typing import TYPE_CHECKING

from rclpy.executors import ExternalShutdownException

from topo_region_seg.beyond.boxes.oriented import warm_up_boxes
from topo_region_seg.compiled.cache import cache_folder
from topo_region_seg.pipeline import warm_up

if TYPE_CHECKING:
    from rclpy.impl.rcutils_logger import RcutilsLogger

PATIENCE = 2.0
"""Seconds after which it is clear that kernels are being compiled, not loaded from the cache."""

UNWRITABLE = "no folder can be written to; set NUMBA_CACHE_DIR to one"


def warm_up_kernels(logger: RcutilsLogger, wanted: Callable[[], bool]) -> None:
    """Compile or load the kernels, so that the first frame is as fast as the others.

    Compilation takes long and cannot be interrupted, so it gets a thread of its own, which is left behind if
    `wanted` becomes false.

    Raises
    ------
    ExternalShutdownException
        If `wanted` became false.
    """
    failure: list[Exception] = []

    def work() -> None:
        try:
            warm_up()
            warm_up_boxes()
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
