# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Labels over frames, tracked and not: how many points change theirs, and how often an object gets another one."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path
from statistics import median
from typing import Any, NamedTuple
from unittest.mock import patch

import numpy as np
import numpy.typing as npt
from matplotlib.figure import Figure

from benchmarks.beyond.moving_things import STREAMS, seen_by
from benchmarks.recordings import CLOUDS, RECORDING
from benchmarks.report import table
from benchmarks.results import Setting
from topo_region_seg.beyond.tracking import holding, matching, tracker
from topo_region_seg.beyond.tracking.tracks import Tracks
from topo_region_seg.cloud.placing import Transform
from topo_region_seg.cloud.pointcloud2 import decode
from topo_region_seg.data import Cloud, LabelArray
from topo_region_seg.offline.bags import open_bag
from topo_region_seg.offline.bags.clouds import decode_message
from topo_region_seg.offline.demo.recordings import RECORDINGS
from topo_region_seg.offline.evaluation.identity import IdentityMeter
from topo_region_seg.offline.evaluation.measures import AS_LABELED
from topo_region_seg.offline.figures.shading import own_colors, region_colors
from topo_region_seg.offline.simulation import Camera, PartNumbers, simulate, tabletop
from topo_region_seg.offline.simulation.camera import orbit
from topo_region_seg.params import Params
from topo_region_seg.pipeline import Pipeline

TITLE = "Labels over frames"
DOCUMENT = "tracking.md"
LAPTOP = RECORDING.parent / "laptop_stream"
RATE = 30.0
SCENES = 4
STATIC_FRAMES, ORBIT_FRAMES = 30, 60
SWEEP = math.radians(40.0)
SAME = 0.5
"""Intersection over union from which two regions of consecutive frames are taken for the same thing."""
OUTPUTS = ("regions", "objects")
PICTURES = 4


class Variant(NamedTuple):
    """A way to track: whether regions are held apart too, the camera's motion known, and what is replaced."""

    hold: bool = False
    posed: bool = False
    replaced: tuple[tuple[object, str, Any], ...] = ()


TRACKED, HELD = "tracked", "held apart too"
FAR = 1e9
WITHOUT = {
    "without overlap": Variant(replaced=((matching, "LEAST_OVERLAP", FAR),)),
    "without motion": Variant(replaced=((Tracks, "expected_centers", lambda tracks: tracks.center),)),
    "without color": Variant(replaced=((matching, "COLOR_REACH", FAR),)),
    "without memory": Variant(replaced=((tracker, "MEMORY", 0),)),
}
"""What a tracker is denied to see what it brings."""
HELD_WITHOUT = {
    "held apart too, but borders move": Variant(True, replaced=((holding, "WAIT", 0),)),
    "only borders are held": Variant(True, replaced=((holding, "HOLD", 0),)),
}


POSED = {"tracked, motion known": Variant(posed=True), "held apart too, motion known": Variant(True, posed=True)}
"""With a camera whose motion is known, as from TF."""


@dataclass(frozen=True)
class Step:
    """A frame of a stream: cloud, labels untracked and tracked, truth if any, and the milliseconds of tracking."""

    cloud: Cloud
    plain: LabelArray
    tracked: LabelArray
    truth: npt.NDArray[np.uint32] | None
    ms: float


def follow(
    stream: Iterable[tuple[Cloud, npt.NDArray[np.uint32] | None]],
    params: Params,
    variants: Mapping[str, Variant] | None = None,
) -> dict[str, list[Step]]:
    """Segment a stream once; track it in each of the ways, and anyhow with and without holding regions apart."""
    ways = {TRACKED: Variant(), HELD: Variant(hold=True), **(variants or {})}
    made = {name: tracker.Tracker() for name in ways}
    pipeline = Pipeline(params.replace(track_regions=True))
    held = pipeline.params.replace(hold_regions=True)
    steps: dict[str, list[Step]] = {name: [] for name in made}
    for number, (cloud, truth) in enumerate(stream):
        blind = replace(cloud, base_pose=None)
        seg = pipeline.run(blind)
        for name, way in ways.items():
            with ExitStack() as stack:
                for owner, attribute, value in way.replaced:
                    stack.enter_context(patch.object(owner, attribute, value))
                given = replace(seg, params=held) if way.hold else seg
                tracked = made[name].follow(cloud if way.posed else blind, given, number / RATE)
            steps[name].append(Step(cloud, seg.labels, tracked.labels, truth, tracked.ms["tracking"]))
    return steps


def simulated(scene: int, cameras: Sequence[Camera]) -> Iterator[tuple[Cloud, npt.NDArray[np.uint32]]]:
    """Yield what the cameras see of a tabletop one after the other, each with noise of its own."""
    numbers = PartNumbers()
    for number, camera in enumerate(cameras):
        frame = simulate(tabletop(scene), camera, 1_000 * scene + number, numbers=numbers)
        # The world in the camera's frame.
        turn = camera.rotation.T
        yield replace(frame.cloud, base_pose=Transform(turn, -turn @ np.array(camera.eye)).pose), frame.labels


def recorded(folder: Path) -> Iterator[tuple[Cloud, None]]:
    """Yield the clouds of a recording."""
    with open_bag(folder) as reader:
        topics = {topic.name: topic for topic in reader.topics}
        for record in reader.messages([CLOUDS]):
            yield decode(decode_message(record, topics[CLOUDS]), max_points=1_000_000), None


def streams_apart() -> dict[str, Iterable[tuple[Cloud, npt.NDArray[np.uint32] | None]]]:
    """Return streams whose frames are far apart, by name: that of the demo, and a recorded one where it is there."""
    (made,) = (demo for demo in RECORDINGS if demo.name == "tabletop")
    streams: dict[str, Iterable[tuple[Cloud, npt.NDArray[np.uint32] | None]]] = {"sequence of the demo": made.frames()}
    if LAPTOP.is_dir():
        streams["hand-held camera, 0.26 s apart (laptop_stream)"] = recorded(LAPTOP)
    return streams


def changed(labels: Sequence[LabelArray]) -> float:
    """Return the share of the points with a label in both of two consecutive frames that change it."""
    shares = []
    for before, after in pairwise(labels):
        both = (before > 0) & (after > 0)
        shares.append(np.mean(before[both] != after[both]))
    return float(np.mean(shares))


def switches(steps: Sequence[Step], labels: Sequence[LabelArray]) -> tuple[int, int]:
    """Count the label switches of true segments, and the hits of segments by a region, as docs/evaluation.md has it."""
    meter = IdentityMeter(AS_LABELED)
    for step, found in zip(steps, labels, strict=True):
        assert step.truth is not None
        meter.add(step.truth, found, np.ones(len(found), np.bool_), step.cloud.height, step.cloud.width)
    identity = meter.identity()
    return identity.switches, identity.hits


def mismatches(steps: Sequence[Step], labels: Sequence[LabelArray]) -> tuple[int, int]:
    """Count pairs of regions of consecutive frames that lie on one another but differ in label, and all such pairs."""
    count = seen = 0
    for first, second, before, after in zip(steps[:-1], steps[1:], labels[:-1], labels[1:], strict=True):
        both = (first.plain > 0) & (second.plain > 0)
        pairs, places, common = np.unique(
            np.column_stack([first.plain[both], second.plain[both]]), axis=0, return_index=True, return_counts=True
        )
        rows = np.flatnonzero(both)[places]
        union = np.bincount(first.plain)[pairs[:, 0]] + np.bincount(second.plain)[pairs[:, 1]] - common
        same = common >= SAME * union
        count += int(np.count_nonzero(before[rows[same]] != after[rows[same]]))
        seen += int(np.count_nonzero(same))
    return count, seen


def measure(setting: Setting, images: Path) -> str:
    """Measure all streams; return the tables."""
    scenes = range(setting.choose(SCENES, 1))
    still, moving = setting.choose(STATIC_FRAMES, 5), setting.choose(ORBIT_FRAMES, 5)
    static_rows, moving_rows, apart_rows = [], [], []
    times: dict[str, list[float]] = {TRACKED: [], HELD: []}
    shown: list[Step] = []
    ablation: dict[str, list[tuple[float, int]]] = {}
    for output in OUTPUTS:
        params = Params(output=output)
        others = {**WITHOUT, **HELD_WITHOUT} if output == OUTPUTS[0] else {}
        for scene in scenes:
            rest = follow(simulated(scene, [Camera.kinect()] * still), params, others)
            shares = [changed(labels) for labels in _shown(rest)]
            static_rows.append([f"{output}, scene {scene}", *(f"{100.0 * share:.2f}" for share in shares)])
            for name in times:
                times[name] += [step.ms for step in rest[name]]
            still_shares = {name: changed([s.tracked for s in steps]) for name, steps in rest.items()}
            del rest  # some hundred frames with many labels each fill the memory
            cameras = orbit(Camera.kinect(), moving, SWEEP * moving / ORBIT_FRAMES)
            round_it = follow(simulated(scene, cameras), params, {**POSED, **others})
            every = [*_shown(round_it), *([s.tracked for s in round_it[name]] for name in POSED)]
            counts = [switches(round_it[TRACKED], labels) for labels in every]
            moving_rows.append([f"{output}, scene {scene}", str(counts[0][1]), *(str(count) for count, _ in counts)])
            if output == OUTPUTS[0]:
                for name, steps in round_it.items():
                    if name in POSED:
                        continue
                    count = switches(steps, [s.tracked for s in steps])[0]
                    ablation.setdefault(name, []).append((still_shares[name], count))
                if scene == 0:
                    shown = [round_it[TRACKED][i] for i in np.linspace(0, moving - 1, PICTURES).astype(int)]
            del round_it
        for name, stream in streams_apart().items():
            short = follow(stream, params)
            pairs = [mismatches(short[TRACKED], labels) for labels in _shown(short)]
            apart_rows.append([f"{name}: {output}", str(pairs[0][1]), *(str(count) for count, _ in pairs)])
    blocks = [
        "`tracked` is with `track_regions`, `held apart too` with `hold_regions` as well.",
        f"Simulated tabletop, camera at rest, Kinect noise, {still} frames each: points that do not have the label "
        "of the frame before, percent (points with a label in both frames).",
        table(["", "untracked", TRACKED, HELD], static_rows),
        f"Camera moving around the tabletop, {moving} frames, {math.degrees(SWEEP) * moving / ORBIT_FRAMES:.0f} "
        "degrees: label switches, as `topo_region_seg evaluate` counts them, of the hits of true segments.",
        table(["", "hits", "untracked", TRACKED, HELD, *POSED], moving_rows),
        "What each part brings there: regions, the mean over the scenes at rest and the sum over those that the camera "
        "moves around.",
        table(
            ["", "points changing their label, percent", "switches"],
            [
                [name, f"{100.0 * np.mean([share for share, _ in found]):.2f}", str(sum(count for _, count in found))]
                for name, found in ablation.items()
            ],
        ),
        "What each part brings where overlap alone is not enough: how often the labels of objects switch.",
        _moving_things(),
        "Short streams with frames far apart: regions of consecutive frames that overlap in the image "
        f"(intersection over union from {SAME}) but have different labels.",
        table(["", "pairs", "untracked", TRACKED, HELD], apart_rows),
    ]
    blocks.append(
        f"Time: tracking a 640x480 frame takes {median(times[TRACKED]):.1f} ms in the median, "
        f"{median(times[HELD]):.1f} ms with regions held apart."
    )
    _picture(shown, images / "tracking.png")
    blocks.append("![Four frames of the moving camera, untracked and tracked](images/tracking.png)")
    return "\n\n".join(blocks)


def _shown(steps: Mapping[str, Sequence[Step]]) -> list[list[LabelArray]]:
    """Return the labels untracked, tracked, and held apart too."""
    return [[s.plain for s in steps[TRACKED]], *([s.tracked for s in steps[name]] for name in (TRACKED, HELD))]


def _moving_things() -> str:
    rows = []
    for name, moments in STREAMS.items():
        steps = follow(seen_by(Camera.kinect(320, 240), moments()), Params(output="objects"), WITHOUT)
        count, seen = switches(steps[TRACKED], [s.plain for s in steps[TRACKED]])
        ways = [TRACKED, *WITHOUT]
        counts = [switches(steps[way], [s.tracked for s in steps[way]])[0] for way in ways]
        rows.append([name, str(seen), str(count), *map(str, counts)])
    return table(["", "hits", "untracked", TRACKED, *WITHOUT], rows)


def _picture(steps: Sequence[Step], path: Path) -> None:
    """Draw frames with both kinds of labels."""
    figure = Figure(figsize=(14, 5.4), dpi=80, facecolor="white")
    axes = figure.subplots(2, len(steps))
    for column, step in enumerate(steps):
        for row, (name, labels) in enumerate((("untracked", step.plain), ("tracked", step.tracked))):
            panel = region_colors(own_colors(step.cloud), labels)
            axes[row, column].imshow(panel.reshape(step.cloud.height, step.cloud.width, 3)[::2, ::2])
            axes[row, column].set_title(name if column == 0 else "", loc="left")
            axes[row, column].set_axis_off()
    figure.subplots_adjust(left=0.005, right=0.995, bottom=0.01, top=0.95, wspace=0.02, hspace=0.06)
    figure.savefig(path)
