# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""PCL through the program in `benchmarks/pcl`, which is compiled once where PCL is installed."""

from __future__ import annotations

import hashlib
import json
import shutil
import subprocess
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from benchmarks.points import FloatArray, Points, pack_rgb
from benchmarks.timing import Timing, timing
from topo_region_seg.data import Cloud
from topo_region_seg.params import Params

SOURCES = Path(__file__).resolve().parent / "pcl"
BUILT = Path(__file__).resolve().parent / "results" / "pcl"
MODULES = ("segmentation", "features", "filters", "sample_consensus", "search", "kdtree", "octree", "common")
OPTIONS = ("-std=c++17", "-O3", "-DNDEBUG", "-fopenmp", "-Wl,--copy-dt-needed-entries")
THREADS = 2
TIMEOUT = 900.0


class NoPclError(Exception):
    """PCL cannot be asked on this machine; the message says why and how to change that."""


def program() -> Path:
    """Return the compiled program; compile it if its sources are newer.

    Raises
    ------
    NoPclError
        There is no compiler, no PCL, or it does not compile.
    """
    built, why_not = _build()
    if why_not:
        raise NoPclError(why_not)
    return built


@lru_cache(maxsize=1)
def _build() -> tuple[Path, str]:
    """Return where the program is, and why it is not there if so; a failure is not tried again."""
    sources = sorted(SOURCES.iterdir())
    digest = hashlib.sha256(b"".join(source.read_bytes() for source in sources)).hexdigest()[:12]
    built = BUILT / f"pcl_peers-{digest}"
    for tool in ("g++", "pkg-config"):
        if shutil.which(tool) is None:
            return built, f"PCL is missing: no {tool} (Debian and Ubuntu: apt install g++ pkg-config libpcl-dev)"
    asked = subprocess.run(["pkg-config", "--cflags", "pcl_segmentation"], capture_output=True, text=True, check=False)
    if asked.returncode:
        return built, "PCL is missing (Debian and Ubuntu: apt install libpcl-dev)"
    if not built.exists():
        print("  compiling benchmarks/pcl (once, about a minute)", flush=True)
        BUILT.mkdir(parents=True, exist_ok=True)
        units = [str(source) for source in sources if source.suffix == ".cpp"]
        libraries = [f"-lpcl_{module}" for module in MODULES]
        command = ["g++", *OPTIONS, *asked.stdout.split(), *units, "-o", str(built), *libraries]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        if done.returncode:
            return built, f"PCL is there, but benchmarks/pcl does not compile: {done.stderr.strip()[-500:]}"
    return built, ""


def version() -> str:
    """Return PCL's version as pkg-config knows it."""
    try:
        asked = subprocess.run(
            ["pkg-config", "--modversion", "pcl_common"], capture_output=True, text=True, check=False
        )
    except FileNotFoundError:
        return "is missing"
    return asked.stdout.strip() or "is missing"


def clusters(
    points: Points, params: Params, repeats: int, folder: Path, organized: bool = False
) -> tuple[Timing, npt.NDArray[np.int32]]:
    """Cluster at every scale of the filtration by ConditionalEuclideanClustering; one thread.

    Neighbors come from PCL's kd-tree or, if `organized`, from its search in the image grid that the points were
    taken from. Returns the time of all scales together and the labels (scales, N) int32.
    """
    rows, width, height = _rows(points), len(points), 1
    if organized:
        assert points.grid is not None
        width, height = points.grid
        picked, rows = rows, np.full((width * height, rows.shape[1]), np.nan)
        rows[points.pixel] = picked
    cloud, labels = folder / "points.f64", folder / "labels.i32"
    rows.tofile(cloud)
    limits = (params.max_radius, params.filtration_steps, params.color_threshold, params.angle_threshold)
    answer = _run("clusters", cloud, width, height, *limits, repeats, labels)
    found = np.fromfile(labels, np.int32).reshape(params.filtration_steps, -1)
    return timing(answer["clusters"]["times_ms"]), found[:, points.pixel] if organized else found


def normals(points: Points, neighbors: int, repeats: int, folder: Path) -> Timing:
    """Time NormalEstimationOMP with two threads."""
    cloud = folder / "points.f64"
    _rows(points).tofile(cloud)
    answer = _run("normals", cloud, neighbors, THREADS, repeats)
    return timing(answer["normals"]["times_ms"])


def frame(cloud: Cloud, distance: float, voxel: float, repeats: int, folder: Path) -> dict[str, Timing]:
    """Time integral-image normals, the plane by RANSAC and the voxel grid of an organized frame; one thread."""
    assert cloud.rgb is not None
    path = folder / "frame.f32"
    np.column_stack([cloud.xyz.astype(np.float32), pack_rgb(cloud.rgb)]).tofile(path)
    answer = _run("frame", path, cloud.width, cloud.height, distance, voxel, repeats)
    names = ("integral_image_normals", "ransac_plane", "voxel_grid")
    return {name: timing(answer[name]["times_ms"]) for name in names}


def supervoxels(
    cloud: Cloud, rows: npt.NDArray[np.int64], voxel: float, spacing: float, repeats: int, folder: Path
) -> tuple[Timing, npt.NDArray[np.int32]]:
    """Divide some points of a cloud by SupervoxelClustering (VCCS); one thread. Returns their labels, 0 = none."""
    assert cloud.rgb is not None
    points, labels = folder / "points.f32", folder / "labels.i32"
    np.column_stack([cloud.xyz[rows].astype(np.float32), pack_rgb(cloud.rgb[rows])]).tofile(points)
    answer = _run("supervoxels", points, voxel, spacing, repeats, labels)
    return timing(answer["supervoxels"]["times_ms"]), np.fromfile(labels, np.int32)


def objects(
    cloud: Cloud,
    rows: npt.NDArray[np.int64],
    method: str,
    value: float,
    folder: Path,
    *,
    plane: float = 0.01,
    smallest: int = 64,
) -> tuple[Timing, npt.NDArray[np.int32]]:
    """Find objects among some points of a cloud; returns the processor's time and the labels, 0 = none.

    The method is ``lccp`` with voxels of `value` (m), ``region_growing`` up to an angle of `value` (degrees), or
    ``clusters`` of points up to `value` (m) apart, each after the plane with most inliers within `plane` (m) has been
    removed (0: without that).
    """
    points, labels = folder / "points.f32", folder / "labels.i32"
    rgb = np.zeros((len(cloud), 3), np.uint8) if cloud.rgb is None else cloud.rgb
    np.column_stack([cloud.xyz[rows].astype(np.float32), pack_rgb(rgb[rows])]).tofile(points)
    answer = _run("objects", method, value, points, plane, smallest, labels)
    return timing(answer["objects"]["times_ms"]), np.fromfile(labels, np.int32)


def region_growing(
    cloud: Cloud,
    rows: npt.NDArray[np.int64],
    folder: Path,
    *,
    neighbors: int = 30,
    smallest: int = 64,
    angle: float = 3.0,
    curvature: float = 1.0,
) -> npt.NDArray[np.int32]:
    """Segment some points of a cloud by RegionGrowing, whose tutorial's values are the defaults; 0 = none."""
    points, labels = folder / "points.f32", folder / "labels.i32"
    padded = np.zeros((len(rows), 4), np.float32)
    padded[:, :3] = cloud.xyz[rows]
    padded.tofile(points)
    _run("region_growing", points, neighbors, smallest, angle, curvature, 1, labels)
    return np.fromfile(labels, np.int32)


def _rows(points: Points) -> FloatArray:
    return np.column_stack([points.xyz, points.lab, points.normals])


def _run(command: str, *arguments: Any) -> dict[str, Any]:
    done = subprocess.run(
        [program(), command, *map(str, arguments)], capture_output=True, text=True, check=False, timeout=TIMEOUT
    )
    if done.returncode:
        raise RuntimeError(f"pcl_peers {command} ended with {done.returncode}: {done.stderr.strip()[-300:]}")
    answer: dict[str, Any] = json.loads(done.stdout)
    return answer
