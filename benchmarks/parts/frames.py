# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The whole pipeline on 640x480 frames: decode, every stage, encode; beside PCL's steps on the same frames."""

from __future__ import annotations

import time
from statistics import median

import numpy as np

from benchmarks import pcl_peers
from benchmarks.recordings import Frame, frames, source
from benchmarks.results import Result, Setting, Table
from benchmarks.timing import Timing
from topo_region_seg.cloud.messages.answer import Answer
from topo_region_seg.cloud.messages.labeled import labeled_points
from topo_region_seg.cloud.messages.tables import region_count
from topo_region_seg.cloud.pointcloud2 import decode
from topo_region_seg.offline.bags.types import bag_types
from topo_region_seg.offline.evaluation import measure as quality_of
from topo_region_seg.params import Params
from topo_region_seg.pipeline import Pipeline, warm_up

TITLE = "4. Whole pipeline"
MEDIAN_MS, TAIL_MS = 33.0, 50.0
PCL_VOXEL = 0.005
COUNTERPARTS = {"normals": "integral_image_normals", "floor": "ransac_plane", "thinning": "voxel_grid"}
NAMES = {
    "integral_image_normals": "PCL integral-image normals",
    "ransac_plane": "PCL RANSAC plane",
    "voxel_grid": f"PCL voxel grid, {PCL_VOXEL * 1e3:g} mm",
}
QUALITY_LOSS = 0.01


def measure(setting: Setting) -> Result:
    """Go through all frames again and again."""
    result = Result()
    params = Params()
    warm_up()
    rounds = setting.choose(18, 3)
    run_frame(frames()[0], Pipeline(params))
    stages: dict[str, list[float]] = {}
    for _ in range(rounds):
        for frame in frames():
            for stage, ms in run_frame(frame, Pipeline(params)).items():
                stages.setdefault(stage, []).append(ms)
    times = {stage: Timing(tuple(values)) for stage, values in stages.items()}
    total = times["total"]
    on = f"{len(frames())} {source()} 640x480 frames, defaults, {len(total.times_ms)} runs"
    result.at_most(f"median of a frame at most {MEDIAN_MS:g} ms", on, total.median, MEDIAN_MS, "ms")
    result.at_most(f"99th percentile at most {TAIL_MS:g} ms", on, total.quantile(0.99), TAIL_MS, "ms")
    rows = [[s, f"{t.best:.2f}", f"{t.median:.2f}", f"{t.quantile(0.99):.2f}"] for s, t in times.items()]
    result.data["stages"] = {stage: {**t.as_dict(), "p99_ms": t.quantile(0.99)} for stage, t in times.items()}
    _pcl(times, params, on, setting, result, rows)
    result.tables.append(Table("A frame, stage by stage", ["stage", "best (ms)", "median (ms)", "99 % (ms)"], rows))
    _quality(params, setting, result)
    return result


def run_frame(frame: Frame, pipeline: Pipeline) -> dict[str, float]:
    """Answer a message as the node does; return the milliseconds of each stage and in total."""
    types = bag_types()
    started = time.perf_counter()
    cloud = decode(frame.msg, max_points=pipeline.params.max_points)
    decoded = time.perf_counter()
    seg = pipeline.run(cloud)
    segmented = time.perf_counter()
    answer = Answer(frame.msg, cloud, seg)
    labeled_points(types, answer)
    region_count(types, answer)
    encoded = time.perf_counter()
    return {
        "decode": (decoded - started) * 1e3,
        **seg.ms,
        "encode": (encoded - segmented) * 1e3,
        "total": (encoded - started) * 1e3,
    }


def _pcl(
    times: dict[str, Timing], params: Params, on: str, setting: Setting, result: Result, rows: list[list[str]]
) -> None:
    goal = "less than PCL's integral-image normals, RANSAC plane and voxel grid together"
    repeats = setting.choose(9, 2)
    try:
        pcl_peers.program()
    except pcl_peers.NoPclError as error:
        result.missing(goal, on, str(error))
        return
    found = [
        pcl_peers.frame(frame.cloud(), params.floor_distance, PCL_VOXEL, repeats, setting.folder) for frame in frames()
    ]
    together = median(sum(time.median for time in steps.values()) for steps in found)
    result.at_most(f"{goal} ({together:.1f} ms)", on, times["total"].median, together, "ms")
    for stage, step in COUNTERPARTS.items():
        theirs = Timing(tuple(ms for steps in found for ms in steps[step].times_ms))
        rows.append([NAMES[step], f"{theirs.best:.2f}", f"{theirs.median:.2f}", f"{theirs.quantile(0.99):.2f}"])
        result.data[step] = theirs.as_dict()
        goal_of_stage = f"{stage} no slower than {NAMES[step]} ({theirs.median:.1f} ms)"
        if stage in times:
            result.at_most(goal_of_stage, on, times[stage].median, theirs.median, "ms")
        else:
            result.missing(goal_of_stage, on, "no such stage")


def _quality(params: Params, setting: Setting, result: Result) -> None:
    chosen = frames()[:: setting.choose(1, 4)]

    def overlap(pipeline: Pipeline) -> float:
        every = [_weighted_overlap(frame, pipeline) for frame in chosen]
        return sum(every) / len(every)

    ours, unthinned = overlap(Pipeline(params)), overlap(Pipeline(params.replace(voxel_size=0.0)))
    on = f"{len(chosen)} {source()} frames: weighted overlap {ours:.3f}, without thinning {unthinned:.3f}"
    goal = f"defaults within {QUALITY_LOSS} of the overlap without thinning: loss"
    result.at_most(goal, on, unthinned - ours, QUALITY_LOSS, "", 3)
    result.data["weighted_overlap"] = {"defaults": ours, "not thinned": unthinned}


def _weighted_overlap(frame: Frame, pipeline: Pipeline) -> float:
    cloud = frame.cloud()
    valid = np.isfinite(cloud.xyz).all(axis=1)
    overlap = quality_of(frame.truth, pipeline.run(cloud).labels, valid)["wov"]
    return float("nan") if overlap is None else overlap
