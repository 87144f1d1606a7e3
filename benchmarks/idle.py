# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""What the node costs while nobody wants its results: ``python -m benchmarks.idle`` prints shares of a core.

A camera publishes 640x480 clouds at 30 Hz. First nobody subscribes to anything of the node; then somebody subscribes to
the labels, but ``rate_limit`` lets hardly any cloud through, which leaves the cost of taking the clouds alone.
"""

from __future__ import annotations

import os
import tempfile
import time
from pathlib import Path

from benchmarks.node_process import ACTIVE, NodeProcess, ros_is_there
from benchmarks.parts.end_to_end import HZ, camera
from topo_region_seg.offline.bags.clouds import POINT_CLOUD

SETTLE, MEASURED = 5.0, 15.0
"""Seconds until the node has found that nobody subscribes, and those that are measured."""
LIMIT = 0.01
"""Clouds a second that are let through."""


def main() -> int:
    """Measure and print."""
    if not ros_is_there():
        print("rclpy is not installed: pip install '.[ros]'")
        return 1
    from topo_region_seg.ros.listener import Listener

    domain = 1 + os.getpid() % 100
    for name, topics, arguments in (
        ("nobody subscribes", {"/rosout": "rcl_interfaces/msg/Log"}, ()),
        ("clouds taken, hardly any processed", {"/labeled_points": POINT_CLOUD}, ("-p", f"rate_limit:={LIMIT}")),
    ):
        with tempfile.TemporaryDirectory() as folder:
            log = Path(folder, "node.log")
            with (
                NodeProcess(domain, log, arguments=arguments) as node,
                Listener(topics, domain, lambda topic, data: None) as listener,
            ):
                node.wait_for(ACTIVE, 150.0)
                with camera(Path(folder), domain, round((SETTLE + MEASURED + 5.0) * HZ), HZ, {}):
                    listener.spin(lambda: False, SETTLE)
                    busy, started = node.cpu_seconds(), time.monotonic()
                    listener.spin(lambda: False, MEASURED)
                    share = (node.cpu_seconds() - busy) / (time.monotonic() - started)
        print(f"{name}: {100.0 * share:.1f} % of a core", flush=True)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
