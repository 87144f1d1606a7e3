# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Parameter files as rcl reads them, for the tools and for what the node has to say of them; no ROS import.

A reader of YAML alone takes `1e-3` for text, `1_000` for a number and `1:30` for 90; rcl does not.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

import yaml

PLAIN, TEXT = "tag:rcl,plain", "tag:yaml.org,2002:str"
"""Tags of scalars without and with quotes."""
TRUE = frozenset(["Y", "y", "yes", "Yes", "YES", "true", "True", "TRUE", "on", "On", "ON"])
FALSE = frozenset(["N", "n", "no", "No", "NO", "false", "False", "FALSE", "off", "Off", "OFF"])
INTEGER = re.compile(r"([+-]?)(0[xX][0-9a-fA-F]+|0[0-7]*|[1-9][0-9]*)")
DOUBLE = re.compile(r"[+-]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][+-]?[0-9]+)?|[+-]?(\.?inf|infinity|\.?nan)", re.IGNORECASE)
KEY = "ros__parameters"


class ParameterFileError(ValueError):
    """A parameter file cannot be read; the message is one line with the file, the reason and the remedy."""


@dataclass(frozen=True)
class ParameterFile:
    """What a parameter file holds.

    Parameters
    ----------
    sections : mapping of str to mapping
        Names of nodes, such as ``/**`` or ``/robot/region_segmentation``, and their parameters, nested names joined
        with dots.
    plain : mapping
        Names and values outside of any node: not for ROS.
    """

    sections: dict[str, dict[str, Any]]
    plain: dict[str, Any]


def read_file(path: Path) -> ParameterFile:
    """Read a file of ROS parameters, or a plain one of names and values.

    Raises
    ------
    ParameterFileError
        It cannot be read, is not YAML, or rcl would refuse it.
    """
    try:
        content = yaml.load(path.read_text(encoding="utf-8"), _Loader)
    except (OSError, UnicodeDecodeError) as error:
        reason = error.strerror if isinstance(error, OSError) else "it is not text"
        raise ParameterFileError(f"{path}: cannot be read ({reason}); check the name") from None
    except yaml.YAMLError as error:
        raise ParameterFileError(f"{path}: is not YAML ({' '.join(str(error).split())}); correct that line") from None
    if content is None:
        return ParameterFile({}, {})
    if not isinstance(content, dict):
        raise ParameterFileError(f"{path}: holds no names and values; write lines such as 'max_radius: 0.02'")
    sections: dict[str, dict[str, Any]] = {}
    try:
        _collect(content, "", sections)
    except ValueError as error:
        raise ParameterFileError(f"{path}: {error}") from None
    return ParameterFile(sections, {} if sections else content)


def applies_to(key: str, node: str) -> bool:
    """Whether a file's section is for a node of this full name; ``*`` stands for one name, ``**`` for any number."""
    pattern = re.escape(key).replace(r"/\*\*", r"(/\w+)*").replace(r"/\*", r"/\w+")
    return re.fullmatch(pattern, node) is not None


def files_without_effect(arguments: Sequence[str], node: str) -> list[str]:
    """Return a line for each ``--params-file`` on a command line that has nothing for the node of this full name."""
    lines = []
    for flag, path in pairwise(arguments):
        if flag != "--params-file":
            continue
        try:
            keys = list(read_file(Path(path)).sections)
        except ParameterFileError:
            continue  # rcl has read it its own way
        if keys and not any(applies_to(key, node) for key in keys):
            there = ", ".join(keys)
            lines.append(f"{path}: holds parameters for {there}, none for {node}; put them under '/**' or {node}")
    return lines


def _collect(content: dict[Any, Any], prefix: str, sections: dict[str, dict[str, Any]]) -> None:
    for name, value in content.items():
        if not isinstance(value, dict):
            continue
        key = f"{prefix}/{str(name).strip('/')}"
        if KEY in value:
            sections.setdefault(key, {}).update(_flat(value[KEY] or {}))
        _collect({inner: deeper for inner, deeper in value.items() if inner != KEY}, key, sections)


def _flat(values: Any, prefix: str = "") -> dict[str, Any]:
    if not isinstance(values, dict):
        raise ValueError(f"{KEY} holds no names and values")
    flat: dict[str, Any] = {}
    for name, value in values.items():
        if isinstance(value, dict):
            flat |= _flat(value, f"{prefix}{name}.")
            continue
        if value is None:
            raise ValueError(f"{prefix}{name} has no value")
        if isinstance(value, list) and len({type(item) for item in value}) > 1:
            raise ValueError(f"{prefix}{name} = {value}: ROS takes lists of one type; write all numbers with a point")
        flat[f"{prefix}{name}"] = value
    return flat


def scalar(text: str) -> bool | int | float | str:
    """Return the value that rcl gives a scalar without quotes: as C's strtol, else strtod, reads all of it."""
    if text in TRUE or text in FALSE:
        return text in TRUE
    if found := INTEGER.fullmatch(text):
        sign, digits = found.groups()
        octal = digits.startswith("0") and digits[1:2].lower() != "x"
        value = int(digits, 8 if octal else 0) * (-1 if sign == "-" else 1)
        return value if -(2**63) <= value < 2**63 else float(value)
    if DOUBLE.fullmatch(text):
        number = float(text.lower().replace(".inf", "inf").replace(".nan", "nan"))
        if math.isinf(number) and "inf" not in text.lower():
            return text  # beyond a double
        return number
    return text


class _Loader(yaml.SafeLoader):  # type: ignore[misc]  # yaml is untyped
    """Scalars as rcl reads them, and no aliases, which it refuses."""

    def resolve(self, kind: Any, value: Any, implicit: Any) -> Any:
        if kind is yaml.ScalarNode and implicit[0]:
            return PLAIN
        return super().resolve(kind, value, implicit)

    def compose_node(self, parent: Any, index: Any) -> Any:
        if self.check_event(yaml.AliasEvent):
            event = self.peek_event()
            raise yaml.composer.ComposerError(None, None, "ROS takes no aliases", event.start_mark)
        return super().compose_node(parent, index)

    def flatten_mapping(self, node: yaml.MappingNode) -> None:
        for key, _ in node.value:
            key.tag = TEXT  # a name, whatever it looks like; and no merging of mappings


def _plain(loader: _Loader, node: yaml.ScalarNode) -> bool | int | float | str | None:
    text = loader.construct_scalar(node)
    return scalar(text) if text else None


_Loader.add_constructor(PLAIN, _plain)
