# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Every small wrong change that the source of one module allows."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from dataclasses import dataclass

COMPARISONS = {
    ast.Lt: ("<", "<="),
    ast.LtE: ("<=", "<"),
    ast.Gt: (">", ">="),
    ast.GtE: (">=", ">"),
    ast.Eq: ("==", "!="),
    ast.NotEq: ("!=", "=="),
    ast.Is: ("is", "is not"),
    ast.IsNot: ("is not", "is"),
    ast.In: ("in", "not in"),
    ast.NotIn: ("not in", "in"),
}
ARITHMETIC = {
    ast.Add: ("+", "-"),
    ast.Sub: ("-", "+"),
    ast.Mult: ("*", "/"),
    ast.Div: ("/", "*"),
    ast.FloorDiv: ("//", "*"),
    ast.BitAnd: ("&", "|"),
    ast.BitOr: ("|", "&"),
    ast.LShift: ("<<", ">>"),
    ast.RShift: (">>", "<<"),
}
NAMES = {
    "min": "max",
    "minimum": "maximum",
    "argmin": "argmax",
    "any": "all",
    "floor": "ceil",
}
NAMES |= {there: here for here, there in NAMES.items()}
REMOVABLE = (ast.AugAssign, ast.Raise, ast.Continue, ast.Break)


@dataclass(frozen=True)
class Edit:
    """One change of a source: the characters from `start` to `end` become `text`."""

    operator: str
    start: int
    end: int
    text: str


class _Source:
    """A module's text, whose places are those of the syntax tree (lines, and bytes within a line)."""

    def __init__(self, text: str) -> None:
        self.text = text
        self.lines = text.splitlines(keepends=True)
        self.starts = [0]
        for line in self.lines:
            self.starts.append(self.starts[-1] + len(line))

    def at(self, line: int, column: int) -> int:
        return self.starts[line - 1] + len(self.lines[line - 1].encode()[:column].decode())

    def span(self, node: ast.expr | ast.stmt) -> tuple[int, int]:
        assert node.end_lineno is not None and node.end_col_offset is not None
        return self.at(node.lineno, node.col_offset), self.at(node.end_lineno, node.end_col_offset)

    def of(self, node: ast.expr) -> str:
        start, end = self.span(node)
        return self.text[start:end]

    def between(self, left: ast.expr, right: ast.expr, old: str, new: str, operator: str) -> Iterator[Edit]:
        """Change the sign between two operands."""
        start, end = self.span(left)[1], self.span(right)[0]
        found = self.text[start:end].find(old)
        if found >= 0:
            yield Edit(operator, start + found, start + found + len(old), new)


def edits(text: str) -> list[Edit]:
    """Return all changes of a module's source, in the order of the syntax tree."""
    source = _Source(text)
    return [edit for node in _code(ast.parse(text)) for edit in _changes(source, node)]


def _code(node: ast.AST) -> Iterator[ast.AST]:
    """Walk what runs: neither annotations, decorators, assertions nor imports for types."""
    yield node
    for name, value in ast.iter_fields(node):
        if name in ("annotation", "returns", "decorator_list", "type_params", "bases"):
            continue
        for child in value if isinstance(value, list) else [value]:
            if isinstance(child, ast.Assert) or (isinstance(child, ast.If) and _for_types(child)):
                continue
            if isinstance(child, ast.AST):
                yield from _code(child)


def _for_types(branch: ast.If) -> bool:
    return isinstance(branch.test, ast.Name) and branch.test.id == "TYPE_CHECKING"


def _changes(source: _Source, node: ast.AST) -> Iterator[Edit]:
    if isinstance(node, ast.Compare):
        operands = [node.left, *node.comparators]
        for left, sign, right in zip(operands, node.ops, operands[1:], strict=False):
            yield from source.between(left, right, *COMPARISONS[type(sign)], "comparison")
    elif isinstance(node, ast.BinOp) and type(node.op) in ARITHMETIC:
        if not any(isinstance(part, ast.JoinedStr) or _is_text(part) for part in (node.left, node.right)):
            yield from source.between(node.left, node.right, *ARITHMETIC[type(node.op)], "arithmetic")
    elif isinstance(node, ast.BoolOp):
        old, new = ("and", "or") if isinstance(node.op, ast.And) else ("or", "and")
        for left, right in zip(node.values, node.values[1:], strict=False):
            yield from source.between(left, right, old, new, "and/or")
    elif isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.Not | ast.USub):
        start, end = source.span(node)
        yield Edit("not" if isinstance(node.op, ast.Not) else "sign", start, end, f"({source.of(node.operand)})")
    elif isinstance(node, ast.Constant):
        yield from _constant(source, node)
    elif isinstance(node, ast.Call):
        yield from _call(source, node)
    elif isinstance(node, ast.If | ast.While | ast.IfExp):
        start, end = source.span(node.test)
        yield Edit("condition", start, end, f"(not ({source.text[start:end]}))")
    elif isinstance(node, REMOVABLE) or (isinstance(node, ast.Expr) and isinstance(node.value, ast.Call)):
        yield Edit("statement", *source.span(node), "pass")


def _is_text(node: ast.expr) -> bool:
    return isinstance(node, ast.Constant) and isinstance(node.value, str | bytes)


def _constant(source: _Source, node: ast.Constant) -> Iterator[Edit]:
    if isinstance(node.value, bool):
        yield Edit("constant", *source.span(node), str(not node.value))
    elif isinstance(node.value, int):
        yield Edit("constant", *source.span(node), str(node.value + 1))
        if node.value > 0:
            yield Edit("constant", *source.span(node), str(node.value - 1))
    elif isinstance(node.value, float):
        yield Edit("constant", *source.span(node), repr(2.0 * node.value if node.value else 1.0))


def _call(source: _Source, node: ast.Call) -> Iterator[Edit]:
    function = node.func
    name = function.attr if isinstance(function, ast.Attribute) else getattr(function, "id", "")
    if name in NAMES:
        end = source.span(function)[1]
        yield Edit("min/max", end - len(name), end, NAMES[name])
    elif len(node.args) > 1 and not any(isinstance(argument, ast.Starred) for argument in node.args[:2]):
        first, second = node.args[:2]
        (start, middle), (again, end) = source.span(first), source.span(second)
        swapped = source.of(second) + source.text[middle:again] + source.of(first)
        if swapped != source.text[start:end]:
            yield Edit("arguments", start, end, swapped)
