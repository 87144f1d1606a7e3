# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""``inspect``: the contents of a recording, the properties of its clouds, and the parameters that follow."""

from __future__ import annotations

import argparse
from pathlib import Path

from topo_region_seg.offline.cli import status
from topo_region_seg.offline.cli.status import ToolError

SAMPLES = 5


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the command's arguments."""
    parser.add_argument("bag", metavar="BAG", type=Path, help="a rosbag2 folder, a .mcap file or a ROS 1 .bag file")
    parser.add_argument("--topic", help="inspect the clouds of this topic only")
    parser.add_argument(
        "--frames",
        metavar="N",
        type=_count,
        default=SAMPLES,
        help=f"clouds of each topic to measure, spread over the recording (default: {SAMPLES})",
    )
    parser.add_argument("--json", metavar="FILE", type=Path, help="write all findings as JSON")
    parser.add_argument(
        "--params-out",
        metavar="FILE.yaml",
        type=Path,
        help="write the suggested parameters as a YAML file",
    )


def run(args: argparse.Namespace) -> int:
    """Read the recording, print what was found, and write what was asked for."""
    from topo_region_seg.offline.bags import open_bag
    from topo_region_seg.offline.bags.clouds import cloud_topic, cloud_topics
    from topo_region_seg.offline.cli import inspect_text
    from topo_region_seg.offline.cli.console import check_writable, loading_kernels, note, output, progress, write_whole
    from topo_region_seg.offline.inspection.topic import TopicInspector

    for path, suffixes in ((args.json, ()), (args.params_out, (".yaml", ".yml"))):
        if path:
            check_writable(path, suffixes)
    with open_bag(args.bag) as reader:
        # Which topic the parameters are for has to be known before the work.
        wanted = cloud_topic(reader, args.topic) if args.topic or args.params_out else None
        topics = [wanted] if wanted else cloud_topics(reader)
        reports = []
        with loading_kernels(), progress("inspecting", None) as step:
            for topic in topics:
                reports.append(TopicInspector(topic, args.frames).look(reader))
                step(topic.name)
        problems = list(dict.fromkeys(reader.problems))
        for part in inspect_text.whole(args.bag, reader, reports):
            output().print(part, soft_wrap=isinstance(part, str), markup=False)
        if args.json:
            write_whole(args.json, inspect_text.json_text(args.bag, reader, reports, problems))
        if wanted and args.params_out:
            advice = reports[0].advice
            if advice is None:
                raise ToolError(f"{args.bag}: the clouds of {wanted.name} have too few points to suggest parameters")
            write_whole(args.params_out, inspect_text.yaml_text(args.bag, reports[0], advice))
        for written in (args.json, args.params_out):
            if written:
                print(f"wrote {written}")
        for problem in problems:
            note(f"damaged: {problem}")
        if reader.truncated:
            note(f"truncated: {args.bag} is cut short; complete messages are counted")
        if problems or any(report.unreadable for report in reports):
            return status.FAILED
        return status.TRUNCATED if reader.truncated else status.DONE


def _count(text: str) -> int:
    value = int(text)
    if value < 1:
        raise argparse.ArgumentTypeError(f"{text} is not at least 1")
    return value
