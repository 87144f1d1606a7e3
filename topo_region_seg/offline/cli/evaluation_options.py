# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Arguments that `evaluate` and `sweep` share: recordings, their truth, and where the work is done."""

from __future__ import annotations

import argparse
import os
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from topo_region_seg.offline.cli import status
from topo_region_seg.offline.cli.status import ToolError

if TYPE_CHECKING:
    from topo_region_seg.offline.evaluation.jobs import Runner
    from topo_region_seg.offline.evaluation.measures import TruthReading
    from topo_region_seg.offline.evaluation.results import BagResult
    from topo_region_seg.offline.evaluation.source import Source


def add_source_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the recordings and the source of their truth."""
    parser.add_argument(
        "bags",
        metavar="BAG",
        nargs="+",
        type=Path,
        help="rosbag2 folders, .mcap or ROS 1 .bag files, or folders that contain such recordings",
    )
    parser.add_argument("--topic", help="topic of the clouds, if the recordings have several")
    parser.add_argument(
        "--truth-topic",
        metavar="TOPIC",
        help="topic of clouds with the same stamps and a field 'label': true labels, those of objects from 20 up "
        "(default: /ground_truth/labels, or else the field 'label' of the clouds themselves)",
    )
    parser.add_argument("--truth-bag", metavar="BAG", type=Path, help="take the truth from another recording")
    add_reading_arguments(parser)
    parser.add_argument(
        "--recorded-labels",
        action="store_true",
        help="measure the recorded labels (/labeled_points) instead of segmenting the clouds",
    )


def add_reading_arguments(parser: argparse.ArgumentParser) -> None:
    """Add what true labels mean."""
    parser.add_argument(
        "--whole-objects",
        action="store_true",
        help="true labels from 20 on with the same tens are parts of one object, which counts as a whole",
    )
    parser.add_argument(
        "--partial-truth",
        action="store_true",
        help="only some of the objects have truth: leave out what counts regions without a true object as wrong",
    )


def reading_from(args: argparse.Namespace) -> TruthReading:
    """Return what the command line says about true labels."""
    from topo_region_seg.offline.evaluation.measures import TruthReading

    return TruthReading(args.whole_objects, args.partial_truth)


def add_cluster_arguments(parser: argparse.ArgumentParser) -> None:
    """Add where the work is done."""
    group = parser.add_argument_group("several processes or machines (needs Dask: pip install '.[dask]')")
    who = group.add_mutually_exclusive_group()
    who.add_argument("--workers", metavar="N", type=_count, help="use N processes on this machine; each uses two cores")
    who.add_argument(
        "--scheduler",
        metavar="ADDRESS",
        help="use a running Dask cluster, such as tcp://host:8786, whose workers find the files at the same paths",
    )


def sources_from(args: argparse.Namespace) -> list[Source]:
    """Return the recordings that the command line names, including those in folders."""
    from topo_region_seg.offline.evaluation.finding import find_bags
    from topo_region_seg.offline.evaluation.source import Source

    truth_bag = None
    if args.truth_bag is not None:
        if not args.truth_bag.exists():
            raise ToolError(f"--truth-bag {args.truth_bag}: no such file or folder; check the name")
        truth_bag = os.path.abspath(args.truth_bag)
    return [
        Source(
            str(bag),
            os.path.abspath(bag),
            args.topic,
            args.truth_topic,
            truth_bag,
            args.recorded_labels,
            reading_from(args),
        )
        for bag in find_bags(args.bags)
    ]


@contextmanager
def runner_from(args: argparse.Namespace) -> Iterator[Runner]:
    """Provide the runner; without --workers and --scheduler it is this process, and Dask is not needed."""
    from topo_region_seg.offline.cli.console import loading_kernels
    from topo_region_seg.offline.evaluation.cluster import ClusterError, dask_runner
    from topo_region_seg.offline.evaluation.jobs import in_this_process
    from topo_region_seg.offline.evaluation.run import load_kernels

    if not args.recorded_labels and args.scheduler is None:
        with loading_kernels():
            load_kernels()
    if args.workers is None and args.scheduler is None:
        yield in_this_process
        return
    try:
        with dask_runner(args.workers, args.scheduler) as runner:
            yield runner
    except ClusterError as error:
        raise ToolError(str(error)) from None


def note_troubles(result: BagResult, most: int = 10) -> None:
    """Print what could not be measured in a recording, and why."""
    from topo_region_seg.offline.cli.console import note

    if result.error:
        note(f"failed: {result.error}")
    for rejection in result.rejected[:most]:
        note(f"rejected: {result.bag}: {rejection.stamp:.9f} s: {rejection.detail} ({rejection.reason})")
    if len(result.rejected) > most:
        note(f"rejected: {result.bag}: {len(result.rejected) - most} more")
    for problem in result.problems:
        note(f"damaged: {problem}")
    if result.truncated:
        note(f"truncated: {result.bag} is cut short; all complete messages were processed")
    if result.without_truth and result.frames:
        clouds = result.without_truth + len(result.frames)
        note(f"without truth: {result.bag}: {result.without_truth} of {clouds} clouds, which are not measured")
    if result.repeated:
        note(
            f"repeated stamps: {result.bag}: {result.repeated} clouds have the stamp of another cloud; "
            "they are paired with their truth in the recorded order"
        )


def note_notices(results: Iterable[BagResult]) -> None:
    """Print the notices of the pipeline, each once."""
    from topo_region_seg.offline.cli.console import note

    lines = (f"note: {text} ({code})" for result in results for code, text in result.notices.items())
    for line in dict.fromkeys(lines):
        note(line)


def status_of(results: list[BagResult]) -> int:
    """Return the exit status."""
    if any(result.failed for result in results):
        return status.FAILED
    return status.TRUNCATED if any(result.truncated for result in results) else status.DONE


def _count(text: str) -> int:
    try:
        number = int(text)
    except ValueError:
        number = 0
    if not 1 <= number <= 1024:
        raise argparse.ArgumentTypeError(f"{text} is not a number from 1 to 1024")
    return number
