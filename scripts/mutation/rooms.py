# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The rooms of the package whose tests are tried, and which tests each of their files must satisfy."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType

PACKAGE = "topo_region_seg"
SHORTEST = 4
"""Letters of a word that may begin a longer one of the same meaning."""
NOT_TRIED = {"compiled/cache.py", "compiled/threads.py", "offline/cli/interrupt.py"}
"""What acts outside of the process that tries it: its tests run with caches and signals of their own."""


@dataclass(frozen=True)
class Room:
    """Part of the package: paths within it, tests within test/, and how many mutants are chosen by default."""

    name: str
    paths: tuple[str, ...]
    tests: tuple[str, ...]
    mutants: int

    def files(self, root: Path) -> list[str]:
        """Return the room's modules, as paths within the package."""
        package = root / PACKAGE
        found: list[Path] = []
        for path in self.paths:
            place = package / path
            if not place.exists():
                raise FileNotFoundError(f"{place}: the sources of the room {self.name} are not there")
            found += sorted(place.rglob("*.py")) if place.is_dir() else [place]
        names = [file.relative_to(package).as_posix() for file in found]
        return [name for name in names if name not in NOT_TRIED and not name.endswith("__init__.py")]


_PIPELINE = (
    "steps",
    "compiled/test_lattice.py",
    "compiled/test_sampling.py",
    "compiled/test_order.py",
    "compiled/test_trees.py",
    "test_pipeline.py",
    "test_sensor.py",
    "beyond",
)
_ROS = (
    "ros/test_worker.py",
    "ros/test_kernels.py",
    "ros/test_rclpy_private.py",
    "ros/test_log.py",
    "ros/test_statistics.py",
    "ros/test_reporter.py",
    "ros/test_ros_processor.py",
    "ros/test_input_closing.py",
    "ros/test_parameter_files.py",
    "ros/test_dead_segments.py",
    "ros/test_input.py",
    "ros/test_demand.py",
    "ros/test_depth_input.py",
    "ros/test_advice.py",
    "ros/test_ending.py",
    "ros/test_ros_transport.py",
    "ros/test_player.py",
    "ros/test_ros_node.py",
    "ros/test_ros_lifecycle.py",
    "ros/test_on_demand.py",
    "ros/test_ros_depth.py",
    "ros/test_ros_transforms.py",
    "ros/test_outputs.py",
    "ros/test_cameras.py",
)
ROOMS = (
    Room("steps", ("steps", "growth.py"), _PIPELINE, 44),
    Room("kernels", ("compiled",), _PIPELINE, 24),
    Room("beyond", ("beyond",), ("beyond", "test_pipeline.py", "steps/test_scales.py"), 30),
    Room(
        "core",
        ("data.py", "params.py", "output.py", "segmentation.py", "pipeline.py"),
        (
            "test_params.py",
            "test_config.py",
            "test_parameter_docs.py",
            "test_documents.py",
            "compiled/test_kernel_cache.py",
            *_PIPELINE,
        ),
        16,
    ),
    Room(
        "cloud",
        ("cloud",),
        ("cloud", "ros/test_ros_processor.py", "offline/test_segment.py", "offline/evaluation/test_evaluate.py")
        + ("offline/test_whole_files.py",),
        26,
    ),
    Room(
        "bags",
        ("offline/bags", "offline/frames.py", "offline/stamps.py"),
        ("offline/bags", "offline/test_inspect.py", "offline/test_tools.py", "offline/test_whole_files.py"),
        30,
    ),
    Room("ros", ("ros",), _ROS, 26),
    Room(
        "evaluation",
        ("offline/evaluation", "offline/runs"),
        ("offline/evaluation", "offline/runs", "offline/test_tools.py", "offline/test_whole_files.py"),
        30,
    ),
    Room(
        "tools",
        ("offline/cli", "offline/inspection", "offline/report"),
        ("offline/test_tools.py", "offline/test_segment.py", "offline/test_inspect.py", "offline/runs")
        + ("offline/evaluation", "offline/report/test_report.py", "offline/test_whole_files.py"),
        30,
    ),
)
BY_NAME = {room.name: room for room in ROOMS}


def tests_of(
    room: Room, file: str, root: Path, seconds: Mapping[str, float] = MappingProxyType({})
) -> tuple[list[str], list[str]]:
    """Return the tests that a file of a room must satisfy: those that name it or its folder, and the others.

    A test file counts as the file's own where a word of its name begins one of the file's or the other way round, such
    as `compare.py` and `test_compare.py`, or `inspection/topic.py` and `test_inspect.py`.
    Both begin with the fast ones; what each took with the unchanged sources is in `seconds`.
    """
    files: list[Path] = []
    for path in room.tests:
        place = root / "test" / path
        if not place.exists():
            raise FileNotFoundError(f"{place}: the tests of the room {room.name} are not there")
        files += sorted(place.rglob("test_*.py")) if place.is_dir() else [place]
    words = {word for part in file.removesuffix(".py").split("/")[-2:] for word in part.rstrip("s").split("_")}
    names = {place.relative_to(root).as_posix(): _alike(words, _words(place)) for place in files}
    ranked = sorted(names, key=lambda name: seconds.get(name, 0.0))
    return [name for name in ranked if names[name]], [name for name in ranked if not names[name]]


def _alike(words: set[str], others: set[str]) -> bool:
    pairs = [sorted((one, other), key=len) for one in words for other in others]
    return any(long == short or (len(short) >= SHORTEST and long.startswith(short)) for short, long in pairs)


def _words(test: Path) -> set[str]:
    return {word.rstrip("s") for word in test.stem.split("_")[1:]}
