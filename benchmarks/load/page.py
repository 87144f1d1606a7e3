# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The page of the figures."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from benchmarks.load.run import Figures, Load


def page(loads: Sequence[Load], cameras: Sequence[Load], found: Mapping[str, Figures], busy: float) -> str:
    return ""
