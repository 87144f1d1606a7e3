# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Region segmentation of RGB-D point clouds by topological persistence.

>>> import topo_region_seg as trs
>>> seg = trs.segment(xyz, rgb, trs.Params(max_radius=0.03))  # doctest: +SKIP
>>> seg.labels, seg.regions, seg.barcode  # doctest: +SKIP

Heavy modules are loaded at first use, so that importing this package is quick.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from topo_region_seg.api import persistent_components, segment
    from topo_region_seg.beyond.boxes.oriented import OrientedBoxes, oriented_boxes
    from topo_region_seg.data import (
        Adjacency,
        Barcode,
        Cloud,
        Components,
        Features,
        PointClass,
        Region,
        RegionTable,
        SegmentationWarning,
    )
    from topo_region_seg.parameter_table import ParameterError
    from topo_region_seg.params import Params
    from topo_region_seg.pipeline import MissingColorError, Pipeline, warm_up
    from topo_region_seg.segmentation import Segmentation

__version__ = "0.1.0"

_HOME = {
    "segment": "api",
    "Adjacency": "data",
    "Barcode": "data",
    "Cloud": "data",
    "Components": "data",
    "Features": "data",
    "OrientedBoxes": "beyond.boxes.oriented",
    "PointClass": "data",
    "Region": "data",
    "RegionTable": "data",
    "Segmentation": "segmentation",
    "SegmentationWarning": "data",
    "ParameterError": "parameter_table",
    "Params": "params",
    "MissingColorError": "pipeline",
    "Pipeline": "pipeline",
    "warm_up": "pipeline",
    "oriented_boxes": "beyond.boxes.oriented",
    "persistent_components": "api",
    "sensor_model_of": "beyond.objects.image",
}

__all__ = [
    "Adjacency",
    "Barcode",
    "Cloud",
    "Components",
    "Features",
    "MissingColorError",
    "OrientedBoxes",
    "ParameterError",
    "Params",
    "Pipeline",
    "PointClass",
    "Region",
    "RegionTable",
    "Segmentation",
    "SegmentationWarning",
    "__version__",
    "oriented_boxes",
    "persistent_components",
    "segment",
    "sensor_model_of",
    "warm_up",
]


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module '{__name__}' has no attribute '{name}'")
    value = getattr(importlib.import_module(f"{__name__}.{_HOME[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return __all__
