# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""``segment``: one cloud file."""

from __future__ import annotations

import argparse
from pathlib import Path

from topo_region_seg.offline.cli import status
from topo_region_seg.offline.cli.parameters import add_parameter_arguments, params_from
from topo_region_seg.offline.cli.status import ToolError
from topo_region_seg.params import THINNABLE

PICTURES = (".png", ".pdf", ".svg")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the command's arguments."""
    parser.add_argument("cloud", metavar="CLOUD", type=Path, help="a .pcd or .ply file")
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
    from topo_region_seg.cloud.files import check_output, read_cloud, write_labeled_cloud
    from topo_region_seg.offline.cli.console import check_writable, note, output, waiting
    from topo_region_seg.offline.cli.tables import region_table, stage_line
    from topo_region_seg.pipeline import MissingColorError, Pipeline, warm_up

    def say(code: str, text: str) -> None:
        note(f"note: {text} ({code})")

    params = params_from(args)
    if args.cloud.suffix in (".mcap", ".bag", ".db3") or args.cloud.is_dir():
        raise ToolError(f"{args.cloud}: is no cloud file; for a recording use: topo_region_seg replay {args.cloud}")
    if args.output:
        check_output(args.output)
    for picture in (args.barcode, args.picture):
        if picture:
            check_writable(picture, PICTURES)
    advice = "raise it with --set max_points" + (
        f"; over_max_points=thin takes up to {THINNABLE} times as many"
        if params.over_max_points == "thin"
        else ", or --set over_max_points=thin"
    )
    cloud = read_cloud(args.cloud, max_points=params.point_limit, warn=say, advice=advice)
    with waiting("loading the kernels; the first time they are compiled"):
        warm_up()
    try:
        seg = Pipeline(params).run(cloud, say)
    except MissingColorError as error:
        raise ToolError(f"{args.cloud}: {error}") from None
    if len(seg.regions):
        output().print(region_table(cloud, seg))
    print(f"{args.cloud}: {stage_line(len(cloud), seg)}")
    if args.output:
        write_labeled_cloud(args.output, cloud, seg.labels)
    if args.barcode:
        from topo_region_seg.offline.figures.barcode import plot_barcode

        plot_barcode(seg, args.barcode)
    if args.picture:
        from topo_region_seg.offline.figures.before_after import plot_before_after

        plot_before_after(cloud, seg, args.picture)
    for written in (args.output, args.barcode, args.picture):
        if written:
            print(f"wrote {written}")
    return status.DONE
