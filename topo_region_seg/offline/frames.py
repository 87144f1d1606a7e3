# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""What became of a recorded cloud: a result, or the reason for which it was rejected."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from topo_region_seg.cloud.layout import CloudFormatError
from topo_region_seg.data import PointClass
from topo_region_seg.pipeline import MissingColorError
from topo_region_seg.segmentation import Segmentation

INTERNAL_ERROR = "internal_error"
"""Reason of clouds on which the program itself failed; a later run may succeed."""


@dataclass(frozen=True)
class FrameResult:
    """One processed cloud.

    Parameters
    ----------
    stamp : float
        Header stamp, seconds.
    points, regions : int
        Number of points, invalid ones included, and of regions.
    ms, cpu_ms : dict of str to float
        Milliseconds per stage, and their `total`; the same of CPU time in the threads that worked at this cloud, which
        is empty in records of versions that did not measure it.
    classes : dict of str to int
        How many points are of each :class:`PointClass`, by its name in small letters; empty likewise.
    """

    stamp: float
    points: int
    regions: int
    ms: dict[str, float]
    cpu_ms: dict[str, float] = field(default_factory=dict, kw_only=True)
    classes: dict[str, int] = field(default_factory=dict, kw_only=True)


@dataclass(frozen=True)
class Rejection:
    """One message that could not be used.

    Parameters
    ----------
    stamp : float
        Header stamp, seconds; the log time where the message has none.
    reason, detail : str
        Code of the reason, and the reason in words.
    """

    stamp: float
    reason: str
    detail: str

    @classmethod
    def of(cls, stamp: float, error: Exception) -> Rejection:
        """Return the rejection of a cloud that raised `error`."""
        if isinstance(error, CloudFormatError):
            return cls(stamp, error.reason, error.detail)
        if isinstance(error, MissingColorError):
            return cls(stamp, "missing_color", str(error))
        return cls(stamp, INTERNAL_ERROR, " ".join(f"{type(error).__name__}: {error}".split()))


def class_counts(seg: Segmentation) -> dict[str, int]:
    """Return how many input points are of each class that there are any of."""
    count = np.bincount(seg.point_classes, minlength=len(PointClass)).tolist()
    return {of.name.lower(): count[of] for of in PointClass if count[of]}


def rounded(ms: Mapping[str, float]) -> dict[str, float]:
    """Return milliseconds rounded to microseconds: finer digits are noise."""
    return {stage: round(value, 3) for stage, value in ms.items()}
