# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Results are compared before they are timed: what computes something else is not a peer."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from topo_region_seg.data import Components

FLOAT32_ROUNDING = 2e-6
"""Largest relative error of a distance that was computed in single precision."""


class DisagreementError(Exception):
    """Two programs give different results for the same cloud; the message says where."""


def counts_agree(program: str, found: npt.ArrayLike, ours: npt.ArrayLike) -> None:
    """Raise unless the numbers of components at each scale are the same."""
    found, ours = np.asarray(found), np.asarray(ours)
    if found.shape != ours.shape or (found != ours).any():
        raise DisagreementError(f"{program}: components at the scales are {found.tolist()}, here {ours.tolist()}")


def deaths_agree(program: str, found: npt.ArrayLike, ours: Components, relative: float) -> None:
    """Raise unless the finite deaths `found`, in any order, are those of `ours` up to a relative error.

    Bars of length zero are left out: some programs do not report them.
    """
    theirs = np.sort(np.asarray(found, np.float64))
    theirs = theirs[theirs > 0.0]
    deaths = np.sort(ours.death[np.isfinite(ours.death) & (ours.death > 0.0)])
    if len(theirs) != len(deaths):
        raise DisagreementError(f"{program}: {len(theirs)} finite deaths, here {len(deaths)}")
    wrong = np.flatnonzero(np.abs(theirs - deaths) > relative * deaths)
    if len(wrong):
        raise DisagreementError(f"{program}: death {wrong[0]} is {theirs[wrong[0]]!r}, here {deaths[wrong[0]]!r}")


def same_partition(program: str, found: npt.NDArray[np.integer], ours: npt.NDArray[np.integer]) -> None:
    """Raise unless both labelings group the points alike, whatever the names of the groups."""
    if not (refines(found, ours) and refines(ours, found)):
        raise DisagreementError(
            f"{program}: {len(np.unique(found))} groups that are not the {len(np.unique(ours))} groups here"
        )


def between(
    program: str, found: npt.NDArray[np.integer], fine: npt.NDArray[np.integer], coarse: npt.NDArray[np.integer]
) -> None:
    """Raise unless `found` lies between `fine` and `coarse`, the answers for scales a rounding error apart."""
    if not (refines(fine, found) and refines(found, coarse)):
        raise DisagreementError(
            f"{program}: {len(np.unique(found))} groups are not between the {len(np.unique(fine))} and "
            f"{len(np.unique(coarse))} groups at scales a rounding error apart"
        )


def refines(fine: npt.NDArray[np.integer], coarse: npt.NDArray[np.integer]) -> bool:
    """Whether each group of `fine` lies within one group of `coarse`."""
    order = np.argsort(fine, kind="stable")
    same_group = np.diff(fine[order]) == 0
    return not (np.diff(coarse[order]) != 0)[same_group].any()
