# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Supervoxels beside as many of PCL's SupervoxelClustering (VCCS): how well they keep to borders of objects."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from contextlib import suppress
from pathlib import Path

import numpy as np
import numpy.typing as npt
from matplotlib.figure import Figure

from benchmarks import pcl_peers
from benchmarks.recordings import FIRST_OBJECT, PER_OBJECT, Frame, frames, source
from benchmarks.report import table
from benchmarks.results import Setting
from topo_region_seg.data import LabelArray
from topo_region_seg.offline.evaluation.boundaries import boundary, share_near
from topo_region_seg.offline.figures.shading import own_colors, region_colors
from topo_region_seg.params import Params
from topo_region_seg.pipeline import Pipeline

TITLE = "Supervoxels"
DOCUMENT = "supervoxels.md"
SPACINGS = (0.03, 0.05, 0.08)
PICTURED = 0.05
PCL_VOXELS = (0.004, 0.008)
ROUNDS = 4
"""Runs of PCL until its number of patches is ours."""
COLUMNS = ["", "patches", "boundary recall", "boundary precision", "under-segmentation error", "ms"]
PARAMS = Params(output="supervoxels", remove_floor=False)
VARIANTS: dict[str, dict[str, object]] = {
    "**as they are by default**": {},
    "without colors": {"features": "normals"},
    "without normals": {"features": "color"},
    "neither: positions alone": {"features": "color", "color_threshold": 500.0},
    "dE up to 5": {"color_threshold": 5.0},
    "angles up to 3 degrees": {"angle_threshold": 3.0},
    "angles up to 10 degrees": {"angle_threshold": 10.0},
    "small patches removed": {"small_regions": "remove"},
    "no thinning": {"voxel_size": 0.0},
}

Patches = tuple[LabelArray, float]
"""Labels (N,), 0 = none, and the milliseconds that they took."""


def whole_objects(truth: npt.NDArray[np.uint32]) -> npt.NDArray[np.uint32]:
    """Return the truth with the parts of an object as one."""
    return np.where(truth >= FIRST_OBJECT, truth // PER_OBJECT * PER_OBJECT, truth)


def undersegmentation_error(truth: npt.NDArray[np.uint32], labels: LabelArray) -> float:
    """Return how much patches reach over borders, 0 is best; points without a patch count as patches of their own.

    Sum over true segments G and patches S that meet of min(|S ∩ G|, |S - G|), by the number of points (Neubert and
    Protzel, Superpixel benchmark and comparison, 2012).
    """
    patch = labels.astype(np.int64)
    none = patch == 0
    patch[none] = np.max(patch, initial=0) + 1 + np.arange(np.count_nonzero(none))
    pairs, common = np.unique(np.column_stack([patch, truth]), axis=0, return_counts=True)
    size = np.bincount(patch)[pairs[:, 0]]
    return float(np.minimum(common, size - common).sum() / len(truth))


def judged(frame: Frame, labels: LabelArray) -> list[float]:
    """Return number of patches, boundary recall, boundary precision and under-segmentation error."""
    cloud = frame.cloud()
    shape = (cloud.height, cloud.width)
    truth = whole_objects(frame.truth)
    known = np.isfinite(cloud.xyz).all(axis=1) & (truth > 0)
    true, own = (boundary(of.reshape(shape), known.reshape(shape)) for of in (truth, labels))
    recall, precision = share_near(true, own), share_near(own, true)
    count = len(np.unique(labels[labels > 0]))
    error = undersegmentation_error(truth[known], labels[known])
    return [count, recall or 0.0, precision or 0.0, error]


def ours(frame: Frame, params: Params) -> Patches:
    """Return the supervoxels of a frame and the time of all stages."""
    seg = Pipeline(params).run(frame.cloud())
    return seg.labels, sum(seg.ms.values())


def pcl(frame: Frame, voxel: float, spacing: float, folder: Path) -> Patches:
    """Return PCL's supervoxels of all valid points of a frame."""
    cloud = frame.cloud()
    rows = np.flatnonzero(np.isfinite(cloud.xyz).all(axis=1))
    time, found = pcl_peers.supervoxels(cloud, rows, voxel, spacing, 1, folder)
    labels = np.zeros(len(cloud), np.uint32)
    labels[rows] = found
    return labels, time.median


def _mean(chosen: Sequence[Frame], divide: Callable[[Frame], Patches]) -> list[float]:
    found = []
    for frame in chosen:
        labels, ms = divide(frame)
        found.append([*judged(frame, labels), ms])
    return [float(value) for value in np.mean(found, axis=0)]


def _row(name: str, values: Sequence[float]) -> list[str]:
    count, recall, precision, error, ms = values
    return [name, f"{count:,.0f}", f"{recall:.3f}", f"{precision:.3f}", f"{error:.4f}", f"{ms:.0f}"]


def _as_many(chosen: Sequence[Frame], voxel: float, spacing: float, count: float, folder: Path) -> list[float]:
    """Return PCL's figures with seeds so far apart that it has about `count` patches."""
    found: list[float] = []
    for _ in range(ROUNDS):
        found = _mean(chosen, lambda frame, seed=spacing: pcl(frame, voxel, seed, folder))  # type: ignore[misc]
        if abs(found[0] / count - 1.0) < 0.02:
            break
        spacing *= math.sqrt(found[0] / count)
    return found


def measure(setting: Setting, images: Path) -> str:
    """Compare at several spacings; return the tables."""
    chosen = frames()[:: setting.choose(1, 6)]
    Pipeline(PARAMS).run(chosen[0].cloud())
    rows, without_pcl = [], ""
    for spacing in SPACINGS:
        params = PARAMS.replace(seed_spacing=spacing)
        found = _mean(chosen, lambda frame, params=params: ours(frame, params))  # type: ignore[misc]
        rows.append(_row(f"**ours, {1e3 * spacing:.0f} mm**", found))
        try:
            for voxel in PCL_VOXELS:
                theirs = _as_many(chosen, voxel, spacing, found[0], setting.folder)
                rows.append(_row(f"PCL, as many, voxels of {1e3 * voxel:.0f} mm", theirs))
        except pcl_peers.NoPclError as error:
            without_pcl = str(error)
    blocks = [
        f"On {len(chosen)} {source()} 640x480 frames, table and background included; borders are those of whole "
        "objects and of the surroundings; the mean over the frames.",
        table(COLUMNS, rows),
        "Time: ours is the whole pipeline with two threads; PCL's that of its `extract`, one thread.",
    ]
    if without_pcl:
        blocks.append(without_pcl)
    ablation = []
    for name, changes in VARIANTS.items():
        params = PARAMS.replace(seed_spacing=PICTURED).replace(**changes)
        found = _mean(chosen, lambda frame, params=params: ours(frame, params))  # type: ignore[misc]
        ablation.append(_row(name, found))
    blocks += [f"What the criterion does, seeds {1e3 * PICTURED:.0f} mm apart:", table(COLUMNS, ablation)]
    _picture(frames()[min(5, len(frames()) - 1)], images / "supervoxels.png", setting.folder)
    blocks.append("![Camera image, our supervoxels and PCL's](images/supervoxels.png)")
    return "\n\n".join(blocks)


def _picture(frame: Frame, path: Path, folder: Path) -> None:
    """Draw a frame and the patches of both, with their borders."""
    cloud = frame.cloud()
    own, shape = own_colors(cloud), (cloud.height, cloud.width)
    panels = {"camera": own}
    known = np.isfinite(cloud.xyz).all(axis=1).reshape(shape)
    divided = {"ours": ours(frame, PARAMS.replace(seed_spacing=PICTURED))[0]}
    with suppress(pcl_peers.NoPclError):
        divided["PCL, voxels of 8 mm"] = pcl(frame, 0.008, PICTURED, folder)[0]
    for name, labels in divided.items():
        colored = region_colors(own, labels)
        colored[boundary(labels.reshape(shape), known).ravel()] = 20
        panels[f"{name}: {len(np.unique(labels[labels > 0])):,} patches"] = colored
    figure = Figure(figsize=(15, 4.2), dpi=80, facecolor="white")
    for axes, (title, panel) in zip(figure.subplots(1, len(panels)), panels.items(), strict=True):
        axes.imshow(panel.reshape(*shape, 3)[60:420, 80:600])
        axes.set_title(title)
        axes.set_axis_off()
    figure.subplots_adjust(left=0.005, right=0.995, bottom=0.01, top=0.92, wspace=0.02)
    figure.savefig(path)
