# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""How well regions fit known objects: measures, and their evaluation over recordings, here or on a Dask cluster."""

from topo_region_seg.offline.evaluation.measures import (
    DETECTION,
    LEAKAGE,
    MEASURES,
    SEGMENTATION,
    TruthReading,
    measure,
)

__all__ = ["DETECTION", "LEAKAGE", "MEASURES", "SEGMENTATION", "TruthReading", "measure"]
