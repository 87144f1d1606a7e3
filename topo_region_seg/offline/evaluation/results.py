# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The results of an evaluation: per frame, per recording, and over all frames."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from statistics import median
from typing import Any

from topo_region_seg.offline.evaluation.identity import Identity
from topo_region_seg.offline.evaluation.measures import MEASURES, Measures
from topo_region_seg.offline.frames import FrameResult, Rejection


@dataclass(frozen=True)
class MeasuredFrame(FrameResult):
    """One cloud measured against its truth."""

    measures: Measures


@dataclass
class BagResult:
    """The results of one recording, or of some of its clouds.

    Parameters
    ----------
    bag : str
        Its name.
    topic, truth : str
        The topic of the clouds; where their truth is.
    frames : list of MeasuredFrame
        The measured clouds, in recorded order.
    identity : Identity or None
        Whether regions kept their labels; None where labels are those of each frame alone.
    without_truth : int
        Clouds for which there is no truth.
    repeated : int
        Clouds that were paired with their truth by order, as other clouds have the same stamp.
    rejected : list of Rejection
        Clouds and truths that cannot be used.
    problems : list of str
        A line for each damaged part that was left out.
    notices : dict of str to str
        The first notice of each code that the pipeline gave, such as parameters without effect.
    truncated : bool
        Whether the recording is cut short.
    error : str
        Why nothing could be measured; empty if all went well.
    """

    bag: str
    topic: str = ""
    truth: str = ""
    frames: list[MeasuredFrame] = field(default_factory=list)
    identity: Identity | None = None
    without_truth: int = 0
    repeated: int = 0
    rejected: list[Rejection] = field(default_factory=list)
    problems: list[str] = field(default_factory=list)
    notices: dict[str, str] = field(default_factory=dict)
    truncated: bool = False
    error: str = ""

    @property
    def failed(self) -> bool:
        """Whether anything could not be measured for another reason than missing truth."""
        return bool(self.error or self.rejected or self.problems)

    def as_dict(self) -> dict[str, Any]:
        """Return all fields, for JSON."""
        return dataclasses.asdict(self)

    @classmethod
    def from_dict(cls, values: dict[str, Any]) -> BagResult:
        """Return the inverse of `as_dict`; raises KeyError or TypeError for anything else."""
        frames = [MeasuredFrame(**frame) for frame in values["frames"]]
        rejected = [Rejection(**rejection) for rejection in values["rejected"]]
        identity = None if values["identity"] is None else Identity(**values["identity"])
        return cls(**{**values, "frames": frames, "rejected": rejected, "identity": identity})


def merged(parts: Sequence[BagResult]) -> BagResult:
    """Return the result of a recording from those of its parts, in their order."""
    # Labels over frames are measured where there is but one part.
    whole = BagResult(parts[0].bag, parts[0].topic, parts[0].truth, identity=parts[0].identity)
    for part in parts:
        whole.frames += part.frames
        whole.without_truth += part.without_truth
        whole.repeated += part.repeated
        whole.rejected += part.rejected
        # Every part reads the recording and finds the same damage.
        whole.problems += [problem for problem in part.problems if problem not in whole.problems]
        whole.notices = {**part.notices, **whole.notices}
        whole.truncated |= part.truncated
        whole.error = whole.error or part.error
    if whole.without_truth and not whole.frames and not whole.failed:
        whole.error = (
            f"{whole.bag}: none of its {whole.without_truth} clouds has truth in {whole.truth}; "
            "say where it is with --truth-topic or --truth-bag"
        )
    return whole


def mean_measures(frames: Iterable[MeasuredFrame]) -> Measures:
    """Return the mean of each measure over the frames that define it; None where none does."""
    every = list(frames)
    means: Measures = {}
    for name in MEASURES:
        values = [value for frame in every if (value := frame.measures[name]) is not None]
        means[name] = sum(values) / len(values) if values else None
    return means


def median_ms(frames: Iterable[MeasuredFrame]) -> float | None:
    """Return the median time per frame, milliseconds; None without frames."""
    times = [frame.ms["total"] for frame in frames]
    return median(times) if times else None
