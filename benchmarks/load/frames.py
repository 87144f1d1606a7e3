# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The frames of a simulated camera over a tabletop, serialized: clouds, and depth images with what belongs to them."""

from __future__ import annotations

from pathlib import Path

from benchmarks.tabletops import FRAME, camera, seen
from topo_region_seg.offline.bags.types import typestore
from topo_region_seg.offline.simulation.images import COLOR_TOPIC, DEPTH_TOPIC, INFO_TOPIC, image_messages
from topo_region_seg.offline.simulation.recording import camera_cloud, make_header

FRAMES = 6
TOPICS = {DEPTH_TOPIC: "depth/image", INFO_TOPIC: "depth/camera_info", COLOR_TOPIC: "color/image"}
"""Of a recording, and what the node calls them."""


def write_frames(folder: Path, width: int, height: int) -> None:
    """Write each message of some frames to a file ``NUMBER.TOPIC.cdr``, with + for / in the topic."""
    folder.mkdir(parents=True, exist_ok=True)
    for number in range(FRAMES):
        cloud, header = seen(number, width, height), make_header(number, FRAME)
        _write(folder, number, "points", camera_cloud(header, cloud))
        for topic, msg in image_messages(header, cloud, camera(width, height)):
            _write(folder, number, TOPICS[topic], msg)


def _write(folder: Path, number: int, topic: str, msg: object) -> None:
    data = typestore().serialize_cdr(msg, msg.__msgtype__)  # type: ignore[attr-defined]
    (folder / f"{number:02}.{topic.replace('/', '+')}.cdr").write_bytes(data)
