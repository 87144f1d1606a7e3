# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The scale by itself, beside fixed radii: on recorded frames, and on a scene that moves away."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from statistics import median

import numpy as np
from matplotlib.figure import Figure

from benchmarks.beyond.moved import REFERENCE, View, agreement, regions_on_objects, seen_from
from benchmarks.beyond.quality import weighted_overlap
from benchmarks.recordings import FIRST_OBJECT, Frame, frames, source
from benchmarks.report import table
from benchmarks.results import Setting
from topo_region_seg import pipeline as pipeline_module
from topo_region_seg.beyond.auto_scale.local_units import LocalUnits
from topo_region_seg.data import LabelArray
from topo_region_seg.offline.figures.shading import own_colors, region_colors
from topo_region_seg.offline.simulation.frame import SimulatedFrame
from topo_region_seg.params import Params
from topo_region_seg.pipeline import Pipeline, warm_up

TITLE = "The right scale by itself"
DOCUMENT = "auto_radius.md"
RADII = (0.006, 0.008, 0.01, 0.012, 0.015, 0.02, 0.025, 0.03, 0.04)
DISTANCES = (0.7, 1.0, 1.5, 2.0, 2.5)
SCENES = 4
LONG = 0.03
"""The fixed radius that suits the recorded frames best, metres."""
AUTO = Params()
FIXED = Params(max_radius=0.02)
NOISES = {"exact": False, "with a Kinect's noise": True}


@contextmanager
def without(part: str) -> Iterator[None]:
    """Take a part of auto away for a while: `growth` of lengths, `noise`, or the `choice` from the barcode."""
    owner, name, stand_in = {
        "": (LocalUnits, "noise_radius", LocalUnits.noise_radius),
        "noise": (LocalUnits, "noise_radius", lambda units, xyz, params: np.zeros(len(xyz))),
        "growth": (LocalUnits, "growth", lambda units, xyz: np.ones(len(xyz))),
        "choice": (pipeline_module, "stable_scale", lambda components, weight, fewest: LONG),
    }[part]
    kept = getattr(owner, name)
    setattr(owner, name, stand_in)
    try:
        yield
    finally:
        setattr(owner, name, kept)


def objects_found(frame: SimulatedFrame, labels: LabelArray) -> float:
    """Return the share of true segments that a region of their own covers: intersection over union from 0.5."""
    found = []
    for segment in np.unique(frame.labels[frame.labels >= FIRST_OBJECT]).tolist():
        inside = frame.labels == segment
        values, common = np.unique(labels[inside & (labels > 0)], return_counts=True)
        sizes = [np.count_nonzero(inside | (labels == value)) for value in values]
        found.append(len(values) > 0 and float(np.max(common / np.array(sizes))) >= 0.5)
    return float(np.mean(found))


def measure(setting: Setting, images: Path) -> str:
    """Sweep fixed radii, then move a scene away; return the tables."""
    chosen = frames()[:: setting.choose(1, 6)]
    warm_up()
    fixed, auto, radii, times = [], [], [], []
    for frame in chosen:
        cloud = frame.cloud()
        swept = Pipeline(Params(max_radius=max(RADII))).run(cloud)
        fixed.append([weighted_overlap(frame.truth, swept.cut(r).labels, cloud) for r in RADII])
        for _ in range(setting.choose(3, 1)):
            seg = Pipeline(AUTO).run(cloud)
            plain = Pipeline(FIXED).run(cloud)
            times.append((sum(seg.ms.values()), sum(plain.ms.values())))
        auto.append(weighted_overlap(frame.truth, seg.labels, cloud))
        radii.append(1e3 * seg.scale)
    means = np.mean(fixed, axis=0)
    best = int(np.argmax(means))
    rows = [[f"{1e3 * r:g} mm", f"{value:.3f}"] for r, value in zip(RADII, means, strict=True)]
    rows.append(["**auto**", f"{np.mean(auto):.3f}"])
    rows.append(["the best fixed one of each frame", f"{np.mean(np.max(fixed, axis=1)):.3f}"])
    auto_ms, plain_ms = (median(ms) for ms in zip(*times, strict=True))
    blocks = [
        f"On {len(chosen)} {source()} 640x480 frames, mean over the frames; everything else at its default.",
        table(["`max_radius`", "WOv"], rows),
        f"Auto against the best fixed radius, {1e3 * RADII[best]:g} mm: {np.mean(auto) - means[best]:+.3f}. It chose "
        f"{min(radii):.1f} to {max(radii):.1f} mm. A frame takes {auto_ms:.0f} ms (median, without decoding and "
        f"encoding), with a radius of {1e3 * float(FIXED.max_radius):g} mm {plain_ms:.0f} ms.",
    ]
    distances, scenes = setting.choose(DISTANCES, DISTANCES[1::3]), range(setting.choose(SCENES, 1))
    ways = {"auto": AUTO} | {f"{1e3 * r:g} mm": Params(max_radius=r) for r in (float(FIXED.max_radius), LONG)}
    for name, noisy in NOISES.items():
        seen = {(scene, distance): seen_from(scene, distance, noisy) for scene in scenes for distance in distances}
        found = [_moved(seen, params) for params in ways.values()]
        rows = [
            [f"{d:g} m", *(cell for figures in zip(*(f[d] for f in found), strict=True) for cell in figures)]
            for d in distances
        ]
        measures = ("agreement", "regions", "WOv", "found")
        blocks += [
            f"Simulated tabletops ({len(scenes)}) from farther and farther away, {name}:",
            table(["", *(f"{measure}, {way}" for measure in measures for way in ways)], rows),
        ]
    blocks += ["What each part of auto brings:", _ablation(chosen, distances, scenes)]
    _picture(distances, images / "auto_radius.png")
    blocks.append("![A scene at growing distance, with a fixed radius and with auto](images/auto_radius.png)")
    return "\n\n".join(blocks)


def _moved(seen: dict[tuple[int, float], View], params: Params) -> dict[float, list[str]]:
    """Return agreement with REFERENCE, regions on objects, WOv and segments found at each distance."""
    labels = {key: Pipeline(params).run(view.frame.cloud).labels for key, view in seen.items()}
    figures: dict[float, list[list[float]]] = {}
    for (scene, distance), view in seen.items():
        frame, own, there = view.frame, labels[scene, distance], (scene, REFERENCE)
        alike = 1.0 if distance == REFERENCE else agreement(view, own, seen[there], labels[there])
        wov = weighted_overlap(frame.labels, own, frame.cloud)
        row = [alike, regions_on_objects(frame, own), wov, objects_found(frame, own)]
        figures.setdefault(distance, []).append(row)
    shown = {}
    for distance, values in figures.items():
        alike, regions, wov, found = np.mean(values, axis=0).tolist()
        shown[distance] = [
            "" if distance == REFERENCE else f"{alike:.3f}",
            f"{regions:.0f}",
            f"{wov:.3f}",
            f"{found:.3f}",
        ]
    return shown


def _ablation(chosen: Sequence[Frame], distances: Sequence[float], scenes: range) -> str:
    """Return the table of what auto reaches without each of its parts."""
    rows = []
    seen = [
        {(scene, distance): seen_from(scene, distance, noisy) for scene in scenes for distance in distances}
        for noisy in NOISES.values()
    ]
    for part, name in (
        ("", "auto"),
        ("growth", "lengths in plain metres, but for noise"),
        ("noise", "normals that do not grow with noise"),
        ("choice", f"no choice from the barcode, {1e3 * LONG:g} mm"),
    ):
        with without(part):
            clouds = [(frame.truth, frame.cloud()) for frame in chosen]
            recorded = [weighted_overlap(truth, Pipeline(AUTO).run(cloud).labels, cloud) for truth, cloud in clouds]
            found = [_moved(frames_seen, AUTO).items() for frames_seen in seen]
        cells = [
            f"{np.mean([float(figures[column]) for d, figures in one if d != REFERENCE]):.3f}"
            for column in (0, 2)
            for one in found
        ]
        rows.append([name, f"{np.mean(recorded):.3f}", *cells])
    heads = [f"{measure}, {name}" for measure in ("agreement", "WOv") for name in NOISES]
    return table(["", f"WOv, {source()}", *heads], rows)


def _picture(distances: Sequence[float], path: Path) -> None:
    """Draw a scene at some distances with a fixed radius above and with auto below."""
    figure = Figure(figsize=(3.2 * len(distances), 5.2), dpi=80, facecolor="white")
    axes = figure.subplots(2, len(distances), squeeze=False)
    for column, distance in enumerate(distances):
        frame = seen_from(1, distance, noisy=True).frame
        cloud, width, height = frame.cloud, frame.cloud.width, frame.cloud.height
        half = min(int(0.5 * width * 0.7 / distance), width // 2)
        rows = slice(max(height // 2 - half * 3 // 4, 0), height // 2 + half * 3 // 4)
        columns = slice(width // 2 - half, width // 2 + half)
        for row, (name, params) in enumerate((("fixed", FIXED), ("auto", AUTO))):
            panel = region_colors(own_colors(cloud), Pipeline(params).run(cloud).labels)
            axes[row, column].imshow(panel.reshape(height, width, 3)[rows, columns])
            axes[row, column].set_title(f"{name}, {distance:g} m")
            axes[row, column].set_axis_off()
    figure.subplots_adjust(left=0.005, right=0.995, bottom=0.01, top=0.94, wspace=0.02, hspace=0.1)
    figure.savefig(path)
