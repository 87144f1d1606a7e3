# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The results of the demonstration: pictures of the last frame and ``summary.json``.

Keys of ``summary.json``:

``seconds``
    Duration of the demonstration.
``recordings``
    One entry per recording:

    - ``name``, ``title``, ``params`` (node parameters that differ from the defaults);
    - ``files``: ``recording`` (played), ``labeled`` (recorded from the node), ``before_after``, ``barcode``;
    - ``frames_sent``, ``frames_labeled``, ``points`` (of a frame, invalid ones included);
    - ``regions`` (median of the frames), ``ms_median`` (from a cloud to its labels, over DDS);
    - ``same_offline``: whether the pipeline without ROS gives the last frame the same labels;
    - ``frames``: for each labeled frame ``stamp``, ``points``, ``labeled``, ``regions``, ``ms``.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from topo_region_seg.data import Cloud, LabelArray
from topo_region_seg.offline.demo.recordings import DemoRecording
from topo_region_seg.offline.figures.barcode import plot_barcode
from topo_region_seg.offline.figures.before_after import plot_before_after
from topo_region_seg.pipeline import Pipeline


def draw(demo: DemoRecording, cloud: Cloud, live: LabelArray, folder: Path) -> dict[str, Any]:
    """Segment the cloud without ROS, compare it with the `live` labels, and draw it; return entries of the summary."""
    seg = Pipeline(demo.settings).run(cloud)
    picture, barcode = folder / f"{demo.name}.png", folder / f"{demo.name}_barcode.png"
    plot_before_after(cloud, seg, picture)
    plot_barcode(seg, barcode)
    return {
        "same_offline": bool(np.array_equal(seg.labels, live)),
        "files": {"before_after": picture.name, "barcode": barcode.name},
    }


def write_summary(path: Path, seconds: float, recordings: list[dict[str, Any]]) -> None:
    """Write ``summary.json``."""
    content = {"seconds": round(seconds, 1), "recordings": recordings}
    path.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")
