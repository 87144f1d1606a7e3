# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Every combination of lists of parameter values: ``--set max_radius=0.01,0.02 --set angle_threshold=5,8``."""

from __future__ import annotations

import argparse
from dataclasses import dataclass
from itertools import product
from typing import Any

from topo_region_seg.offline.cli.parameters import read_parameter_file, read_value, split_assignment
from topo_region_seg.offline.cli.status import ToolError
from topo_region_seg.parameter_table import ParameterError, Row
from topo_region_seg.params import Params

SET_MANY = (
    "values to try of one parameter, with commas between them (semicolons where a value is a list itself); "
    "may be repeated: every combination is tried"
)
_SHOWN = 3


@dataclass(frozen=True)
class Combination:
    """A set of parameters, and what it takes of those that are varied."""

    varied: dict[str, Any]
    params: Params

    @property
    def text(self) -> str:
        """The varied values in words."""
        return ", ".join(f"{name} {value}" for name, value in self.varied.items()) or "as given"


def grid_from(args: argparse.Namespace) -> list[Combination]:
    """Return all combinations that `--params` and `--set` ask for, none twice.

    Raises
    ------
    ParameterError, ToolError
        A name is unknown, the file cannot be read, or combinations are invalid: the message names them.
    """
    fixed = read_parameter_file(args.params) if args.params else {}
    lists: dict[str, list[Any]] = {}
    for assignment in args.set:
        row, text = split_assignment(assignment)
        known = lists.setdefault(row.name, [])
        known += [value for value in _values(row, text) if value not in known]
    found: dict[Params, Combination] = {}
    wrong: list[str] = []
    chosen = list(product(*lists.values()))
    for values in chosen:
        settings = dict(zip(lists, values, strict=True))
        try:
            params = Params.from_mapping({**fixed, **settings})
        except ParameterError as error:
            shown = ", ".join(f"{name}={value}" for name, value in settings.items())
            wrong.append(f"[{shown}] {error}" if shown else str(error))
            continue
        varied = {name: params.as_dict()[name] for name in lists if len(lists[name]) > 1}
        found.setdefault(params, Combination(varied, params))
    if wrong:
        more = f" | and {len(wrong) - _SHOWN} more" if len(wrong) > _SHOWN else ""
        raise ToolError(
            f"{len(wrong)} of {len(chosen)} combinations are invalid: {' | '.join(wrong[:_SHOWN])}{more}; correct --set"
        )
    return list(found.values())


def _values(row: Row, text: str) -> list[Any]:
    parts = [part for part in text.split(";" if row.type is tuple else ",") if part.strip() or row.type is tuple]
    if not parts:
        raise ToolError(f"--set {row.name}=: no value; write --set {row.name}=VALUE,VALUE")
    return [read_value(row, part) for part in parts]
