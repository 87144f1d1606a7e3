# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Each part of `output: objects` switched off, by a parameter where there is one, else in the code.

Constants that kernels read are compiled into them, so that only what Python reads is changed.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from types import ModuleType
from typing import Any
from unittest.mock import patch

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from benchmarks.objects.programs import Found, ours
from topo_region_seg.beyond.objects import figure, grid_objects, lattice
from topo_region_seg.beyond.objects.convexity import Borders
from topo_region_seg.beyond.objects.uniting import NOT_SURE, surety
from topo_region_seg.data import Cloud, IntArray
from topo_region_seg.params import Params
from topo_region_seg.steps.support import ground

SLIGHTLY = 1.0 + 1e-6
"""Times its default a length counts as set, and is the same for all that matters."""


@dataclass(frozen=True)
class Part:
    """What switches a part off: changed parameters, or names of modules with other values."""

    params: Mapping[str, Any] = field(default_factory=dict)
    code: tuple[tuple[ModuleType, str, Any], ...] = ()


def _length(name: str) -> Part:
    return Part({name: SLIGHTLY * getattr(Params(), name)})


def _code(module: ModuleType, **values: Any) -> Part:
    return Part(code=tuple((module, name, value) for name, value in values.items()))


def _same(scene: Any, label: Any, *rest: Any) -> Any:
    return label


def _every(scene: Any, label: Any, narrow: float) -> Any:
    return np.ones(int(np.max(label)) + 1, np.bool_)


def _largest(surface: Any, down: Any) -> float:
    return float(surface.share)


def united_at_once(borders: Borders, n_regions: int, share: float) -> IntArray:
    """Return the group (R,) of each region where every convex border unites, and none is judged again."""
    convex = [surety(*pair, share) != NOT_SURE for pair in zip(borders.pairs, borders.convex, strict=True)]
    first, second = borders.first[convex], borders.second[convex]
    number = connected_components(coo_matrix((np.ones(len(first)), (first, second)), (n_regions, n_regions)), False)[1]
    lowest = np.full(n_regions, n_regions)
    np.minimum.at(lowest, number, np.arange(n_regions))
    group: IntArray = lowest[number]
    return group


PARTS: Mapping[str, Part] = {
    "without a support": Part({"remove_floor": False}),
    "the support is the largest plane": _code(ground, _rank=_largest),
    "without walls and other surfaces": _code(ground, OWN=-1.0),
    "the same margin of the support at every depth": _length("object_floor_distance"),
    "the same lengths at every depth and noise": _length("object_normal_radius"),
    "normals at every pixel": _code(lattice, MANY=10**9),
    "without grooves": Part({"object_groove_angle": 180.0}),
    "narrow faces kept": _code(grid_objects, _wide=_every),
    "nothing united": Part({"object_convexity": 1.0}),
    "borders not judged again": _code(grid_objects, unite_convex=united_at_once),
    "labels do not spread": _code(grid_objects, _spread=lambda scene, normals, label, free, rings: label),
    "what is left is no segment": _code(grid_objects, _with_rest=_same),
    "fragments stay": _code(grid_objects, SMALL=0),
    "without vessels": Part({"object_vessels": False}),
    "confidence: every segment": Part({"min_confidence": 0.0}),
    "confidence: the image's edge": _code(figure, CUT=0.0, CUT_IN_SIGHT=0.0, CUT_HIDING_NOTHING=0.0),
    "confidence: a thing that another hides": _code(figure, BEHIND_ANOTHER=1.0),
    "confidence: a thing beside another": _code(figure, BESIDE=0.0),
    "confidence: the place on the support": _code(figure, OFF_SUPPORT=1.0, FEW=0),
}
"""By what is said of a run without it."""


@contextmanager
def switched_off(part: Part) -> Iterator[None]:
    """Run what is inside without the code of a part."""
    with ExitStack() as stack:
        for module, name, value in part.code:
            stack.enter_context(patch.object(module, name, value))
        yield


def without(part: Part, cloud: Cloud, params: Params) -> Found:
    """Segment a cloud without a part."""
    with switched_off(part):
        return ours(cloud, params.replace(**part.params), 1)
