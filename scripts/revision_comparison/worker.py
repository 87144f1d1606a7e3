# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Runs in a process of its own with one revision on its path: answers each request, a line of JSON, with another.

Only the public Python API and the command line are used, so that the modules behind them may move.
"""

from __future__ import annotations

import json
import os
import runpy
import sys
import time
from collections.abc import Collection, Mapping
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any

import numpy as np

COMPARED = ("labels", "index", "components", "barcode", "regions", "features", "plane")
OLD_OUTPUTS: dict[str, dict[str, str]] = {
    "regions": {},
    "objects": {"level": "objects"},
    "supervoxels": {"mode": "supervoxels"},
}
"""How version 0.1.0 said `output`."""


def translated(params: Mapping[str, Any], known: Collection[str]) -> dict[str, Any]:
    """Return parameters by the names that a revision knows."""
    values = dict(params)
    if "output" in values and "output" not in known:
        values.update(OLD_OUTPUTS[values.pop("output")])
    return values


def answer(request: Mapping[str, Any]) -> dict[str, Any]:
    """Do what is asked for; return the CPU seconds of it."""
    import topo_region_seg as trs

    if request["do"] == "start":
        trs.warm_up()
        return {}
    values = translated(request["params"], {field.name for field in fields(trs.Params)})
    if request["do"] == "replay":
        return {"cpu": _replay(request["bag"], request["output"], request.get("topic"), values)}
    with np.load(request["cloud"]) as cloud:
        xyz, rgb = cloud["xyz"], cloud.get("rgb")
    params = trs.Params(**values)
    started = time.process_time()
    seg = trs.segment(xyz, rgb, params)
    spent = time.process_time() - started
    if request.get("arrays"):
        np.savez(request["arrays"], **results(trs, xyz, seg, params))
    return {"cpu": spent}


def results(trs: Any, xyz: Any, seg: Any, params: Any) -> dict[str, Any]:
    """Return all that is compared of a segmentation, by name."""
    arrays = _segmentation(seg)
    for name, cut in _cuts(seg, params).items():
        arrays.update({f"{name}: {key}": value for key, value in _segmentation(cut).items()})
    # Where the scale is chosen, the points of the filtration and the unit of adjacency are the pipeline's own.
    if "auto" not in (params.max_radius, params.as_dict()["max_radius"]):
        for radius in (None, 0.02):
            arrays.update(_flat(f"adjacency({radius or ''})", seg.adjacency(radius)))
        if _plain(params):
            points = xyz.reshape(-1, 3)[seg.index]
            found = trs.persistent_components(points, seg.features.lab, seg.features.normals, params)
            arrays.update(_flat("persistent_components", found))
    return arrays


def _plain(params: Any) -> bool:
    """Whether the parameters mean regions, whose filtration `persistent_components` runs as well."""
    values = params.as_dict()
    return all(values.get(name, "regions") == "regions" for name in ("output", "mode", "level"))


def _cuts(seg: Any, params: Any) -> dict[str, Any]:
    cuts = {"half": seg.cut(seg.components.max_radius / 2)}
    if "supervoxels" not in params.as_dict().values():  # these are not counted
        cuts["regions=8"] = seg.cut(regions=8)
    return cuts


def _segmentation(seg: Any) -> dict[str, Any]:
    arrays: dict[str, Any] = {}
    for name in COMPARED:
        arrays.update(_flat(name, getattr(seg, name)))
    scale = getattr(seg, "scale", None)
    arrays["scale"] = np.float64(seg.params.radius or seg.params.max_radius if scale is None else scale)
    return arrays


def _flat(name: str, value: Any) -> dict[str, Any]:
    """Return the arrays and numbers of a dataclass, and of those in it, by their dotted names."""
    if value is None:
        return {}
    if not is_dataclass(value):
        return {name: np.asarray(value)}
    arrays: dict[str, Any] = {}
    for field in fields(value):
        arrays.update(_flat(f"{name}.{field.name}", getattr(value, field.name)))
    return arrays


def _replay(bag: str, output: str, topic: str | None, params: Mapping[str, Any]) -> float:
    """Run the command; return its CPU seconds."""
    sets = [f"--set={name}={value if isinstance(value, str) else json.dumps(value)}" for name, value in params.items()]
    topics = [f"--topic={topic}"] if topic else []
    sys.argv = ["topo_region_seg", "replay", bag, "-o", output, "--all", "--compression=none", *topics, *sets]
    started = time.process_time()
    try:
        runpy.run_module("topo_region_seg", run_name="__main__", alter_sys=True)
    except SystemExit as end:
        if end.code:
            raise RuntimeError(f"replay ended with status {end.code}") from None
    return time.process_time() - started


def serve() -> None:
    """Answer requests until there are no more; what the package prints goes to standard error."""
    answers = os.fdopen(os.dup(1), "w", buffering=1)
    os.dup2(2, 1)
    for line in sys.stdin:
        try:
            reply = answer(json.loads(line))
        except Exception as error:  # the reason why there is no result is the result
            reply = {"error": " ".join(f"{type(error).__name__}: {error}".split())}
        answers.write(json.dumps(reply) + "\n")


if __name__ == "__main__":
    import topo_region_seg

    where = Path(topo_region_seg.__file__).resolve().parents[1]
    if where != Path(sys.argv[1]).resolve():
        sys.exit(f"topo_region_seg was imported from {where}, not from {sys.argv[1]}; unset PYTHONPATH and try again")
    serve()
