# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""``segment``: one cloud file."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from topo_region_seg.offline.cli import status
from topo_region_seg.offline.cli.parameters import add_parameter_arguments, params_from
from topo_region_seg.offline.cli.status import ToolError
from topo_region_seg.params import THINNABLE, Params

if TYPE_CHECKING:
    from topo_region_seg.data import Cloud
    from topo_region_seg.segmentation import Segmentation

SHOWN = 40
"""Regions that are printed unless all are asked for: the largest."""
LARGE = 1_000_000
"""Clouds with at least so many points take long enough to say what is going on."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the command's arguments."""
    parser.add_argument("cloud", metavar="CLOUD", type=Path, help="a .pcd or .ply file")
    parser.add_argument("--all", action="store_true", help=f"print all regions, not only the {SHOWN} largest")
    parser.add_argument(
        "-o", "--output", metavar="FILE", type=Path, help="write the cloud with a field 'label' as .pcd or .ply"
    )
    parser.add_argument("--barcode", metavar="FILE", type=Path, help="draw the H0 barcode (.png, .pdf, .svg)")
    parser.add_argument(
        "--picture", metavar="FILE", type=Path, help="draw the cloud before and after (.png, .pdf, .svg)"
    )
    add_parameter_arguments(parser)


def run(args: argparse.Namespace) -> int:
    """Segment the cloud, print its regions and write what was asked for."""
    from topo_region_seg.cloud.files import check_output, read_cloud
    from topo_region_seg.offline.cli.console import check_picture, loading_kernels, note, waiting
    from topo_region_seg.offline.cli.regions import stage_line
    from topo_region_seg.pipeline import MissingColorError, Pipeline, warm_up

    def say(code: str, text: str) -> None:
        note(f"note: {text} ({code})")

    params = params_from(args)
    if args.cloud.suffix in (".mcap", ".bag", ".db3") or args.cloud.is_dir():
        raise ToolError(f"{args.cloud}: is not a cloud file; for a recording use: topo_region_seg replay {args.cloud}")
    if args.output:
        check_output(args.output)
    check_picture(args.barcode)
    check_picture(args.picture)
    with waiting(f"reading {args.cloud}"):
        cloud = read_cloud(args.cloud, max_points=params.point_limit, warn=say, advice=_advice(params))
    large = len(cloud) >= LARGE
    with loading_kernels():
        warm_up()
    try:
        with waiting(f"segmenting {len(cloud):,} points", always=large):
            seg = Pipeline(params).run(cloud, say)
    except MissingColorError as error:
        raise ToolError(f"{args.cloud}: {error}") from None
    _print_regions(cloud, seg, shown=None if args.all else SHOWN)
    print(f"{args.cloud}: {stage_line(len(cloud), seg)}", flush=True)
    with waiting("writing the results", always=large and bool(args.output or args.barcode or args.picture)):
        _write(args, cloud, seg)
    for written in (args.output, args.barcode, args.picture):
        if written:
            print(f"wrote {written}")
    return status.DONE


def _advice(params: Params) -> str:
    """Say what to do about a cloud that is too large."""
    if params.over_max_points == "thin":
        return f"raise it with --set max_points; over_max_points=thin takes up to {THINNABLE} times as many"
    return "raise it with --set max_points, or --set over_max_points=thin"


def _print_regions(cloud: Cloud, seg: Segmentation, shown: int | None) -> None:
    """Print the largest regions as a table, or as plain text where the package that draws tables is missing."""
    from topo_region_seg.offline.cli.console import has_rich, output
    from topo_region_seg.offline.cli.regions import plain_lines, region_rows

    count = len(seg.regions)
    if not count:
        return
    rows = region_rows(cloud, seg, shown)
    if has_rich():
        from topo_region_seg.offline.cli.tables import region_table

        output().print(region_table(rows))
    else:
        print(*plain_lines(rows), sep="\n")
    if len(rows) < count:
        print(f"the {len(rows)} largest of {count:,} regions; --all prints all")


def _write(args: argparse.Namespace, cloud: Cloud, seg: Segmentation) -> None:
    if args.output:
        from topo_region_seg.cloud.files import write_labeled_cloud

        write_labeled_cloud(args.output, cloud, seg.labels)
    if args.barcode:
        from topo_region_seg.offline.figures.barcode import plot_barcode

        plot_barcode(seg, args.barcode)
    if args.picture:
        from topo_region_seg.offline.figures.before_after import plot_before_after

        plot_before_after(cloud, seg, args.picture)
