# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The results as a page of the documentation."""

from __future__ import annotations

import subprocess
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from mutation.choice import Mutant
from mutation.report import ENOUGH, share_killed

HEAD = """# Wrong changes

`make mutants` makes small wrong changes to the package one at a time, such as `<` for `<=`, another constant, or a
statement left out, and runs the tests of that part of it. A change that no test notices survives. `python
scripts/mutants.py --publish` wrote this page.
"""


def page(
    root: Path,
    chosen: Sequence[Mutant],
    results: Mapping[str, Mapping[str, Any]],
    equivalent: Mapping[str, str],
    reasons: Mapping[str, str],
) -> str:
    """Return the page: how many changes were noticed in each room, and those that were not, with the `reasons` why."""
    counted = {mutant.id: results[mutant.id] for mutant in chosen if mutant.id in results}
    tried = {name: found for name, found in counted.items() if name not in equivalent}
    alike = [mutant for mutant in chosen if mutant.id in equivalent]
    dates = sorted({str(found["date"]) for found in counted.values()})
    share = share_killed(tried.values())
    lines = [
        HEAD,
        f"**{100 * share:.0f} %** of {len(tried)} changes were noticed ({100 * ENOUGH:.0f} % is wanted); "
        f"{len(chosen)} are chosen, {len(alike)} of them change nothing that can be seen, "
        f"{len(chosen) - len(alike) - len(tried)} were not tried.",
        f"Tried on {' to '.join(dict.fromkeys((dates[0], dates[-1])))}, commit {_commit(root)}." if dates else "",
        "",
        "| room | tried | noticed | by the time limit | not noticed | share |",
        "|---|---|---|---|---|---|",
    ]
    for room in dict.fromkeys(mutant.room for mutant in chosen):
        lines.append(_row(room, [found for found in tried.values() if found["room"] == room]))
    lines.append(_row("all", list(tried.values())))
    survived = [mutant for mutant in chosen if tried.get(mutant.id, {}).get("result") == "survived"]
    if survived:
        lines += ["", "## Not noticed", "", "| where | change | why |", "|---|---|---|"]
        lines += [f"| {_place(mutant)} | {_change(mutant)} | {reasons.get(mutant.id, '')} |" for mutant in survived]
    if alike:
        lines += ["", "## Nothing changes", "", "| where | change | why no test can tell |", "|---|---|---|"]
        lines += [f"| {_place(mutant)} | {_change(mutant)} | {equivalent[mutant.id]} |" for mutant in alike]
    return "\n".join(lines) + "\n"


def _row(name: str, found: list[Mapping[str, Any]]) -> str:
    of = Counter(result["result"] for result in found)
    share = f"{100 * share_killed(found):.0f} %" if found else "–"
    return f"| {name} | {len(found)} | {of['killed']} | {of['timeout']} | {of['survived']} | {share} |"


def _place(mutant: Mutant) -> str:
    return f"{mutant.file}:{mutant.line}"


def _change(mutant: Mutant) -> str:
    before, after = (" ".join(text.split()).replace("|", "\\|") for text in (mutant.before, mutant.after))
    return f"`{before}` → `{after}`"


def _commit(root: Path) -> str:
    command = ["git", "-C", str(root), "describe", "--always", "--dirty", "--exclude=*"]
    return subprocess.run(command, capture_output=True, check=True, text=True).stdout.strip()
