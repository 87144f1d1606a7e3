# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Whole 640x480 frames with truth: recorded ones where ../shared has them, else simulated ones."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

import topo_region_seg as trs
from benchmarks.points import Points, featured
from topo_region_seg.cloud.pointcloud2 import decode
from topo_region_seg.offline.bags import open_bag
from topo_region_seg.offline.bags.clouds import decode_message

RECORDING = Path(__file__).resolve().parents[2] / "shared" / "data" / "bags" / "tabletop_labelled"
CLOUDS, TRUTH = "/camera/depth/points", "/ground_truth/labels"
SIMULATED = 12
FIRST_OBJECT = 20
PER_OBJECT = 10


@dataclass(frozen=True)
class Frame:
    """A message as the camera's driver publishes it (rosbags' class), and the truth of its points (N,) uint32.

    Truth: 0 invalid, 1 to 9 the surroundings, 20 to 29 the parts of the first object, 30 to 39 of the second, ...
    """

    name: str
    msg: Any
    truth: npt.NDArray[np.uint32]

    def cloud(self) -> trs.Cloud:
        """Decode the message."""
        return decode(self.msg, max_points=1_000_000)

    def valid(self) -> int:
        """Return the number of points with a depth."""
        return int(np.isfinite(self.cloud().xyz).all(axis=1).sum())


def source() -> str:
    """Say in a word where the frames come from."""
    return "recorded" if RECORDING.is_dir() else "simulated"


@lru_cache(maxsize=1)
def frames() -> tuple[Frame, ...]:
    """Return all frames."""
    return tuple(_recorded() if RECORDING.is_dir() else _simulated())


def whole_frame(frame: Frame) -> Points:
    """Return all valid points of a frame, the table and what is behind it included."""
    return featured(frame.name, frame.cloud(), trs.Params(max_radius=0.02, remove_floor=False))


@lru_cache(maxsize=1)
def object_points() -> tuple[Points, ...]:
    """Return for each frame the points that are left when the table is gone and that belong to an object."""
    found = []
    for frame in frames():
        points = featured(frame.name, frame.cloud(), trs.Params(max_radius=0.02))
        on_object = np.flatnonzero(frame.truth[points.pixel] >= FIRST_OBJECT)
        found.append(points.take(on_object, f"objects of {frame.name}"))
    return tuple(found)


def objects_cut(n: int) -> Points:
    """Return all object points of the frame that has about `n`, or else the `n` nearest to the middle of more."""
    close = min(object_points(), key=lambda points: abs(len(points) - n))
    if abs(len(close) - n) <= 0.1 * n:
        return close.take(np.arange(len(close)), f"{close.name}, {len(close):,} points")
    return cut(close if len(close) > n else max(object_points(), key=len), n)


def cut(points: Points, n: int) -> Points:
    """Return the `n` points nearest to the middle."""
    middle = np.median(points.xyz, axis=0)
    rows = np.sort(np.argsort(((points.xyz - middle) ** 2).sum(axis=1), kind="stable")[:n])
    return points.take(rows, f"{points.name}, {len(rows):,} points")


def _recorded() -> Iterator[Frame]:
    with open_bag(RECORDING) as reader:
        topics = {topic.name: topic for topic in reader.topics}
        truths = [decode_message(record, topics[TRUTH]) for record in reader.messages([TRUTH])]
        clouds = [decode_message(record, topics[CLOUDS]) for record in reader.messages([CLOUDS])]
    for number, (msg, truth) in enumerate(zip(clouds, truths, strict=True)):
        yield Frame(f"frame {number}", msg, np.frombuffer(truth.data, "<u4"))


def _simulated() -> Iterator[Frame]:
    from topo_region_seg.offline.simulation import Camera, simulate, tabletop
    from topo_region_seg.offline.simulation.recording import camera_cloud, make_header

    for number in range(SIMULATED):
        frame = simulate(tabletop(number), Camera.kinect(), number)
        msg = camera_cloud(make_header(number, "camera_depth_optical_frame"), frame.cloud)
        yield Frame(f"simulated frame {number}", msg, frame.labels)
