# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Names that parameter files may hold: those of the tables, and those of every ROS node; no ROS import."""

from __future__ import annotations

import difflib
from collections.abc import Iterable

from topo_region_seg.params import Params
from topo_region_seg.ros.node_params import NodeParams

OF_EVERY_NODE = ("use_sim_time", "start_type_description_service", "qos_overrides")
"""What rclpy declares itself; `ros2 param dump` writes it too. Names may go on after a point."""
KNOWN = tuple(row.name for table in (Params, NodeParams) for row in table.table())


def unknown(names: Iterable[str]) -> list[str]:
    """Return a line for each name that neither this package nor every ROS node knows."""
    lines = []
    for name in sorted(names):
        first = name.partition(".")[0]
        if name in KNOWN or first in OF_EVERY_NODE:
            continue
        if name in Params.RENAMED:
            lines.append(f"unknown parameter '{name}' ignored{Params.hint(name)}")
            continue
        near = difflib.get_close_matches(first, [*KNOWN, *OF_EVERY_NODE], n=1)
        lines.append(f"unknown parameter '{name}' ignored" + (f"; did you mean '{near[0]}'?" if near else ""))
    return lines
