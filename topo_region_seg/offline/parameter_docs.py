# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The parameter tables as a commented YAML file for ROS and as a Markdown table.

``python -m topo_region_seg.offline.parameter_docs yaml > config/region_segmentation.yaml`` updates the file after a
change of a table; ``markdown`` in place of ``yaml`` prints the table.
"""

from __future__ import annotations

import json
import sys
import textwrap
from collections.abc import Sequence
from typing import Any

from topo_region_seg.parameter_table import Row
from topo_region_seg.params import Params
from topo_region_seg.ros.node_params import NodeParams

HEAD = """\
# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
#
# Every parameter of region_segmentation_node with its default.
# Generated from the parameter tables: python -m topo_region_seg.offline.parameter_docs yaml
# All can be changed while the node runs, except those marked "fixed"; a change is in force from the next cloud on.
/**:
  ros__parameters:
"""
WIDTH = 100
TYPE_NAMES = {bool: "bool", int: "int", float: "double", str: "string", tuple: "double[]"}


def yaml_text() -> str:
    """Return the text of ``config/region_segmentation.yaml``."""
    tables = (("Segmentation", Params), ("Node", NodeParams))
    return HEAD + "\n".join(_yaml_section(title, table.table()) for title, table in tables)


def markdown_table() -> str:
    """Return all parameters as a Markdown table, one row each."""
    lines = ["| parameter | type | default | unit | range | meaning |", "|---|---|---|---|---|---|"]
    for row in (*Params.table(), *NodeParams.table()):
        default = f"`{_literal(row.default)}`"
        meaning = row.spec.doc.replace("|", "\\|") + ("" if row.spec.live else " (fixed)")
        kind = "string[]" if row.spec.texts else TYPE_NAMES[row.type]
        cells = (f"`{row.name}`", kind, default, row.spec.unit, _range(row), meaning)
        lines.append(f"| {' | '.join(cells)} |")
    return "\n".join(lines) + "\n"


def _yaml_section(title: str, rows: Sequence[Row]) -> str:
    lines = [f"    # --- {title} ---"]
    for row in rows:
        facts = [text for text in (row.spec.unit, _range(row), "" if row.spec.live else "fixed") if text]
        comment = row.spec.doc + (f" [{', '.join(facts)}]" if facts else "")
        lines += textwrap.wrap(comment, WIDTH, initial_indent="    # ", subsequent_indent="    # ")
        lines.append(f"    {row.name}: {_literal(row.default)}")
    return "\n".join(lines) + "\n"


def _range(row: Row) -> str:
    spec = row.spec
    if spec.choices:
        return ", ".join(spec.choices)
    if spec.lengths:
        return f"{' or '.join(str(n) for n in spec.lengths)} numbers"
    if spec.low is None or spec.high is None:
        return ""
    return ", or ".join([f"{_bound(spec.low)} to {_bound(spec.high)}", *spec.words])


def _bound(value: float) -> str:
    return f"{int(value)}" if value == int(value) else f"{value:g}"


def _literal(value: Any) -> str:
    """Return the value as YAML; a float keeps its decimal point, which ROS needs to distinguish it from an integer."""
    if isinstance(value, float):
        text = repr(value)
        return text if "." in text else text.replace("e", ".0e")
    return json.dumps(list(value) if isinstance(value, tuple) else value)


def main(argv: Sequence[str] | None = None) -> int:
    """Print the YAML file or the Markdown table."""
    texts = {"yaml": yaml_text, "markdown": markdown_table}
    arguments = list(sys.argv[1:] if argv is None else argv)
    if len(arguments) != 1 or arguments[0] not in texts:
        print(f"usage: python -m topo_region_seg.offline.parameter_docs {'|'.join(texts)}", file=sys.stderr)
        return 2
    sys.stdout.write(texts[arguments[0]]())
    return 0


if __name__ == "__main__":
    sys.exit(main())
