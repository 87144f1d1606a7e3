# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""What is evaluated: a recording, its truth and the parameters. Workers receive these objects."""

from __future__ import annotations

from dataclasses import dataclass

from topo_region_seg.offline.evaluation.measures import AS_LABELED, TruthReading
from topo_region_seg.params import Params


@dataclass(frozen=True)
class Source:
    """A recording and the topics to use.

    Parameters
    ----------
    bag : str
        Its name in the results.
    path : str
        Its absolute path, which has to be the same for every worker.
    topic : str or None
        The clouds; None = as :func:`~topo_region_seg.offline.bags.clouds.cloud_topic` chooses.
    truth_topic : str or None
        The true labels; None = the usual topic, or what the clouds carry themselves.
    truth_bag : str or None
        Another recording (absolute path) that holds the true labels.
    recorded : bool
        Measure the recorded labels instead of segmenting the clouds.
    reading : TruthReading
        What the true labels mean.
    """

    bag: str
    path: str
    topic: str | None = None
    truth_topic: str | None = None
    truth_bag: str | None = None
    recorded: bool = False
    reading: TruthReading = AS_LABELED


@dataclass(frozen=True)
class Task:
    """Some clouds of a recording with one set of parameters.

    Parameters
    ----------
    source : Source
        The recording.
    params : Params
        The parameters.
    version : str
        Version of the program that asks for the result; a worker with another one refuses.
    first : int
        Index of the first cloud.
    end : int or None
        Index after the last cloud; None for all that follow.
    clouds : int
        The number of clouds, as the recording claims.
    """

    source: Source
    params: Params
    version: str
    first: int
    end: int | None
    clouds: int
