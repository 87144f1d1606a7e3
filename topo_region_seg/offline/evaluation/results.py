# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""What an evaluation found: per frame, per recording, and over all frames."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from statistics import median
from typing import Any

from topo_region_seg.offline.evaluation.measures import MEASURES, Measures


@dataclass(frozen=True)
class FrameResult:
    """One measured cloud; `stamp` in seconds, `ms` per stage with `total`."""

    stamp: float
    points: int
    regions: int
    measures: Measures
    ms: dict[str, float]


@dataclass(frozen=True)
class Rejected:
    """One cloud or truth that could not be used; `stamp` in seconds (the log time where the message has none)."""

    stamp: float
    reason: str
    detail: str


@dataclass
class BagResult:
    """What was found in one recording, or in some of its clouds.

    Parameters
    ----------
    bag : str
        Its name.
    topic, truth : str
        The topic of the clouds; where their truth is.
    frames : list of FrameResult
        The measured clouds, as recorded.
    without_truth : int
        Clouds for which there is no truth.
    rejected : list of Rejected
        Clouds and truths that cannot be used.
    problems : list of str
        A line for each damaged part that was left out.
    truncated : bool
        Whether the recording is cut short.
    error : str
        Why nothing could be measured; empty if all went well.
    """

    bag: str
    topic: str = ""
    truth: str = ""
    frames: list[FrameResult] = field(default_factory=list)
    without_truth: int = 0
    rejected: list[Rejected] = field(default_factory=list)
    problems: list[str] = field(default_factory=list)
    truncated: bool = False
    error: str = ""

    @property
    def failed(self) -> bool:
        """Whether something in it could not be measured, other than for want of truth."""
        return bool(self.error or self.rejected or self.problems)

    def as_dict(self) -> dict[str, Any]:
        """Return all of it, for JSON."""
        return dataclasses.asdict(self)

    @classmethod
    def from_dict(cls, values: dict[str, Any]) -> BagResult:
        """Return what `as_dict` gave; KeyError or TypeError if it was something else."""
        frames = [FrameResult(**frame) for frame in values["frames"]]
        rejected = [Rejected(**rejection) for rejection in values["rejected"]]
        return cls(**{**values, "frames": frames, "rejected": rejected})


def merged(parts: Sequence[BagResult]) -> BagResult:
    """Return the result of a recording from those of its parts, in their order."""
    whole = BagResult(parts[0].bag, parts[0].topic, parts[0].truth)
    for part in parts:
        whole.frames += part.frames
        whole.without_truth += part.without_truth
        whole.rejected += part.rejected
        # Every part opens the recording, and finds the same damage.
        whole.problems += [problem for problem in part.problems if problem not in whole.problems]
        whole.truncated |= part.truncated
        whole.error = whole.error or part.error
    if whole.without_truth and not whole.frames and not whole.failed:
        whole.error = (
            f"{whole.bag}: none of its {whole.without_truth} clouds has truth in {whole.truth}; "
            "--truth-topic or --truth-bag says where it is"
        )
    return whole


def mean_measures(frames: Iterable[FrameResult]) -> Measures:
    """Return the mean of each measure over the frames that define it; None where none does."""
    every = list(frames)
    means: Measures = {}
    for name in MEASURES:
        values = [value for frame in every if (value := frame.measures[name]) is not None]
        means[name] = sum(values) / len(values) if values else None
    return means


def median_ms(frames: Iterable[FrameResult]) -> float | None:
    """Return the median time of a frame, milliseconds, as a pause of the machine says nothing; None without frames."""
    times = [frame.ms["total"] for frame in frames]
    return median(times) if times else None
