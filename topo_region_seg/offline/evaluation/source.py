# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""What is evaluated: a recording, where its truth is, and the parameters; sent to workers as it is."""

from __future__ import annotations

from dataclasses import dataclass

from topo_region_seg.params import Params


@dataclass(frozen=True)
class Source:
    """A recording and where to look in it.

    Parameters
    ----------
    bag : str
        Its name in the results.
    path : str
        Where it is; an absolute path, which means the same to every worker.
    topic : str or None
        The clouds; None = as :func:`~topo_region_seg.offline.bags.clouds.cloud_topic` chooses.
    truth_topic : str or None
        The true labels; None = the usual topic, or what the clouds carry themselves.
    truth_bag : str or None
        Another recording (absolute path) that holds the true labels.
    recorded : bool
        Measure the labels that the clouds carry, instead of segmenting them anew.
    """

    bag: str
    path: str
    topic: str | None = None
    truth_topic: str | None = None
    truth_bag: str | None = None
    recorded: bool = False


@dataclass(frozen=True)
class Task:
    """Some clouds of a recording with one set of parameters: those from `first` up to but not including `end`.

    `end` is None for all that follow; `clouds` is how many these should be, and `version` that of the program that
    wants the result.
    """

    source: Source
    params: Params
    version: str
    first: int
    end: int | None
    clouds: int
