# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""What a table of parameters is: names, types, defaults, units, ranges and meanings in one place, checked together."""

from __future__ import annotations

import difflib
import math
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from typing import Any, ClassVar, TypeVar

P = TypeVar("P", bound="ParameterTable")

Condition = Mapping[str, tuple[Any, ...]]
"""Values that other parameters must have: all of them, each one of those given."""


class ParameterError(ValueError):
    """A parameter has an unknown name, a wrong type or a value out of range; the message says which and why."""


class Word(str):
    """A word that stands in place of a number; printed with a number's format, it stays the word."""

    __slots__ = ()

    def __format__(self, spec: str) -> str:
        try:
            return super().__format__(spec)
        except ValueError:
            return str(self)


@dataclass(frozen=True)
class Spec:
    """What is known of one parameter besides its name, type and default."""

    doc: str
    unit: str = ""
    low: float | None = None
    high: float | None = None
    choices: tuple[str, ...] = ()
    words: tuple[str, ...] = ()
    """Words that may stand in place of a number."""
    lengths: tuple[int, ...] = ()
    """Of a list of numbers."""
    texts: bool = False
    """Whether it is a list of words in place of numbers."""
    live: bool = True
    when: tuple[Condition, ...] = ()
    """Where the parameter has an effect: where one of these holds; everywhere if there are none."""


@dataclass(frozen=True)
class Row:
    """One row of the table: a parameter's name, Python type, default and specification."""

    name: str
    type: type
    default: Any
    spec: Spec


def parameter(default: Any, doc: str, **spec: Any) -> Any:
    """Declare one parameter: a dataclass field that carries its :class:`Spec`."""
    return field(default=default, metadata={"spec": Spec(doc=doc, **spec)})


@dataclass(frozen=True)
class ParameterTable:
    """Frozen dataclass whose every field is a parameter, checked when an instance is made."""

    RENAMED: ClassVar[Mapping[str, str]] = {}
    """Names of former versions, and what to write in their place."""

    def __post_init__(self) -> None:
        for row in self.table():
            object.__setattr__(self, row.name, checked(row, getattr(self, row.name)))

    @classmethod
    def table(cls) -> tuple[Row, ...]:
        """Return the rows of the table in the order of declaration."""
        return tuple(
            Row(f.name, _type_of(f.default, spec), f.default, spec)
            for f in fields(cls)
            if (spec := f.metadata.get("spec")) is not None
        )

    @classmethod
    def from_mapping(cls: type[P], values: Mapping[str, Any]) -> P:
        """Build from names and values; an unknown name raises :class:`ParameterError`."""
        known = {row.name for row in cls.table()}
        for name in values:
            if name not in known:
                raise ParameterError(f"unknown parameter '{name}'{cls.hint(name)}")
        return cls(**dict(values))

    @classmethod
    def hint(cls, name: str) -> str:
        """Return what to write in place of an unknown name, to follow a message that says it is unknown."""
        if name in cls.RENAMED:
            return f"; write {cls.RENAMED[name]} instead"
        known = [row.name for row in cls.table()]
        near = difflib.get_close_matches(name, known, n=1)
        return f"; did you mean '{near[0]}'?" if near else f"; known: {', '.join(sorted(known))}"

    def replace(self: P, **changes: Any) -> P:
        """Return a copy with some values changed; all are checked together."""
        return type(self).from_mapping({**self.as_dict(), **changes})

    def as_dict(self) -> dict[str, Any]:
        """Return names and values; tuples become lists and words plain text, so that JSON and YAML can carry them."""
        return {row.name: _plain_type(getattr(self, row.name)) for row in self.table()}

    def differs(self, name: str) -> bool:
        """Return whether a parameter has another value than its default."""
        return bool(getattr(self, name) != next(row.default for row in self.table() if row.name == name))

    def without_effect(self) -> dict[str, str]:
        """Return the parameters that differ from their defaults without effect, each with the setting that is why."""
        rows = {row.name: row for row in self.table()}
        found = {}
        for row in rows.values():
            if getattr(self, row.name) != row.default and (cause := self._cause(rows, row)):
                found[row.name] = f"{cause} = {_plain(getattr(self, cause))}"
        return found

    def _cause(self, rows: Mapping[str, Row], row: Row) -> str:
        """Return the parameter because of which another one has no effect; "" if it has one."""
        cause = ""
        for condition in row.spec.when:
            failing = ""
            for name, values in condition.items():
                failing = failing or self._cause(rows, rows[name]) or ("" if getattr(self, name) in values else name)
            if not failing:
                return ""
            cause = cause or failing
        return cause


def _type_of(default: Any, spec: Spec) -> type:
    """Return the type of a parameter's values; words stand in place of numbers that are no whole ones."""
    return float if default in spec.words else type(default)


def _plain_type(value: Any) -> Any:
    if isinstance(value, tuple):
        return list(value)
    return str(value) if isinstance(value, Word) else value


def _plain(value: Any) -> str:
    return str(value).lower() if isinstance(value, bool) else str(list(value) if isinstance(value, tuple) else value)


def checked(row: Row, value: Any) -> Any:
    """Return `value` in the row's own type, or raise :class:`ParameterError` naming row, value and reason."""
    spec = row.spec
    if row.type is bool:
        if not isinstance(value, bool):
            raise ParameterError(f"{row.name} = {value!r}: must be true or false")
        return value
    if row.type is str:
        if spec.choices and value not in spec.choices:
            raise ParameterError(f"{row.name} = {value!r}: must be one of {', '.join(spec.choices)}")
        if not isinstance(value, str):
            raise ParameterError(f"{row.name} = {value!r}: must be text")
        return value
    if row.type is tuple:
        return _checked_texts(row, value) if spec.texts else _checked_numbers(row, value)
    if isinstance(value, str) and value in spec.words:
        return Word(value)
    if row.type is int and isinstance(value, float) and value.is_integer():
        value = int(value)
    kind = " or ".join(["a whole number" if row.type is int else "a number", *spec.words])
    if isinstance(value, bool) or not _is_number(value, row.type):
        raise ParameterError(f"{row.name} = {value!r}: must be {kind}")
    value = row.type(value)
    unit = f" {spec.unit}" if spec.unit else ""
    if not math.isfinite(value):
        raise ParameterError(f"{row.name} = {value}: must be a finite number")
    if spec.low is not None and value < spec.low:
        raise ParameterError(f"{row.name} = {value}: must be at least {spec.low:g}{unit}")
    if spec.high is not None and value > spec.high:
        raise ParameterError(f"{row.name} = {value}: must be at most {spec.high:g}{unit}")
    return value


def _is_number(value: Any, kind: type) -> bool:
    if kind is int:
        return hasattr(value, "__index__")
    return hasattr(value, "__float__") and not isinstance(value, str | bytes)


def _checked_texts(row: Row, value: Any) -> tuple[str, ...]:
    if not isinstance(value, list | tuple) or not all(isinstance(text, str) for text in value):
        raise ParameterError(f"{row.name} = {value!r}: must be a list of names, such as [intensity, ring]")
    return tuple(value)


def _checked_numbers(row: Row, value: Any) -> tuple[float, ...]:
    wanted = " or ".join(str(n) for n in row.spec.lengths)
    try:
        numbers = tuple(float(x) for x in value)
    except (TypeError, ValueError):
        raise ParameterError(f"{row.name} = {value!r}: must be a list of {wanted} numbers") from None
    if len(numbers) not in row.spec.lengths:
        raise ParameterError(f"{row.name} = {list(numbers)}: must have {wanted} numbers, has {len(numbers)}")
    if not all(math.isfinite(x) for x in numbers):
        raise ParameterError(f"{row.name} = {list(numbers)}: must be finite numbers")
    return numbers
