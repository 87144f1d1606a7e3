# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The frames with truth, by data set: recorded tabletops, other cameras and scenes, and simulated ones of all kinds."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from itertools import product
from pathlib import Path

import numpy as np

from benchmarks import recordings
from topo_region_seg.data import Cloud, LabelArray
from topo_region_seg.offline.evaluation.measures import FIRST_OBJECT, PER_OBJECT
from topo_region_seg.offline.simulation.kinds import SCENES as SIMULATED
from topo_region_seg.offline.simulation.kinds import SENSORS, simulated

SCENES = Path(__file__).resolve().parents[3] / "shared" / "data" / "scenes"
SEEDS = (11, 12)
LEAST_SEEN = 100
"""Points of a simulated object below which it counts as unknown: hardly a pixel of it is seen."""


@dataclass(frozen=True)
class Sample:
    """A cloud with truth.

    Parameters
    ----------
    cloud : Cloud
        Organized.
    truth : (N,) uint32
        0 unknown, 1 to 19 surroundings, from 20 on objects.
    complete : bool
        Whether all objects have truth; without, precision is not known.
    kind : str
        What is to be seen.
    parts : bool
        Whether labels with the same tens are parts of one object.
    """

    cloud: Cloud
    truth: LabelArray
    complete: bool
    kind: str
    parts: bool = False


@dataclass(frozen=True)
class DataSet:
    """Frames of one origin.

    Parameters
    ----------
    title : str
        For the document.
    names : list of str
        Of the frames.
    load : callable
        Returns the frame of a name.
    missing : str
        Why there are none; empty if there are.
    """

    title: str
    names: list[str]
    load: Callable[[str], Sample]
    missing: str = ""


def data_sets() -> dict[str, DataSet]:
    """Return all data sets by name."""
    return {"tabletop": _tabletop(), "scenes": _scenes(), "simulated": _simulated()}


def _tabletop() -> DataSet:
    title = f"Tabletops, {recordings.source()}"
    return DataSet(title, [frame.name for frame in recordings.frames()], _tabletop_frame)


def _tabletop_frame(name: str) -> Sample:
    frame = next(frame for frame in recordings.frames() if frame.name == name)
    return Sample(frame.cloud(), frame.truth, True, "tabletop", parts=True)


def _scenes() -> DataSet:
    title = "Other cameras and scenes, development frames"
    if not SCENES.is_dir():
        return DataSet(title, [], _scene, f"{SCENES} is not there")
    return DataSet(title, [name for name, about in _catalog().items() if about["objects"]], _scene)


@lru_cache(maxsize=1)
def _catalog() -> dict[str, dict[str, object]]:
    found: dict[str, dict[str, object]] = json.loads((SCENES / "scenes.json").read_text(encoding="utf-8"))
    return found


def _scene(name: str) -> Sample:
    with np.load(SCENES / f"{name}.npz") as file:
        depth, k = file["depth"].astype(np.float32) / float(file["depth_scale"]), file["K"]
        rgb, truth = file["rgb"], file["truth"].astype(np.uint32)
    depth[depth <= 0] = np.nan
    v, u = np.indices(depth.shape)
    xyz = np.stack([(u - k[0, 2]) / k[0, 0] * depth, (v - k[1, 2]) / k[1, 1] * depth, depth], -1)
    known = np.where(truth < 20, 1, truth).astype(np.uint32)
    known[np.isnan(depth)] = 0
    about = _catalog()[name]
    cloud = Cloud(xyz.reshape(-1, 3).astype(np.float32), rgb.reshape(-1, 3), *depth.shape)
    return Sample(cloud, known.ravel(), bool(about["all_objects_labelled"]), str(about["scene"] or "other"))


def _simulated() -> DataSet:
    names = [f"{scene}, {sensor}, {seed}" for scene, sensor, seed in product(SIMULATED, SENSORS, SEEDS)]
    return DataSet("Simulated scenes, each seen by three kinds of camera", names, _simulated_frame)


def _simulated_frame(name: str) -> Sample:
    scene, sensor, seed = name.split(", ")
    frame = simulated(scene, sensor, int(seed))
    truth = np.where(frame.labels >= FIRST_OBJECT, frame.labels // PER_OBJECT * PER_OBJECT, frame.labels)
    labels, size = np.unique(truth, return_counts=True)
    hardly_seen = labels[(labels >= FIRST_OBJECT) & (size < LEAST_SEEN)]
    truth[np.isin(truth, hardly_seen)] = 0
    return Sample(frame.cloud, truth.astype(np.uint32), True, f"{scene}, {sensor}")
