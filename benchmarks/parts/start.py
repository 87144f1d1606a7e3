# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Start: the import, the node with and without compiled kernels, the first frame, and a read-only install."""

from __future__ import annotations

import os
import re
import shutil
from pathlib import Path
from statistics import median

from benchmarks import child
from benchmarks.node_process import ACTIVE, COMPILING, NodeProcess, ros_is_there
from benchmarks.parts.frames import run_frame
from benchmarks.recordings import frames
from benchmarks.results import Line, Result, Setting
from topo_region_seg.pipeline import Pipeline, warm_up

TITLE = "7. Start"
IMPORT_SECONDS, WARM_SECONDS, COLD_SECONDS, FIRST_FRAME = 0.4, 3.0, 60.0, 3.0
IMPORT = """
import sys, time
start = time.perf_counter()
import topo_region_seg
print(time.perf_counter() - start, "numba" in sys.modules)
"""


def measure(setting: Setting) -> Result:
    """Measure starts of new processes."""
    result = Result()
    runs = setting.choose(7, 3)
    answers = [child.python(["-c", IMPORT], 60.0).split() for _ in range(runs)]
    seconds = median(float(answer[0]) for answer in answers)
    result.at_most(f"import under {IMPORT_SECONDS} s", "new process", seconds, IMPORT_SECONDS, "s", 3)
    compiled = sum(answer[1] == "True" for answer in answers)
    result.at_most("import compiles nothing: runs that loaded numba", "new process", compiled, 0, "", 0)

    goal = f"first frame no slower than {FIRST_FRAME:g} times the median"
    warm_up()
    ratio = child.call("parts.start", "first_frame")
    result.at_most(goal, "new process, kernels loaded as the node does", ratio, FIRST_FRAME, "times", 2)
    if not setting.quick:
        empty = {"NUMBA_CACHE_DIR": str(setting.folder / "kernels")}
        ratio = child.call("parts.start", "first_frame", environment=empty)
        result.at_most(goal, "new process, kernels compiled as the node does", ratio, FIRST_FRAME, "times", 2)

    domain = 1 + os.getpid() % 100
    on = "node, warm kernel cache"
    if ros_is_there():
        warm = median(_active(domain, setting.folder / f"warm{i}.log") for i in range(setting.choose(5, 2)))
        result.at_most(f"active in {WARM_SECONDS:g} s", on, warm, WARM_SECONDS, "s", 2)
    else:
        result.missing(f"active in {WARM_SECONDS:g} s", on, "rclpy is not installed: pip install '.[ros]'")
    if setting.quick:
        result.notes.append("The cold start and the read-only install are left out of a quick run.")
    elif ros_is_there():
        _cold_and_read_only(domain, setting.folder, result)
    return result


def first_frame() -> float:
    """Return how many times as long as the median the first frame takes."""
    pipeline = Pipeline()
    warm_up()
    frame = frames()[0]
    totals = [run_frame(frame, pipeline)["total"] for _ in range(31)]
    return totals[0] / median(totals[1:])


def _active(domain: int, log: Path) -> float:
    with NodeProcess(domain, log) as node:
        return node.wait_for(ACTIVE, 150.0)


def _cold_and_read_only(domain: int, folder: Path, result: Result) -> None:
    """Start the node from a copy of the package that it cannot write to, with no compiled kernels anywhere."""
    on = "node, read-only install, no kernels compiled"
    package, home = folder / "read_only", folder / "home"
    shutil.copytree(
        child.ROOT / "topo_region_seg", package / "topo_region_seg", ignore=shutil.ignore_patterns("__pycache__")
    )
    home.mkdir()
    for path in (package, *package.rglob("*")):
        path.chmod(0o555 if path.is_dir() else 0o444)
    environment = {"PYTHONPATH": str(package), "HOME": str(home), "XDG_CACHE_HOME": str(home / ".cache")}
    environment |= {"ROS_LOG_DIR": str(home), "NUMBA_CACHE_DIR": ""}
    with NodeProcess(domain, folder / "cold.log", environment, home, modest=True) as node:
        seconds = node.wait_for(ACTIVE, 300.0)
        log = node.log
    result.at_most(f"active in {COLD_SECONDS:g} s", on, seconds, COLD_SECONDS, "s")
    result.at_least("it says that it compiles: lines", on, log.count(COMPILING), 1, "", 0)
    kernels = len(list(home.rglob("*.nbc")))
    result.at_least("compiled kernels are kept elsewhere: files", on, kernels, 1, "", 0)
    said = len(re.findall(r"(?m)^.*\bcache\b.*$", log))
    result.lines.append(Line("where they are kept is said once: lines", on, str(said), said == 1))
    with NodeProcess(domain, folder / "again.log", environment, home, modest=True) as node:
        again = node.wait_for(ACTIVE, 300.0)
    result.at_most(
        f"active in {WARM_SECONDS:g} s at the second start", "node, read-only install", again, WARM_SECONDS, "s", 2
    )
    for path in (package, *package.rglob("*")):
        path.chmod(0o755)
