# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Writes every message of some topics to a folder as it came: ros_listener.py DOMAIN FOLDER NAME=TYPE ...

It is a process of its own, as message packages are found by what the environment was when the process started.
"""

from __future__ import annotations

import itertools
import os
import sys
from pathlib import Path

from topo_region_seg.ros.listener import Listener


def main() -> None:
    domain, folder, *pairs = sys.argv[1:]
    number = itertools.count()

    def write(topic: str, data: bytes) -> None:
        whole = Path(folder) / f"{topic.strip('/')}.{next(number):06}.cdr"
        part = whole.with_suffix(".part")
        part.write_bytes(bytes(data))
        os.replace(part, whole)

    topics = dict(pair.split("=") for pair in pairs)
    with Listener(topics, int(domain), write) as listener:
        print("listening", flush=True)
        listener.spin(lambda: os.getppid() == 1, 3600.0)


if __name__ == "__main__":
    main()
