# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""How well regions part faces and keep to objects, beside PCL's RegionGrowing: simulated, recorded, other cameras."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import partial
from pathlib import Path

import numpy as np

from benchmarks import pcl_peers
from benchmarks.beyond.auto_radius import objects_found
from benchmarks.beyond.moved import seen_from
from benchmarks.beyond.quality import weighted_overlap
from benchmarks.beyond.steadiness import dropped, noisy
from benchmarks.objects.datasets import Sample, data_sets
from benchmarks.report import table
from benchmarks.results import Setting
from topo_region_seg.data import Cloud, LabelArray
from topo_region_seg.offline.evaluation import measures
from topo_region_seg.offline.simulation.frame import SimulatedFrame
from topo_region_seg.params import Params
from topo_region_seg.pipeline import Pipeline

TITLE = "Faces and objects"
DOCUMENT = "regions.md"
SCENES = 4
NOISES = (0.0, 1.0, 2.0)
DISTANCES = (0.7, 1.0, 1.5, 2.0, 2.5)
ANGLES = (3.0, 5.0, 9.0, 15.0)
"""PCL's angles, degrees: from its tutorial's to what suits rough clouds; the best one of them is shown."""
RECORDED = {"scenes": "other cameras", "tabletop": "tabletops"}
GOALS = {
    "noise": "0.92 / 0.89 / 0.82",
    "distance": "0.85 / 0.90 / 0.90 / 0.85 / 0.75",
    "scenes": "0.90 / 0.03 / at most 3",
    "tabletop": "0.97 / 0.015 / at most 3",
}
Segment = Callable[[Cloud], LabelArray]
OURS: Mapping[str, Params] = {
    "defaults": Params(),
    "`max_radius: 0.02`": Params(max_radius=0.02),
    "`creases: ignore`": Params(creases="ignore"),
}


def ours(params: Params, cloud: Cloud) -> LabelArray:
    """Return the regions' labels; notices are not heard."""
    return Pipeline(params).run(cloud, _unheard).labels


def of_pcl(angle: float, folder: Path, cloud: Cloud) -> LabelArray:
    """Return PCL's regions of the points that are left when ours has removed the table."""
    rows = Pipeline(Params(voxel_size=0.0)).run(cloud, _unheard).index
    labels = np.zeros(len(cloud), np.uint32)
    labels[rows] = pcl_peers.region_growing(cloud, rows, folder, angle=angle)
    return labels


def faces(frames: Mapping[float, Sequence[SimulatedFrame]], segment: Segment) -> str:
    """Return the weighted overlap with the true faces at each noise."""
    means = [
        np.mean([weighted_overlap(frame.labels, segment(frame.cloud), frame.cloud) for frame in some])
        for some in frames.values()
    ]
    return " / ".join(f"{mean:.3f}" for mean in means)


def faces_found(frames: Mapping[float, Sequence[SimulatedFrame]], segment: Segment) -> str:
    """Return the share of faces that are found at each distance."""
    return " / ".join(
        f"{np.mean([objects_found(frame, segment(frame.cloud)) for frame in some]):.2f}" for some in frames.values()
    )


def leaks(samples: Iterable[Sample], segment: Segment) -> str:
    """Return achievable accuracy, spill and pieces by whole objects, means over the frames."""
    found = []
    for sample in samples:
        valid = np.isfinite(sample.cloud.xyz).all(axis=1)
        reading = measures.TruthReading(whole_objects=sample.parts)
        measured = measures.measure(sample.truth, segment(sample.cloud), valid, reading=reading)
        found.append([measured[name] or 0.0 for name in ("achievable", "spill", "pieces")])
    achievable, spill, pieces = np.mean(found, axis=0)
    return f"{achievable:.3f} / {spill:.3f} / {pieces:.1f}"


def programs(setting: Setting) -> tuple[dict[str, Segment], str]:
    """Return how each program segments a frame, and a sentence about PCL."""
    found: dict[str, Segment] = {name: partial(ours, params) for name, params in OURS.items()}
    try:
        pcl_peers.program()
    except pcl_peers.NoPclError as error:
        return found, f"Without PCL: {error}."
    for angle in setting.choose(ANGLES, ANGLES[:1]):
        found[f"PCL, {angle:g}°"] = partial(of_pcl, angle, setting.folder)
    return found, (
        "PCL's RegionGrowing takes 30 neighbors, and the points that are left when the table is gone by our defaults."
    )


def measure(setting: Setting, images: Path) -> str:
    """Measure all kinds of data with all programs; return the table."""
    columns, about_pcl = programs(setting)
    scenes = range(setting.choose(SCENES, 1))
    of_noise = {n: [noisy(s, n) if n else dropped(s, 0.0) for s in scenes] for n in setting.choose(NOISES, NOISES[:2])}
    far = setting.choose(DISTANCES, DISTANCES[1:2])
    of_distance = {d: [seen_from(s, d, noisy=True).frame for s in scenes] for d in far}
    rows = [
        [
            f"simulated faces, WOv, noise {_listed(of_noise)} times a Kinect's",
            *(faces(of_noise, segment) for segment in columns.values()),
            GOALS["noise"],
        ],
        [
            f"faces found (IoU 0.5) at {_listed(of_distance)} m, a Kinect's noise",
            *(faces_found(of_distance, columns[name]) if name in OURS else "" for name in columns),
            GOALS["distance"],
        ],
    ]
    for name, title in RECORDED.items():
        one = data_sets()[name]
        if one.missing:
            continue
        samples = [one.load(frame) for frame in one.names[:: setting.choose(1, 8)]]
        about = f"{title} ({len(samples)} frames), achievable accuracy / spill / pieces"
        rows.append([about, *(leaks(samples, segment) for segment in columns.values()), GOALS[name]])
    about = f"{len(scenes)} simulated tabletops, and recorded frames with truth by objects; means. {about_pcl}"
    return f"{about}\n\n{table(['', *columns, 'goal'], rows)}"


def _listed(values: Iterable[float]) -> str:
    return " / ".join(f"{value:g}" for value in values)


def _unheard(code: str, text: str) -> None:
    """Take what is said of a frame."""
