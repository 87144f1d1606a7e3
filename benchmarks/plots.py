# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The results as pictures."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.parts.filtration import ORGANIZED

Part = Mapping[str, Any]

INK, OURS, LIMIT = "0.35", "#1b6ca8", "#c0392b"


def draw(parts: Mapping[str, Part], folder: Path) -> dict[str, Path]:
    """Draw what there is; return the file of each part that has a picture."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    drawers: dict[str, Callable[[Part, Any], None]] = {
        "filtration": _filtration,
        "scaling": _scaling,
        "frames": _stages,
        "memory": _memory,
    }
    files = {}
    for name, drawer in drawers.items():
        if name not in parts:
            continue
        figure, axes = plt.subplots(figsize=(8.0, 4.2), layout="constrained")
        drawer(parts[name], axes)
        axes.spines[["top", "right"]].set_visible(False)
        folder.mkdir(parents=True, exist_ok=True)
        files[name] = folder / f"bench_{name}.png"
        figure.savefig(files[name], dpi=110)
        plt.close(figure)
    return files


def _filtration(part: Part, axes: Any) -> None:
    """Bars of how many times longer than the core each program takes, the largest cloud from a camera."""
    clouds = part["data"]
    cloud = max((name for name in clouds if name.startswith("objects")), default=next(iter(clouds)), key=_points)
    agreeing = {name: entry for name, entry in clouds[cloud].items() if "median_ms" in entry and ORGANIZED not in name}
    times = {name: entry["median_ms"] for name, entry in agreeing.items()}
    order = sorted(times, key=lambda name: -times[name])
    axes.barh(order, [times[name] for name in order], color=[OURS if name == "the core" else "0.7" for name in order])
    for place, name in enumerate(order):
        axes.text(times[name] * 1.08, place, f"{times[name]:,.0f} ms", va="center", fontsize=9, color=INK)
    axes.set(xscale="log", xlabel="median (ms, logarithmic)")
    axes.set_xlim(min(times.values()) / 5.0, max(times.values()) * 10.0)
    axes.figure.suptitle(f"Ten scales and all deaths: {cloud}")


def _points(name: str) -> int:
    """Return the number of points that a cloud's name tells."""
    return int(name.partition(" points")[0].split()[-1].replace(",", ""))


def _scaling(part: Part, axes: Any) -> None:
    growth = part["data"]["growth"]
    n, ms = np.array(growth["points"], float), np.array(growth["median_ms"])
    axes.loglog(n, ms, "o-", color=OURS, label=f"the core: N^{growth['exponent']:.2f}")
    axes.loglog(n, ms[0] * (n / n[0]) ** 1.15, "--", color=LIMIT, label="the limit: N^1.15")
    axes.set(xlabel="points", ylabel="median (ms)", title="Growth at fixed spacing and radius")
    axes.legend(frameon=False)


def _stages(part: Part, axes: Any) -> None:
    stages = {name: entry for name, entry in part["data"]["stages"].items() if name != "total"}
    order = list(stages)[::-1]
    axes.barh(order, [stages[name]["median_ms"] for name in order], color=OURS, label="median")
    axes.plot([stages[name]["p99_ms"] for name in order], order, "|", color=INK, markersize=12, label="99 %")
    total = part["data"]["stages"]["total"]["median_ms"]
    axes.set(xlabel="ms", title=f"A 640x480 frame: {total:.0f} ms in the median")
    axes.legend(frameon=False)


def _memory(part: Part, axes: Any) -> None:
    resident = part["data"]["resident"]
    frames = (np.arange(len(resident["megabytes"])) + 1) * resident["every"]
    axes.plot(frames, resident["megabytes"], color=OURS)
    top = 1.2 * max(resident["megabytes"])
    axes.set(xlabel="frames", ylabel="resident memory (MB)", title="Memory of the pipeline", ylim=(0, top))
