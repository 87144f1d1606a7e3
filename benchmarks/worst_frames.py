# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""CPU time of frames that leave much to do, beside that of a tabletop frame.

``python -m benchmarks.worst_frames`` segments made frames of 640x480, and those of other cameras where ../shared holds
them, with every output, and writes ``docs/worst_frames.md``. CPU time is that of the whole process: it does not depend
on who else is at work as much as time does.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from statistics import median

import topo_region_seg as trs
from benchmarks import hard_frames, machine, recordings
from benchmarks.report import table
from topo_region_seg.pipeline import warm_up

GOAL = 3.0
"""Times the median tabletop frame."""
REPEATS = 3
ENOUGH = 2.0
"""CPU seconds after which a frame is not repeated."""
WIDTH, HEIGHT = 640, 480
DOCUMENT = Path(__file__).resolve().parents[1] / "docs" / "worst_frames.md"
OUTPUTS: dict[str, trs.Params] = {
    "regions": trs.Params(),
    "fixed radius": trs.Params(max_radius=0.02),
    "objects": trs.Params(output="objects"),
    "supervoxels": trs.Params(output="supervoxels"),
}


@dataclass(frozen=True)
class Figures:
    """What a frame takes: points after preprocessing; per output, CPU seconds and the stage that takes most."""

    name: str
    points: int
    seconds: dict[str, float]
    longest: dict[str, str]


def measure(name: str, cloud: trs.Cloud, repeats: int = REPEATS) -> Figures:
    """Segment a frame with every output; of the CPU times of some runs the shortest counts."""
    seconds, longest, points = dict[str, float](), dict[str, str](), 0
    for output, params in OUTPUTS.items():
        pipeline, times = trs.Pipeline(params), list[float]()
        while len(times) < repeats and sum(times) < ENOUGH:
            start = time.process_time()
            seg = pipeline.run(cloud, _heard)
            times.append(time.process_time() - start)
        seconds[output], longest[output] = min(times), max(seg.ms, key=lambda stage: seg.ms[stage])
        points = len(seg.index) if output == "regions" else points
    return Figures(name, points, seconds, longest)


def usual(figures: Iterable[Figures]) -> Figures:
    """Return the median of ordinary frames."""
    found = list(figures)
    seconds = {output: median(one.seconds[output] for one in found) for output in OUTPUTS}
    return Figures("tabletop (median)", int(median(one.points for one in found)), seconds, found[0].longest)


def page(ordinary: Figures, found: Sequence[Figures], missing: str) -> str:
    """Return the document; `missing` says which frames were not there."""
    about = machine.describe()
    rows = [[ordinary.name, f"{ordinary.points:,}", *(f"{1e3 * s:.0f} ms" for s in ordinary.seconds.values())]]
    late = 0
    for one in found:
        cells = []
        for output in OUTPUTS:
            times = one.seconds[output] / ordinary.seconds[output]
            late += times > GOAL
            cells.append(f"**{times:.1f}** ({one.longest[output]})" if times > GOAL else f"{times:.1f}")
        rows.append([one.name, f"{one.points:,}", *cells])
    count = len(found) * len(OUTPUTS)
    lines = [
        "# Worst frames",
        "",
        "`python -m benchmarks.worst_frames` wrote this page: CPU time of frames that leave much to do, as a multiple",
        f"of the median of {recordings.source()} tabletop frames of the same size in the same run. The goal is at most",
        f"{GOAL:g}; {count - late} of {count} figures reach it. Others are bold, with the stage that took longest.",
        f"{about['cpu']}, {about['cores']} cores, Python {about['python']}, commit {about['commit']}.",
        missing,
        "",
        table(["frame", "points left", *OUTPUTS], rows),
        "",
        "*Points left* are those after crop, support plane and thinning, for regions. A tabletop loses most of its",
        "points with the table; a room keeps them. Per point left, no frame of as many points takes more than",
        f"{_per_point(ordinary, found):.1f} times the tabletop's CPU time for regions.",
        "",
    ]
    return "\n".join(lines)


def _per_point(ordinary: Figures, found: Iterable[Figures]) -> float:
    """Return the largest multiple of the ordinary CPU time per point left, of frames that keep as many."""
    usual_time = ordinary.seconds["regions"] / max(ordinary.points, 1)
    shares = [one.seconds["regions"] / one.points / usual_time for one in found if one.points >= ordinary.points]
    return max(shares, default=0.0)


def frames() -> Iterator[tuple[str, trs.Cloud]]:
    """Yield name and cloud of all hard frames."""
    for name, make in hard_frames.MADE.items():
        yield name, make(WIDTH, HEIGHT)
    yield from hard_frames.scenes()


def main(arguments: Sequence[str] | None = None) -> int:
    """Measure and write the page; return 0, as the goal is no promise."""
    parser = argparse.ArgumentParser("python -m benchmarks.worst_frames", description=__doc__)
    parser.add_argument("--repeats", type=int, default=REPEATS, help="runs of each frame (%(default)s)")
    parser.add_argument("--output", type=Path, default=DOCUMENT, help="where the page goes (%(default)s)")
    options = parser.parse_args(arguments)
    missing = (
        "" if hard_frames.SCENES.is_dir() else "The frames of other cameras, `../shared/data/scenes`, were not there."
    )
    if missing:
        print(missing)
    warm_up()
    ordinary = usual(measure(frame.name, frame.cloud(), options.repeats) for frame in recordings.frames())
    found = []
    for name, cloud in frames():
        found.append(measure(name, cloud, options.repeats))
        print(name, {key: round(s / ordinary.seconds[key], 1) for key, s in found[-1].seconds.items()}, flush=True)
    options.output.write_text(page(ordinary, found, missing), encoding="utf-8")
    print(f"wrote {options.output}")
    return 0


def _heard(code: str, text: str) -> None:
    """Take a notice: what a frame is like is no concern here."""


if __name__ == "__main__":
    sys.exit(main())
