# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""``replay``: every cloud of a recording through the pipeline, without dropping any."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from topo_region_seg.offline.cli import status
from topo_region_seg.offline.cli.parameters import add_parameter_arguments, params_from
from topo_region_seg.offline.cli.status import ToolError

if TYPE_CHECKING:
    from topo_region_seg.offline.cli.replay_run import Replay
    from topo_region_seg.offline.runs.record import RunRecord
    from topo_region_seg.params import Params


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the command's arguments."""
    parser.add_argument("bag", metavar="BAG", type=Path, help="a rosbag2 folder, a .mcap file or a ROS 1 .bag file")
    parser.add_argument(
        "-o",
        "--output",
        metavar="OUT",
        type=Path,
        help="write /labeled_points and /region_count to OUT.mcap (one file) or OUT (a rosbag2 folder)",
    )
    parser.add_argument("--topic", help="topic of the clouds, if the recording has several")
    parser.add_argument(
        "--also",
        metavar="TOPIC,...",
        action="append",
        default=[],
        help="also write these of the node's topics, such as detections,surfaces; may be repeated",
    )
    parser.add_argument("--all", action="store_true", help="also write all other topics of the node")
    parser.add_argument("--with-input", action="store_true", help="also write the recorded clouds")
    parser.add_argument(
        "--compression",
        choices=("lz4", "zstd", "none"),
        default="lz4",
        help="compression of the output (default: lz4; zstd takes a third less space and more time)",
    )
    parser.add_argument("--json", metavar="FILE", type=Path, help="write the summary as JSON")
    add_parameter_arguments(parser)


def run(args: argparse.Namespace) -> int:
    """Replay the recording, print a summary and write what was asked for."""
    from topo_region_seg.offline.bags import open_bag
    from topo_region_seg.offline.bags.clouds import cloud_topic
    from topo_region_seg.offline.bags.images import ImageTopic
    from topo_region_seg.offline.cli.console import check_writable, loading_kernels, note, output, progress, write_whole
    from topo_region_seg.offline.cli.replay_output import ReplayOutput, asked_for, input_topic
    from topo_region_seg.offline.cli.replay_run import Replay
    from topo_region_seg.offline.cli.tables import timing_table
    from topo_region_seg.pipeline import warm_up

    params = params_from(args)
    also = asked_for(args.also, args.all)
    if args.bag.suffix in (".pcd", ".ply"):
        raise ToolError(f"{args.bag}: is a cloud file, not a recording; use: topo_region_seg segment {args.bag}")
    if args.json:
        check_writable(args.json)
    with open_bag(args.bag) as reader:
        topic = cloud_topic(reader, args.topic)
        _check_apart(args.bag, args.output)
        if isinstance(topic, ImageTopic):
            note(f"{topic.name}: {topic}")
        extra = input_topic(topic) if args.with_input else None
        with ReplayOutput(args.output, also=also, input_topic=extra, compression=args.compression) as results:
            with loading_kernels():
                warm_up()
            replay = Replay(reader, topic, params, results, debug=args.debug)
            with progress("segmenting", topic.count) as step:
                replay.run(step)
            results.describe(_record(args, replay, params))
        if args.json:
            write_whole(args.json, replay.json_text())
        if replay.frames:
            output().print(timing_table(replay.frames))
        _print_summary(args, replay)
    if replay.interrupted:
        return status.INTERRUPTED
    if replay.rejected or reader.problems:
        return status.FAILED
    return status.TRUNCATED if reader.truncated else status.DONE


def _record(args: argparse.Namespace, replay: Replay, params: Params) -> RunRecord:
    """Return the record that is attached to the output."""
    from topo_region_seg.offline.runs.record import RunRecord

    return RunRecord(
        source=str(args.bag.resolve()),
        topic=replay.topic.name,
        frames=list(replay.frames),
        rejected=list(replay.rejected),
        truncated=replay.reader.truncated,
        interrupted=replay.interrupted,
        problems=list(replay.reader.problems),
        params=params.as_dict(),
        sensor=replay.sensor,
    )


def _check_apart(bag: Path, output: Path | None) -> None:
    """Refuse to write into the recording that is being read."""
    if output is None:
        return
    source, target = bag.resolve(), output.resolve()
    if target == source or source in target.parents:
        raise ToolError(f"{output}: is the recording that is read, or inside it; choose another name")


def _print_summary(args: argparse.Namespace, replay: Replay) -> None:
    from topo_region_seg.offline.cli.console import note

    print(f"{args.bag} {replay.topic.name}: {replay.summary_line()}", flush=True)
    for line in replay.rejected_lines():
        note(line)
    for problem in replay.reader.problems:
        note(f"damaged: {problem}")
    if replay.reader.truncated:
        note(f"truncated: {args.bag} is cut short; all complete messages were processed")
    if replay.interrupted:
        note("interrupted: the results so far are kept")
    for written in (args.output, args.json):
        if written:
            print(f"wrote {written}")
