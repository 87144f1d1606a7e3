# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""A camera in a process of its own: ``python -m benchmarks.camera FOLDER COUNT HZ`` publishes the clouds in FOLDER."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

from topo_region_seg.ros.player import Playback, play


def main() -> None:
    """Publish COUNT clouds with the present time as their stamp, one file after the other, from memory."""
    folder, count, hz = Path(sys.argv[1]), int(sys.argv[2]), float(sys.argv[3])
    files = [file.read_bytes() for file in sorted(folder.glob("*.cdr"))]

    def clouds() -> Iterator[tuple[int, bytes]]:
        for number in range(count):
            yield number, files[number % len(files)]

    playback = Playback(topic="points", hz=hz, stamp_now=True, wait_timeout=30.0)
    print(play(clouds, playback, report=print, step=lambda: None), flush=True)


if __name__ == "__main__":
    main()
