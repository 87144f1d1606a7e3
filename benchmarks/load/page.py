# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The page of the figures."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from benchmarks import machine
from benchmarks.load.run import Figures, Load
from benchmarks.report import BUSY, table


def page(
    loads: Sequence[Load], cameras: Sequence[Load], found: Mapping[str, Figures], busy: float, seconds: float
) -> str:
    """Return the document; `busy` is the load of the machine before, `seconds` the length of a run."""
    about = machine.describe()
    rows = [[_described(load), *_cells(found[load.name]), _goal(load, found[load.name])] for load in loads]
    lines = [
        "# Under load",
        "",
        "`python -m benchmarks.load` (`make load`) wrote this page: the node, the camera and a listener to the topics,",
        f"each in a process of its own, on one machine; {seconds:g} s each, simulated tabletops.",
        f"{about['cpu']}, {about['cores']} cores, Python {about['python']}, commit {about['commit']}.",
        *([f"**Other programs were at work** (load {busy:g} before the start)."] if busy > BUSY else []),
        "",
        table(["load", *COLUMNS, "goals"], rows),
        "",
        "Dropped are frames without an answer. Latency is from the stamp to the labels at the listener. *Cores* and",
        "*processor* are the node's alone. Memory is what is resident: a third is the code of libraries, which other",
        "processes share, and 32 MB Fast DDS's shared memory; the rest is its own.",
        "",
        "## Several cameras in one process",
        "",
        f"With the parameter `cameras`: depth images of {cameras[0].width}x{cameras[0].height} at {cameras[0].hz:g} Hz",
        "from each, labels of each to the listener.",
        "",
        table(["cameras", *COLUMNS], [[load.name, *_cells(found[load.name])] for load in cameras]),
        "",
        _per_camera([found[load.name] for load in cameras]),
        "",
    ]
    return "\n".join(lines)


COLUMNS = (
    "dropped (%)",
    "latency, median (ms)",
    "latency, 95 % (ms)",
    "cores",
    "processor for an answer (ms)",
    "memory (MB)",
    "of it its own (MB)",
)


def _described(load: Load) -> str:
    return f"{load.name}: {load.width}x{load.height}, {load.hz:g} Hz"


def _cells(run: Figures) -> list[str]:
    return [
        f"{run.dropped:.1f}",
        f"{run.latency(0.5):.0f}",
        f"{run.latency(0.95):.0f}",
        f"{run.cores:.2f}",
        f"{run.cpu_ms:.0f}",
        f"{run.memory['all']:.0f}",
        f"{run.memory['own']:.0f}",
    ]


def _goal(load: Load, run: Figures) -> str:
    """Return each goal of a load, those bold that were not reached."""
    measured = {
        "dropped (%)": run.dropped,
        "latency (ms)": run.latency(0.5),
        "cores": run.cores,
        "memory (MB)": run.memory["all"],
    }
    return ", ".join(
        text if measured[name] <= limit else f"**{text}**"
        for name, limit in load.goals.items()
        for text in [f"{name} ≤ {limit:g}"]
    )


def _per_camera(runs: Sequence[Figures]) -> str:
    more = len(runs) - 1
    memory = (runs[-1].memory["all"] - runs[0].memory["all"]) / more
    cores = (runs[-1].cores - runs[0].cores) / more
    return (
        f"Each camera after the first takes {memory:.0f} MB and {cores:.2f} cores more; a process of its own takes "
        f"{runs[0].memory['all']:.0f} MB."
    )
