# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Measure the node beside cameras and a listener on one machine; writes ``docs/load.md``.

``python -m benchmarks.load`` takes under five minutes; ``--only NAME`` runs the loads whose names hold NAME.
"""

from __future__ import annotations

import argparse
import os
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from benchmarks import machine
from benchmarks.load.frames import write_frames
from benchmarks.load.page import page
from benchmarks.load.run import KINDS, Figures, Load, interfaces, measure
from benchmarks.node_process import ros_is_there

STACK = ("labeled_points", "detections", "surfaces", "label_image")
OBJECTS = {"output": "objects", "track_regions": "true"}
NO_DROP = {"dropped (%)": 0.0}
VGA, HD = (640, 480), (1280, 720)
LOADS = (
    Load("clouds, labels", "points", *VGA, 30.0, ("labeled_points",), {}, {**NO_DROP, "memory (MB)": 300.0}),
    Load("depth, labels, boxes, surfaces and image", "depth", *VGA, 30.0, STACK, {}, {**NO_DROP, "latency (ms)": 25.0}),
    Load("depth, tracked objects, all topics", "depth", *VGA, 30.0, tuple(KINDS), OBJECTS, {**NO_DROP, "cores": 1.3}),
    Load("large depth, labels and boxes", "depth", *HD, 30.0, STACK[:2], {}, NO_DROP),
    Load("large clouds, labels", "points", *HD, 15.0, ("labeled_points",), {}, {"dropped (%)": 2.0}),
)
CAMERA = Load("one camera", "depth", *VGA, 10.0, ("labeled_points",), {})
CAMERAS = (
    CAMERA,
    replace(CAMERA, name="two cameras", cameras=("left/", "right/")),
    replace(CAMERA, name="three cameras", cameras=("left/", "right/", "rear/")),
)
SECONDS, CAMERA_SECONDS = 25.0, 12.0
DOCUMENT = Path(__file__).resolve().parents[2] / "docs" / "load.md"


def main(arguments: Sequence[str] | None = None) -> int:
    """Measure and write the page; return 0, as the goals are no promises, or 1 without rclpy."""
    parser = argparse.ArgumentParser("python -m benchmarks.load", description=__doc__)
    parser.add_argument("--only", default="", metavar="NAME", help="print the figures of some loads; writes no page")
    parser.add_argument("--seconds", type=float, default=SECONDS, help="length of a run (%(default)s)")
    parser.add_argument("--output", type=Path, default=DOCUMENT, help="where the page goes (%(default)s)")
    options = parser.parse_args(arguments)
    if not ros_is_there():
        print("rclpy is not installed: pip install '.[ros]'", file=sys.stderr)
        return 1
    if not interfaces():
        print("vision_msgs is missing, so nobody asks for detections and surfaces: run test/ros/test_outputs.py first")
    found: dict[str, Figures] = {}
    domain = 1 + os.getpid() % 100
    busy = machine.load()
    with tempfile.TemporaryDirectory() as folder:
        for load in (*LOADS, *CAMERAS):
            if options.only not in load.name:
                continue
            frames = Path(folder, f"{load.width}x{load.height}")
            if not frames.exists():
                write_frames(frames, load.width, load.height)
            seconds = options.seconds if load in LOADS else min(options.seconds, CAMERA_SECONDS)
            run = found[load.name] = measure(load, frames, Path(folder), seconds, domain)
            memory = ", ".join(f"{kind} {size:.0f}" for kind, size in run.memory.items())
            print(
                f"{load.name}: {run.answered} of {run.sent} answered, {run.latency(0.5):.1f} ms, "
                f"{run.cores:.2f} cores, {run.cpu_ms:.1f} ms of processor a frame; MB: {memory}",
                flush=True,
            )
    if not options.only:
        options.output.write_text(page(LOADS, CAMERAS, found, busy, options.seconds), encoding="utf-8")
        print(f"wrote {options.output}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
