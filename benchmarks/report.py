# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The results as a document."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

BUSY = 0.5
"""Load before a part above which other processes must have been running too."""

REACHED = {True: "yes", False: "**no**", None: "not measured"}

HEAD = """# Benchmarks

Written by `make bench`, which runs `python -m benchmarks --publish`; `make bench-quick` takes under two minutes
(once PCL's part is compiled) and writes to `benchmarks/results/` instead.
`python -m benchmarks --only filtration` runs one part.
[benchmarks.json](benchmarks.json) holds the same figures for programs. Times are medians after a warm-up. What programs
find is compared before their times count: components at every scale, and every death.
"""


FINDINGS = Path(__file__).resolve().parent / "findings.md"
"""Written by hand: what to know about the goals."""


def markdown(parts: Mapping[str, Mapping[str, Any]], pictures: Mapping[str, Path]) -> str:
    """Return the document; `pictures` are file names by part, in the folder `images` beside it."""
    blocks = [HEAD, *_machines(parts), "## Goals", _goals(parts)]
    if FINDINGS.exists():
        blocks.append(FINDINGS.read_text(encoding="utf-8"))
    for name, part in parts.items():
        blocks.append(f"## {part['title']}")
        if name in pictures:
            blocks.append(f"![{part['title']}](images/{pictures[name].name})")
        for found in part["tables"]:
            blocks += [f"**{found['title']}**", table(found["columns"], found["rows"])]
        blocks += part["notes"]
    return "\n\n".join(block.strip() for block in blocks if block) + "\n"


def table(columns: list[str], rows: Iterable[list[str]]) -> str:
    """Return a Markdown table; columns of numbers are right-aligned."""
    rows = list(rows)
    right = [i > 0 and all(_is_number(row[i]) for row in rows) for i in range(len(columns))]
    rule = ["---:" if to_right else "---" for to_right in right]
    return "\n".join("| " + " | ".join(row) + " |" for row in [columns, rule, *rows])


def _is_number(text: str) -> bool:
    return not text or text.replace(",", "").replace(".", "").lstrip("-").isdigit()


def _machines(parts: Mapping[str, Mapping[str, Any]]) -> list[str]:
    """Say once what all parts share, and how each differs."""
    said: list[str] = []
    by_machine: dict[str, list[str]] = {}
    for name, part in parts.items():
        by_machine.setdefault(_machine(part), []).append(name)
    for text, names in by_machine.items():
        said.append(text if len(by_machine) == 1 else f"{', '.join(names)}: {text}")
    busy = [name for name, part in parts.items() if part["load_before"] > BUSY]
    # The parts load the machine themselves, so only the first tells whether it was idle.
    if parts and next(iter(parts)) in busy:
        load = next(iter(parts.values()))["load_before"]
        said.append(f"The machine was not idle at the start (load {load:g}); idle, it does better than these figures.")
    paces = [ms for part in parts.values() for ms in part["pace_ms"]]
    if paces:
        said.append(
            f"A fixed piece of work, sorting a million numbers, took {min(paces):.0f} to {max(paces):.0f} ms before "
            "and after the parts: a shared machine varies that much from one minute to the next. Ratios within a part "
            "suffer less from this than milliseconds do."
        )
    if any(part["quick"] for part in parts.values()):
        said.append("Some parts come from a quick run with few repetitions.")
    return said


def _machine(part: Mapping[str, Any]) -> str:
    about = part["machine"]
    packages = ", ".join(f"{name} {version}" for name, version in about["packages"].items())
    return (
        f"{part['date']}: {about['cpu']}, {about['cores']} cores, {about['memory_gb']} GB, {about['system']}, "
        f"Python {about['python']}; "
        f"{packages}; PCL {about['pcl']}; commit {about['commit']}."
    )


def _goals(parts: Mapping[str, Mapping[str, Any]]) -> str:
    rows = []
    for part in parts.values():
        number = part["title"].partition(".")[0] if part["title"][0].isdigit() else ""
        rows += [[number, line["goal"], line["on"], line["figure"], REACHED[line["reached"]]] for line in part["lines"]]
    return table(["", "goal", "measured on", "figure", "reached"], rows)
