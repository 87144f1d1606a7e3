# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""How much barcode and regions change as noise, dropouts and sampling grow, beside PCL's RegionGrowing."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from benchmarks import pcl_peers
from benchmarks.beyond.quality import weighted_overlap
from benchmarks.recordings import FIRST_OBJECT
from benchmarks.report import table
from benchmarks.results import Setting
from topo_region_seg.data import FloatArray, LabelArray
from topo_region_seg.offline.simulation import Camera, simulate, tabletop
from topo_region_seg.offline.simulation.frame import SimulatedFrame
from topo_region_seg.offline.simulation.noise import DepthNoise
from topo_region_seg.params import Params
from topo_region_seg.pipeline import Pipeline
from topo_region_seg.segmentation import Segmentation

TITLE = "Steadiness"
DOCUMENT = "steadiness.md"
SCENES = 4
NOISE = (0.25, 0.5, 1.0, 1.5, 2.0)
DROPOUTS = (0.05, 0.1, 0.2, 0.4, 0.6)
SAMPLING = (2, 3, 4)
QUIET = DepthNoise(disparity_sigma=0.0, disparity_step=0.0, edge_loss=0.0, random_loss=0.0, color_sigma=0.0)
PRECISION = 1e-6
"""Of the bottleneck distance, metres."""
COLUMNS = [
    "",
    "farthest point moved (mm)",
    "bottleneck (mm)",
    "bottleneck, positions only (mm)",
    "WOv to undisturbed",
    "PCL's",
    "WOv to truth",
    "PCL's ",
]


@dataclass(frozen=True)
class Found:
    """What was made of a cloud: labels of both programs (N,), and barcodes (M, 2) in metres."""

    frame: SimulatedFrame
    labels: LabelArray
    pcl: LabelArray
    bars: FloatArray
    bars_of_positions: FloatArray


def bars(seg: Segmentation) -> FloatArray:
    """Return (birth, death) of every bar (M, 2), metres; what lives on at the end of the filtration dies there."""
    death = np.minimum(seg.barcode.death, seg.barcode.max_radius)
    return np.column_stack([np.zeros_like(death), death])


def bottleneck(one: FloatArray, other: FloatArray) -> float:
    """Return the bottleneck distance of two barcodes, metres."""
    import gudhi

    return float(gudhi.bottleneck_distance(one, other, PRECISION))


def segment(frame: SimulatedFrame, folder: Path) -> Found:
    """Segment a frame with both programs; PCL is given the points that are left when the table is gone."""
    # Without thinning, whose voxels are no part of what the theorem speaks of.
    whole = Pipeline(Params(voxel_size=0.0)).run(frame.cloud)
    alone = Pipeline(Params(features="color", color_threshold=500.0, voxel_size=0.0)).run(frame.cloud)
    pcl = np.zeros(len(frame.cloud), np.uint32)
    pcl[whole.index] = pcl_peers.region_growing(frame.cloud, whole.index, folder)
    return Found(frame, Pipeline(Params()).run(frame.cloud).labels, pcl, bars(whole), bars(alone))


def noisy(scene: int, factor: float) -> SimulatedFrame:
    """Return a scene with depth noise that is `factor` times a Kinect's; no point is lost."""
    noise = replace(QUIET, disparity_sigma=factor * DepthNoise().disparity_sigma)
    return simulate(tabletop(scene), Camera.kinect(), scene, noise)


def dropped(scene: int, share: float) -> SimulatedFrame:
    """Return a scene of which a share of the points is lost."""
    return simulate(tabletop(scene), Camera.kinect(), scene, replace(QUIET, random_loss=share))


def sampled(scene: int, step: int) -> SimulatedFrame:
    """Return a scene of which every `step`-th row and column is left; the others are without depth."""
    frame = dropped(scene, 0.0)
    keep = np.zeros((frame.cloud.height, frame.cloud.width), np.bool_)
    keep[::step, ::step] = True
    xyz = np.where(keep.reshape(-1, 1), frame.cloud.xyz, np.nan).astype(np.float32)
    labels = np.where(keep.ravel(), frame.labels, 0).astype(np.uint32)
    return replace(frame, cloud=replace(frame.cloud, xyz=xyz), labels=labels)


def compared(still: Found, other: Found) -> list[float]:
    """Return the figures of a disturbed frame, in the order of COLUMNS."""
    cloud = other.frame.cloud
    both = np.isfinite(cloud.xyz).all(axis=1) & np.isfinite(still.frame.cloud.xyz).all(axis=1)
    objects = both & (other.frame.labels >= FIRST_OBJECT)
    moved = np.max(np.linalg.norm(cloud.xyz[objects] - still.frame.cloud.xyz[objects], axis=1))
    shifted = [np.where(labels > 0, labels + FIRST_OBJECT, 0).astype(np.uint32) for labels in (still.labels, still.pcl)]
    return [
        1e3 * float(moved),
        1e3 * bottleneck(still.bars, other.bars),
        1e3 * bottleneck(still.bars_of_positions, other.bars_of_positions),
        weighted_overlap(shifted[0], other.labels, cloud),
        weighted_overlap(shifted[1], other.pcl, cloud),
        weighted_overlap(other.frame.labels, other.labels, cloud),
        weighted_overlap(other.frame.labels, other.pcl, cloud),
    ]


def measure(setting: Setting, images: Path) -> str:
    """Disturb scenes more and more; return the tables."""
    scenes = range(setting.choose(SCENES, 1))
    still = [segment(dropped(scene, 0.0), setting.folder) for scene in scenes]
    kinds: dict[str, tuple[Sequence[Any], Callable[[int, Any], SimulatedFrame], Callable[[Any], str]]] = {
        "Noise": (NOISE, noisy, lambda value: f"{value:g} times a Kinect's"),
        "Dropouts": (DROPOUTS, dropped, lambda value: f"{value:.0%} of the points lost"),
        "Sampling": (SAMPLING, sampled, lambda value: f"every {value}. row and column"),
    }
    blocks = [
        f"{len(scenes)} simulated tabletops, 640x480, the mean of all; each is compared with itself undisturbed. "
        "PCL's RegionGrowing has its tutorial's values (30 neighbors, 3 degrees, curvature 1) and the same points."
    ]
    curves: dict[str, tuple[list[float], list[list[float]]]] = {}
    start = [float(x) for x in np.mean([compared(one, one) for one in still], axis=0)]
    for name, (values, disturb, text) in kinds.items():
        chosen = setting.choose(values, values[1:3])
        rows = [["undisturbed", *_texts(start)]]
        figures = [start]
        for value in chosen:
            disturbed = [segment(disturb(scene, value), setting.folder) for scene in scenes]
            found = [compared(before, after) for before, after in zip(still, disturbed, strict=True)]
            figures.append([float(x) for x in np.mean(found, axis=0)])
            rows.append([text(value), *_texts(figures[-1])])
        curves[name] = ([1.0 if name == "Sampling" else 0.0, *map(float, chosen)], figures)
        blocks += [f"**{name}**", table(COLUMNS, rows)]
    _picture(curves, images / "steadiness.png")
    blocks.append("![Distance of barcodes, overlap of regions: noise, dropouts, sampling](images/steadiness.png)")
    return "\n\n".join(blocks)


def _texts(figures: Sequence[float]) -> list[str]:
    return [*(f"{value:.2f}" for value in figures[:3]), *(f"{value:.3f}" for value in figures[3:])]


def _picture(curves: dict[str, tuple[list[float], list[list[float]]]], path: Path) -> None:
    """Draw the bottleneck distances above, the overlaps below; a column for each way to disturb."""
    axis = {"Noise": "times a Kinect's noise", "Dropouts": "share of points lost", "Sampling": "every n-th row"}
    figure = Figure(figsize=(12, 6.2), dpi=80, facecolor="white", layout="constrained")
    axes = figure.subplots(2, len(curves), sharex="col", sharey="row")
    for column, (name, (values, figures)) in enumerate(curves.items()):
        rows = np.array(figures)
        above, below = axes[0, column], axes[1, column]
        above.plot(values, rows[:, 1], "o-", color="#1b6ca8", label="with the criterion")
        above.plot(values, rows[:, 2], "s-", color="#e08e0b", label="positions only")
        below.plot(values, rows[:, 3], "o-", color="#1b6ca8", label="ours, to undisturbed")
        below.plot(values, rows[:, 4], "o-", color="#9a9a9a", label="PCL, to undisturbed")
        below.plot(values, rows[:, 5], "s--", color="#1b6ca8", label="ours, to truth")
        below.plot(values, rows[:, 6], "s--", color="#9a9a9a", label="PCL, to truth")
        above.set_title(name)
        below.set_xlabel(axis[name])
        below.set_ylim(0.0, 1.03)
        for one in (above, below):
            one.spines[["top", "right"]].set_visible(False)
    axes[0, 0].set_ylabel("bottleneck distance (mm)")
    axes[1, 0].set_ylabel("weighted overlap")
    for row in (0, 1):
        axes[row, 0].legend(frameon=False, fontsize=8)
    figure.savefig(path)
