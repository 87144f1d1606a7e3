# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""A listener in a process of its own: ``python -m benchmarks.load.hear DOMAIN FILE TOPIC=TYPE ...``.

Once its input is closed it writes to FILE, as JSON: the latencies of each topic with a header, stamp to arrival, ms,
and what the last diagnostics of each segmentation said.
"""

from __future__ import annotations

import json
import struct
import sys
import threading
import time
from pathlib import Path

from rclpy.serialization import deserialize_message

from topo_region_seg.ros.listener import Listener

DIAGNOSTICS = "/diagnostics"


def main() -> None:
    """Listen until nobody is at the other end of the standard input."""
    domain, file, *pairs = sys.argv[1:]
    topics = dict(pair.split("=") for pair in pairs)
    latencies: dict[str, list[float]] = {topic: [] for topic in topics}
    figures: dict[str, dict[str, str]] = {}

    def hear(topic: str, data: bytes) -> None:
        if topic == DIAGNOSTICS:
            from diagnostic_msgs.msg import DiagnosticArray

            for status in deserialize_message(bytes(data), DiagnosticArray).status:
                figures[status.name] = {item.key: item.value for item in status.values}
        elif "std_msgs" not in topics[topic] and "Marker" not in topics[topic]:
            sec, nanosec = struct.unpack_from("<iI", data, 4)
            latencies[topic].append((time.time_ns() - sec * 1_000_000_000 - nanosec) * 1e-6)

    ended = threading.Event()
    threading.Thread(target=lambda: (sys.stdin.read(), ended.set()), daemon=True).start()
    with Listener({**topics, DIAGNOSTICS: "diagnostic_msgs/msg/DiagnosticArray"}, int(domain), hear) as listener:
        print("listening", flush=True)
        listener.spin(ended.is_set, 3600.0)
    Path(file).write_text(json.dumps({"latencies": latencies, "figures": figures}), encoding="utf-8")


if __name__ == "__main__":
    main()
