# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""ROS parameters from the parameter tables: declared with ranges and descriptions, read back, checked as a whole."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeVar

from rcl_interfaces.msg import FloatingPointRange, IntegerRange, ParameterDescriptor, SetParametersResult
from rclpy.exceptions import ParameterException
from rclpy.node import Node
from rclpy.parameter import Parameter

from topo_region_seg.parameter_table import ParameterError, ParameterTable, Row, checked
from topo_region_seg.ros.rclpy_private import given_parameters

P = TypeVar("P", bound=ParameterTable)


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
    overrides = given_parameters(node)
    for row in table.table():
        if (given := overrides.get(row.name)) is not None:
            overrides[row.name] = _typed(row, given)
        try:
            if row.type is tuple:
                _declare_list(node, row)
            else:
                node.declare_parameter(row.name, row.default, descriptor(row))
        except ParameterException:
            value = overrides[row.name].value
            # The table refuses the value too, and says best why.
            wanted = checked(row, value)
            raise ParameterError(f"{row.name} = {value!r}: is of another type than {wanted!r}") from None
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


def typed(changes: Sequence[Parameter], table: type[ParameterTable]) -> list[Parameter]:
    """Return the changes with every value of the table made of its row's ROS type, where nothing is lost by that.

    A command line and `ros2 param set` take 1 for an integer where the parameter is a double, and an empty list for one
    of no type.
    """
    rows = {row.name: row for row in table.table()}
    return [_typed(rows[change.name], change) if change.name in rows else change for change in changes]


def _typed(row: Row, given: Parameter) -> Parameter:
    kinds, value = Parameter.Type, given.value
    if row.type is float and given.type_ == kinds.INTEGER:
        return Parameter(row.name, kinds.DOUBLE, float(value))
    if row.type is int and given.type_ == kinds.DOUBLE and value.is_integer():
        return Parameter(row.name, kinds.INTEGER, int(value))
    empty = given.type_ in (kinds.BOOL_ARRAY, kinds.BYTE_ARRAY, kinds.STRING_ARRAY) and not len(value)
    if row.type is tuple and empty:
        return Parameter(row.name, _list_type(row), [])
    if row.type is tuple and not row.spec.texts and given.type_ == kinds.INTEGER_ARRAY:
        return Parameter(row.name, kinds.DOUBLE_ARRAY, [float(number) for number in value])
    return given


def _list_type(row: Row) -> Parameter.Type:
    return Parameter.Type.STRING_ARRAY if row.spec.texts else Parameter.Type.DOUBLE_ARRAY


def _declare_list(node: Node, row: Row) -> None:
    # rclpy takes an empty list for bytes, so the type is declared and the empty default set afterwards.
    declared = node.declare_parameter(row.name, _list_type(row), descriptor(row))
    if declared.type_ == Parameter.Type.NOT_SET:
        default = Parameter(row.name, _list_type(row), list(row.default))
        result = node.set_parameters_atomically([default])
        if not result.successful:
            raise ParameterError(f"{row.name}: {result.reason}")
