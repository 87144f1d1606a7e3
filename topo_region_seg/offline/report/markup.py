# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Pieces of HTML. What a recording says is not to be trusted: it all passes through `text`."""

from __future__ import annotations

import base64
import hashlib
import html
import json
from collections.abc import Iterable, Sequence
from decimal import Decimal
from typing import Any


def text(value: object) -> str:
    """Return any value as text that is safe in an element and in a quoted attribute."""
    shown = str(value).encode("utf-8", "backslashreplace").decode("utf-8")
    # Control characters and marks that turn the direction of writing could make one text look like another.
    return html.escape("".join(c if c.isprintable() else f"\\u{ord(c):04x}" for c in shown))


def table(caption: str, head: Sequence[str], rows: Iterable[Sequence[object]], *, first_is_head: bool = True) -> str:
    """Return a table that scrolls by itself where it is too wide; numbers are set to the right."""
    lines = [
        f'<div class="scroll" role="region" tabindex="0" aria-label="{text(caption)}"><table>',
        f"<caption>{text(caption)}</caption>",
        "<thead><tr>" + "".join(f'<th scope="col">{text(name)}</th>' for name in head) + "</tr></thead><tbody>",
    ]
    for row in rows:
        first, *rest = (_cell(value) for value in row)
        tag, scope = ("th", ' scope="row"') if first_is_head else ("td", "")
        cells = "".join(f"<td{kind}>{shown}</td>" for kind, shown in rest)
        lines.append(f"<tr><{tag}{scope}{first[0]}>{first[1]}</{tag}>{cells}</tr>")
    return "\n".join([*lines, "</tbody></table></div>"])


def data_block(name: str, value: Any) -> str:
    """Return a block of JSON that the page's scripts read; nothing in it can end the block."""
    content = json.dumps(value, separators=(",", ":"), allow_nan=False)
    for character in "<>&\u2028\u2029":
        content = content.replace(character, f"\\u{ord(character):04x}")
    return f'<script type="application/json" id="{text(name)}">{content}</script>'


def policy(scripts: Iterable[str], styles: Iterable[str]) -> str:
    """Return a content security policy: nothing is loaded, and only these scripts and styles count."""
    allowed = {"script-src": scripts, "style-src": styles}
    parts = [f"{kind} {' '.join(_hash(source) for source in sources)}" for kind, sources in allowed.items()]
    return "; ".join(["default-src 'none'", "img-src data:", *parts, "base-uri 'none'", "form-action 'none'"])


def _hash(source: str) -> str:
    digest = hashlib.sha256(source.encode("utf-8")).digest()
    return f"'sha256-{base64.b64encode(digest).decode('ascii')}'"


def _cell(value: object) -> tuple[str, str]:
    if value is None:
        return ' class="number"', "–"
    if isinstance(value, float):
        return ' class="number"', text(f"{value:.3f}")
    if isinstance(value, Decimal):
        return ' class="number"', text(f"{value:,}")
    if isinstance(value, int) and not isinstance(value, bool):
        return ' class="number"', text(f"{value:,}")
    return "", text(value)
