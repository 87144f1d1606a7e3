# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Segmentation parameters on the command line: `--params FILE` and `--set name=value`, from the one table."""

from __future__ import annotations

import argparse
import difflib
from pathlib import Path
from typing import Any

from topo_region_seg.offline.cli.console import note
from topo_region_seg.offline.cli.status import ToolError
from topo_region_seg.parameter_table import ParameterError, Row
from topo_region_seg.params import Params
from topo_region_seg.ros.node_params import NodeParams
from topo_region_seg.ros.parameter_files import ParameterFileError, applies_to, read_file
from topo_region_seg.ros.parameter_names import unknown

NODE = "region_segmentation"
SET_ONE = "set one parameter, after --params; may be repeated"


def add_parameter_arguments(
    parser: argparse.ArgumentParser, metavar: str = "NAME=VALUE", set_help: str = SET_ONE
) -> None:
    """Add `--params` and `--set`, and the table of parameters to the end of the help."""
    group = parser.add_argument_group("parameters of the segmentation")
    group.add_argument("--params", metavar="FILE", type=Path, help="YAML file, plain or as the ROS node takes it")
    group.add_argument(
        "--set",
        metavar=metavar,
        action="append",
        default=[],
        help=set_help,
    )
    rows = "\n".join(f"  {row.name} = {_text(row)}: {row.spec.doc}{_note(row)}" for row in Params.table())
    parser.epilog = f"parameters and their defaults:\n{rows.replace('%', '%%')}"


def params_from(args: argparse.Namespace) -> Params:
    """Return the parameters that `--params` and `--set` ask for; all are checked together.

    Raises
    ------
    ParameterError, ToolError
        A name is unknown, a value is out of range, the file cannot be read.
    """
    values = read_parameter_file(args.params) if args.params else {}
    where = f"{args.params}: " if args.params else ""
    for assignment in args.set:
        row, text = split_assignment(assignment)
        values[row.name] = read_value(row, text)
    try:
        return Params.from_mapping(values)
    except ParameterError as error:
        raise ParameterError(f"{where}{error}") from None


def split_assignment(assignment: str) -> tuple[Row, str]:
    """Return the parameter and the text of a ``NAME=VALUE``; :class:`ToolError` if it is none."""
    name, equals, text = assignment.partition("=")
    if not equals:
        raise ToolError(f"--set {assignment}: no '='; write --set NAME=VALUE")
    for row in Params.table():
        if row.name == name:
            return row, text
    raise ToolError(f"--set {name}: unknown parameter{_guess(name)}")


def read_parameter_file(path: Path) -> dict[str, Any]:
    """Read the segmentation's parameters from a YAML file, plain or the node's, and hold the node's own to their table.

    Names that the node ignores in its file are ignored here too, with the same line; a plain file must hold none.

    Raises
    ------
    ToolError, ParameterError
        The file cannot be read, has parameters of several nodes, or an unknown name in a plain file.
    """
    try:
        file = read_file(path)
    except ParameterFileError as error:
        raise ToolError(str(error)) from None
    known = {row.name for row in Params.table()}
    if not file.sections:
        for name in file.plain:
            if name not in known:
                raise ToolError(f"{path}: unknown parameter '{name}'{_guess(str(name))}")
        return file.plain
    values = _of_the_node(path, file.sections)
    for line in unknown(values):
        note(f"{path}: {line}")
    own = {row.name for row in NodeParams.table()}
    try:
        NodeParams.from_mapping({name: value for name, value in values.items() if name in own})
    except ParameterError as error:
        raise ParameterError(f"{path}: {error}") from None
    return {name: value for name, value in values.items() if name in known}


def _of_the_node(path: Path, sections: dict[str, dict[str, Any]]) -> dict[str, Any]:
    """Return the values that a node region_segmentation takes, whatever its namespace."""
    nodes = {key for key in sections if key.rpartition("/")[2] == NODE and "*" not in key}
    name = nodes.pop() if len(nodes) == 1 else f"/{NODE}"
    if not nodes:
        fitting = [values for key, values in sections.items() if applies_to(key, name)]
        if not fitting and len(sections) == 1:
            # Of a node that has another name in its launch file.
            ((key, values),) = sections.items()
            note(f"{path}: the parameters are those of {key}; a node {NODE} takes them if they stand under '/**'")
            fitting = [values]
        if fitting:
            return {name: value for values in fitting for name, value in values.items()}
    raise ToolError(f"{path}: holds parameters of {len(sections)} nodes; give a file with those of one")


def read_value(row: Row, text: str) -> Any:
    """Read a value as the type of its row; what cannot be read is left to the table, which says why."""
    text = text.strip()
    if row.type is str:
        return text
    if row.type is bool:
        return {
            "true": True,
            "1": True,
            "yes": True,
            "on": True,
            "false": False,
            "0": False,
            "no": False,
            "off": False,
        }.get(text.lower(), text)
    if row.type is tuple:
        return [part for part in text.strip("[]()").replace(",", " ").split() if part]
    for read in (int, float):
        try:
            return read(text)
        except ValueError:
            continue
    return text


def _guess(name: str) -> str:
    close = difflib.get_close_matches(name, [row.name for row in Params.table()], n=1)
    return f"; did you mean {close[0]}?" if close else "; --help lists them all"


def _text(row: Row) -> str:
    value = list(row.default) if row.type is tuple else row.default
    return f"{str(value).lower() if isinstance(value, bool) else value}{' ' + row.spec.unit if row.spec.unit else ''}"


def _note(row: Row) -> str:
    spec = row.spec
    if spec.choices:
        return f" ({' | '.join(spec.choices)})"
    if spec.low is not None and spec.high is not None:
        return f" ({spec.low:g} to {spec.high:g})"
    return ""
