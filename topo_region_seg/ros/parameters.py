# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""ROS parameters from the parameter tables: declared with ranges and descriptions, read back, checked as a whole."""

from __future__ import annotations

import difflib
from collections.abc import Sequence
from typing import TypeVar

from rcl_interfaces.msg import FloatingPointRange, IntegerRange, ParameterDescriptor, SetParametersResult
from rclpy.exceptions import ParameterException
from rclpy.node import Node
from rclpy.parameter import Parameter

from topo_region_seg.parameter_table import ParameterError, ParameterTable, Row, checked

P = TypeVar("P", bound=ParameterTable)

# Parameters that rclpy declares itself or reads without declaring.
FOREIGN = ("use_sim_time", "qos_overrides", "start_type_description_service")


def descriptor(row: Row) -> ParameterDescriptor:
    """Return the descriptor of one row; a range's step is 0, because rclpy rejects what lies between steps."""
    spec = row.spec
    result = ParameterDescriptor(
        description=f"{spec.doc} [{spec.unit}]" if spec.unit else spec.doc,
        additional_constraints=_constraints(row),
        read_only=not spec.live,
        dynamic_typing=bool(spec.words),
    )
    if spec.low is not None and spec.high is not None:
        if row.type is float:
            result.floating_point_range = [FloatingPointRange(from_value=spec.low, to_value=spec.high, step=0.0)]
        elif row.type is int:
            result.integer_range = [IntegerRange(from_value=int(spec.low), to_value=int(spec.high), step=0)]
    return result


def _constraints(row: Row) -> str:
    if row.spec.words:
        return f"a number, or one of: {', '.join(row.spec.words)}"
    return f"one of: {', '.join(row.spec.choices)}" if row.spec.choices else ""


def declare(node: Node, table: type[P]) -> P:
    """Declare the table's parameters on `node` and return the values given at start.

    Raises
    ------
    ParameterError
        If a value given at start has the wrong type, is out of range or contradicts another one.
    """
    for row in table.table():
        try:
            if row.type is tuple:
                _declare_numbers(node, row)
            else:
                node.declare_parameter(row.name, row.default, descriptor(row))
        except ParameterException:
            given = node._parameter_overrides[row.name].value
            # Where the table refuses the value too, it says best why; what is left is a matter of type.
            wanted = checked(row, given)
            wanted = list(wanted) if row.type is tuple else wanted
            raise ParameterError(f"{row.name} = {given!r}: ROS tells 1 from 1.0; write {wanted!r}") from None
    return read(node, table)


def read(node: Node, table: type[P]) -> P:
    """Return the present values of the table's parameters."""
    return table.from_mapping({row.name: node.get_parameter(row.name).value for row in table.table()})


def check(current: ParameterTable, changes: Sequence[Parameter]) -> SetParametersResult:
    """Check changed parameters together with the rest of `current`; names of other tables are let through."""
    known = {row.name for row in current.table()}
    try:
        current.replace(**{change.name: change.value for change in changes if change.name in known})
    except ParameterError as error:
        return SetParametersResult(successful=False, reason=str(error))
    return SetParametersResult(successful=True)


def typed_empty_lists(changes: Sequence[Parameter], table: type[ParameterTable]) -> list[Parameter]:
    """Return the changes with every empty list made a list of doubles: an empty list on a command line has no type."""
    lists = {row.name for row in table.table() if row.type is tuple}
    kinds = Parameter.Type
    arrays = (kinds.BOOL_ARRAY, kinds.BYTE_ARRAY, kinds.INTEGER_ARRAY, kinds.STRING_ARRAY)
    return [
        Parameter(change.name, kinds.DOUBLE_ARRAY, [])
        if change.name in lists and change.type_ in arrays and not len(change.value)
        else change
        for change in changes
    ]


def unknown_names(node: Node, tables: Sequence[type[ParameterTable]]) -> list[str]:
    """Return a line for each parameter given at start that no table knows; rclpy drops these silently."""
    known = [row.name for table in tables for row in table.table()]
    lines = []
    for name in sorted(node._parameter_overrides):
        if name in known or name.startswith(FOREIGN):
            continue
        near = difflib.get_close_matches(name, known, n=1)
        lines.append(f"unknown parameter '{name}' ignored" + (f"; did you mean '{near[0]}'?" if near else ""))
    return lines


def _declare_numbers(node: Node, row: Row) -> None:
    # rclpy takes an empty list for bytes, so the type is declared and the empty default set afterwards.
    declared = node.declare_parameter(row.name, Parameter.Type.DOUBLE_ARRAY, descriptor(row))
    if declared.type_ == Parameter.Type.NOT_SET:
        default = Parameter(row.name, Parameter.Type.DOUBLE_ARRAY, list(row.default))
        result = node.set_parameters_atomically([default])
        if not result.successful:
            raise ParameterError(f"{row.name}: {result.reason}")
