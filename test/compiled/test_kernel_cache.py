# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Compiled kernels: on disk, and before the first frame."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import topo_region_seg

RUN = """
import numpy as np
from topo_region_seg.steps.filtration.leaf_pairs import Edges
from topo_region_seg.steps.filtration.rips import Forest, unite_edges, __file__ as home
assert home.startswith({home!r})
two = np.arange(2)
forest = Forest(two.copy(), np.ones(2, np.int64), two.copy(), np.full(2, np.inf), two.copy(), two, two)
unite_edges(forest, Edges(np.array([4.0]), two[:1], two[1:]), two[:1])
print(forest.death[1])
"""


def test_a_change_in_one_kernel_reaches_those_it_is_compiled_into(tmp_path: Path) -> None:
    package = tmp_path / "topo_region_seg"
    home = Path(topo_region_seg.__file__).parent
    shutil.copytree(home, package, ignore=shutil.ignore_patterns("__pycache__"))
    environment = {**os.environ, "PYTHONPATH": str(tmp_path), "NUMBA_CACHE_DIR": str(tmp_path / "cache")}

    def death() -> float:
        code = RUN.format(home=str(tmp_path))
        run = subprocess.run(
            [sys.executable, "-c", code], capture_output=True, text=True, check=True, env=environment, cwd=tmp_path
        )
        return float(run.stdout)

    assert death() == 2.0
    assert list((tmp_path / "cache").rglob("*.nbi"))
    source = package / "compiled" / "union_find.py"
    changed = source.read_text().replace("= scale", "= 7.0 * scale")
    assert changed != source.read_text()
    source.write_text(changed)
    assert death() == 14.0


WARM = """
import importlib, pathlib
import numpy as np, topo_region_seg as trs
from topo_region_seg.compiled.cache import PACKAGE, ROOMS

def compiled():
    paths = sorted(path for room in ROOMS for path in (PACKAGE / room).rglob("*.py"))
    names = [".".join(path.relative_to(PACKAGE.parent).with_suffix("").parts) for path in paths]
    modules = [importlib.import_module(name.removesuffix(".__init__")) for name in names]
    return {(m.__name__, k): len(v.signatures) for m in modules for k, v in vars(m).items() if hasattr(v, "signatures")}

trs.warm_up()
before = compiled()
rng = np.random.default_rng(0)
xyz = rng.random((60000, 3)) * [0.6, 0.6, 0.2] + [0.0, 0.0, 0.8]
rgb = rng.integers(0, 256, xyz.shape).astype(np.uint8)
for changes in ({"voxel_size": 0.0}, {"features": "color"}, {"features": "normals"}, {"small_regions": "remove"},
                {"remove_floor": False}, {"crop_box": (0, 0, 0, 1, 1, 1)}, {"max_radius": 0.1, "normal_radius": 0.1}):
    for dtype in (np.float32, np.float64):
        for n in (0, 1, 3000, 60000):
            trs.segment(xyz[:n].astype(dtype), rgb[:n], trs.Params(**changes))
print([name for name, count in compiled().items() if count != before[name]])
"""


def test_warming_up_compiles_what_any_parameters_need() -> None:
    run = subprocess.run([sys.executable, "-c", WARM], capture_output=True, text=True, check=True)
    assert run.stdout.strip() == "[]"
