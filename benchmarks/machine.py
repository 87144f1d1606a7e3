# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The machine and the programs that a figure belongs to."""

from __future__ import annotations

import importlib.metadata
import os
import platform
import subprocess
import time
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np

PACKAGES = ("numpy", "scipy", "numba", "ripser", "gudhi", "scikit-learn", "quitefastmst", "open3d", "ros-jazzy-rclpy")


def describe() -> dict[str, Any]:
    """Return the processor, its cores, memory, and the versions that matter."""
    return {
        "cpu": _cpu(),
        "cores": len(os.sched_getaffinity(0)),
        "memory_gb": round(os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") / 1e9),
        "system": f"{platform.system()} {platform.release()}",
        "python": platform.python_version(),
        "commit": _commit(),
        "packages": {name: version for name in PACKAGES if (version := version_of(name))},
    }


def version_of(package: str) -> str | None:
    """Return the installed version, or None."""
    try:
        return importlib.metadata.version(package)
    except importlib.metadata.PackageNotFoundError:
        return None


def load() -> float:
    """Return the mean number of running processes in the last minute; above 0.5 before the start, others work too."""
    return round(os.getloadavg()[0], 2)


def pace() -> float:
    """Return the median time of a fixed piece of work, sorting a million numbers, in milliseconds.

    On a virtual machine it tells how much of the processor the neighbors leave, which changes from minute to minute.
    """
    numbers = np.random.default_rng(0).random(1_000_000)
    times = []
    for _ in range(7):
        begun = time.perf_counter()
        np.sort(numbers, kind="stable")
        times.append(time.perf_counter() - begun)
    return round(1e3 * median(times), 1)


def _cpu() -> str:
    fields: dict[str, str] = {}
    for line in Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines():
        name, _, value = line.partition(":")
        fields.setdefault(name.strip(), value.strip())
    name = fields.get("model name", platform.machine())
    # Virtual machines hide the name, but not family and model.
    return f"{name}, family {fields['cpu family']} model {fields['model']}" if "cpu family" in fields else name


def _commit() -> str:
    root = Path(__file__).resolve().parent.parent
    try:
        run = subprocess.run(
            ["git", "describe", "--always", "--dirty"],
            cwd=root,
            capture_output=True,
            text=True,
            timeout=10,
            check=False,
        )
    except OSError:
        return ""
    return run.stdout.strip()
