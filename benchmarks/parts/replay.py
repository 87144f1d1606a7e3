# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""What `replay` adds to the pipeline's own time: reading, decoding and writing beside the segmentation."""

from __future__ import annotations

import time
from pathlib import Path
from statistics import median

from benchmarks.recordings import RECORDING
from benchmarks.results import Result, Setting, Table
from topo_region_seg.cloud.pointcloud2 import decode
from topo_region_seg.data import Cloud
from topo_region_seg.offline.bags import open_bag
from topo_region_seg.offline.bags.clouds import cloud_topic, decode_message
from topo_region_seg.offline.cli.replay_output import ReplayOutput
from topo_region_seg.offline.cli.replay_run import Replay
from topo_region_seg.params import Params
from topo_region_seg.pipeline import Pipeline, warm_up

TITLE = "9. Replay of recordings"
OVERHEAD = 25.0
SIMULATED = Path(__file__).resolve().parents[2] / "bags" / "tabletop_sim"
WAYS: dict[str, str | None] = {"no output": None, "-o, lz4 (default)": "lz4", "-o, zstd": "zstd"}


def measure(setting: Setting) -> Result:
    """Go through a recording in each way, again and again, so that a busy moment does not fall on one alone."""
    result = Result()
    warm_up()
    bag = RECORDING if RECORDING.is_dir() else SIMULATED
    clouds = _clouds(bag)
    alone: list[float] = []
    walls: dict[str, list[float]] = {}
    over: dict[str, list[float]] = {}
    above: dict[str, list[float]] = {}
    for _ in range(setting.choose(9, 2)):
        alone.append(_alone(clouds))
        for way, compression in WAYS.items():
            out = setting.folder / "out.mcap" if compression else None
            kept = compression or "none"
            walls.setdefault(f"{way}, one after the other", []).append(_in_turn(bag, out, kept))
            wall, own = _replayed(bag, out, kept)
            walls.setdefault(way, []).append(wall)
            over.setdefault(way, []).append(100.0 * (wall - own) / own)
            above.setdefault(way, []).append(100.0 * (wall - alone[-1]) / alone[-1])
    on = f"{bag.name}, {len(clouds)} clouds, {len(alone)} rounds"
    for way in ("no output", "-o, lz4 (default)"):
        goal = f"loop beyond the pipeline's own time at most {OVERHEAD:g} % of it ({way})"
        result.at_most(f"{goal}, pipeline as it runs beside the tool", on, median(over[way]), OVERHEAD, "%")
        result.at_most(f"{goal}, pipeline alone on the machine", on, median(above[way]), OVERHEAD, "%")
    rows = [["pipeline alone, clouds in memory", *_figures(alone)]]
    rows += [[way, *_figures(times)] for way, times in walls.items()]
    result.tables.append(Table("Milliseconds a cloud", ["way", "best", "median"], rows))
    result.data = {"alone_ms": median(alone), "ms": {way: median(times) for way, times in walls.items()}}
    result.notes.append(
        "The pipeline runs slower beside the threads that read and write, as they share two cores with it. The goals "
        "are measured against both of its times."
    )
    return result


def _clouds(bag: Path) -> list[Cloud]:
    with open_bag(bag) as reader:
        topic = cloud_topic(reader)
        return [
            decode(decode_message(record, topic), max_points=Params().max_points)
            for record in reader.messages([topic.name])
        ]


def _alone(clouds: list[Cloud]) -> float:
    pipeline = Pipeline()
    started = time.perf_counter()
    for cloud in clouds:
        pipeline.run(cloud)
    return 1e3 * (time.perf_counter() - started) / len(clouds)


def _replayed(bag: Path, out: Path | None, compression: str) -> tuple[float, float]:
    """Return milliseconds a cloud of the loop as `replay` runs it, and of the pipeline within."""
    with open_bag(bag) as reader:
        topic = cloud_topic(reader)
        with ReplayOutput(out, everything=False, input_topic=None, compression=compression) as output:
            replay = Replay(reader, topic, Params(), output)
            started = time.perf_counter()
            replay.run(lambda text="": None)
            wall = 1e3 * (time.perf_counter() - started)
    n = len(replay.frames)
    return wall / n, sum(frame.ms["total"] - frame.ms["decode"] for frame in replay.frames) / n


def _in_turn(bag: Path, out: Path | None, compression: str) -> float:
    """Return milliseconds a cloud of a loop that reads, segments and writes one after the other."""
    pipeline, n = Pipeline(), 0
    with open_bag(bag) as reader:
        topic = cloud_topic(reader)
        with ReplayOutput(out, everything=False, input_topic=None, compression=compression) as output:
            started = time.perf_counter()
            for record in reader.messages([topic.name]):
                msg = decode_message(record, topic)
                cloud = decode(msg, max_points=pipeline.params.max_points)
                output.write(record, msg, cloud, pipeline.run(cloud))
                n += 1
            return 1e3 * (time.perf_counter() - started) / n


def _figures(times: list[float]) -> list[str]:
    return [f"{min(times):.1f}", f"{median(times):.1f}"]
