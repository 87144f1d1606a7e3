# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""A camera in a process of its own: ``python -m benchmarks.load.camera FOLDER INPUT COUNT HZ PREFIX``.

INPUT is points or depth, PREFIX goes before the names of the topics.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator, Mapping
from pathlib import Path

from topo_region_seg.ros.player import Playback, play

IMAGE, INFO = "sensor_msgs/msg/Image", "sensor_msgs/msg/CameraInfo"
IMAGES = {"depth/camera_info": INFO, "color/image": IMAGE, "depth/image": IMAGE}
INPUTS: dict[str, tuple[str, ...]] = {"points": ("points",), "depth": tuple(IMAGES)}


def main() -> None:
    """Publish COUNT frames with the present time as their stamp, one after the other, from memory."""
    folder, given, count, hz, prefix = Path(sys.argv[1]), sys.argv[2], int(sys.argv[3]), float(sys.argv[4]), sys.argv[5]
    messages = {topic: _files(folder, topic) for topic in INPUTS[given]}

    def frames() -> Iterator[tuple[int, bytes | Mapping[str, bytes]]]:
        for number in range(count):
            yield number, {prefix + topic: files[number % len(files)] for topic, files in messages.items()}

    kinds = {prefix + topic: IMAGES.get(topic, "sensor_msgs/msg/PointCloud2") for topic in messages}
    topic = prefix + INPUTS[given][-1]
    playback = Playback(topic=topic, hz=hz, stamp_now=True, wait_timeout=30.0, images=kinds)
    print(play(frames, playback, report=print, step=lambda: None).published, flush=True)


def _files(folder: Path, topic: str) -> list[bytes]:
    return [file.read_bytes() for file in sorted(folder.glob(f"*.{topic.replace('/', '+')}.cdr"))]


if __name__ == "__main__":
    main()
