# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""How values become HTML. What a recording says is not to be trusted: every value is made printable and escaped."""

from __future__ import annotations

import base64
import hashlib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from decimal import Decimal
from functools import lru_cache
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup


@dataclass(frozen=True)
class Table:
    """A table of the page; numbers are set to the right, None is a dash."""

    caption: str
    head: Sequence[str]
    rows: Sequence[Sequence[object]]


@lru_cache(maxsize=1)
def environment() -> Environment:
    """Return the templates, which escape all that is put into them."""
    templates = Environment(
        loader=PackageLoader("topo_region_seg.offline.report", "assets"),
        autoescape=True,
        undefined=StrictUndefined,
        finalize=printable,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    templates.policies["json.dumps_kwargs"] = {"separators": (",", ":"), "allow_nan": False}
    templates.filters["cell"] = _cell
    templates.tests["figure"] = _is_figure
    return templates


def printable(value: Any) -> str:
    """Return any value as text without control characters, and without marks that turn the direction of writing.

    They could make one text look like another. Markup of the page's own is left as it is.
    """
    if isinstance(value, Markup):
        return value
    shown = str(value).encode("utf-8", "backslashreplace").decode("utf-8")
    return "".join(c if c.isprintable() else f"\\u{ord(c):04x}" for c in shown)


def policy(scripts: Iterable[str], styles: Iterable[str]) -> str:
    """Return a content security policy: nothing is loaded, and only these scripts and styles count."""
    allowed = {"script-src": scripts, "style-src": styles}
    parts = [f"{kind} {' '.join(_hash(source) for source in sources)}" for kind, sources in allowed.items()]
    return "; ".join(["default-src 'none'", "img-src data:", *parts, "base-uri 'none'", "form-action 'none'"])


def _hash(source: str) -> str:
    digest = hashlib.sha256(source.encode("utf-8")).digest()
    return f"'sha256-{base64.b64encode(digest).decode('ascii')}'"


def _is_figure(value: object) -> bool:
    return value is None or (isinstance(value, (int, float, Decimal)) and not isinstance(value, bool))


def _cell(value: object) -> str:
    if value is None:
        return "–"
    if isinstance(value, float):
        return f"{value:.3f}"
    return f"{value:,}" if _is_figure(value) else str(value)
