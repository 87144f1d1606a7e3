# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Make wrong changes to the package one at a time and see whether the tests notice.

Usage: ``python scripts/mutants.py [--room NAME] [--number N] [--share S] [--again RESULT] [--unchecked]``
or ``python scripts/mutants.py --list`` or ``--publish``

A mutant is one small wrong change: a comparison, a constant, a sign, an argument, a condition or a statement. Which
ones are tried follows from the seed and the changed line alone. Each must fail one of the tests of its room. Results
are kept in build/mutants.json, so that a run can be interrupted and continued; those whose line has changed are
forgotten. Mutants that change nothing that can be seen are listed in scripts/mutation/equivalent.yaml, with the reason.

Kept tools do not do: mutmut chooses among the mutants of a function at run time, when kernels are compiled already, and
others know nothing of compiled kernels, so that each mutant costs a compilation of all of them.

Exit status: 0 at least 90 % of what was tried were killed; 1 fewer were; 2 wrong usage, or the unchanged sources fail.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import time
from pathlib import Path
from typing import Any

import yaml
from mutation.choice import Mutant, chosen
from mutation.page import page
from mutation.report import ENOUGH, share_killed, summary
from mutation.rooms import BY_NAME, ROOMS, tests_of
from mutation.tree import Tree

ROOT = Path(__file__).resolve().parent.parent
BUILD = ROOT / "build"
RESULTS = BUILD / "mutants.json"
PAGE = ROOT / "docs" / "mutants.md"
SECONDS = BUILD / "mutants" / "seconds.json"
"""How long each test file takes with the unchanged sources: the fast ones are run first."""
EQUIVALENT = Path(__file__).resolve().parent / "mutation" / "equivalent.yaml"

SURVIVORS = EQUIVALENT.with_name("survivors.yaml")


def parsed() -> argparse.Namespace:
    """Return the command line."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--room", action="append", choices=[*BY_NAME], help="of this room only; may be repeated")
    parser.add_argument("--number", metavar="N", type=int, help="try at most N that have no result yet")
    parser.add_argument("--share", metavar="S", type=float, default=1.0, help="S times as many of each room")
    parser.add_argument("--seed", metavar="N", type=int, default=0, help="choose others (default: %(default)s)")
    parser.add_argument(
        "--limit", metavar="SECONDS", type=float, default=900.0, help="of one mutant: then it is killed"
    )
    parser.add_argument("--again", choices=["survived", "killed", "timeout"], help="try those with this result again")
    parser.add_argument("--id", action="append", default=[], help="this one only, also again; may be repeated")
    parser.add_argument("--unchecked", action="store_true", help="do not try the unchanged sources first")
    parser.add_argument("--list", action="store_true", help="print the mutants and the results so far, and try none")
    parser.add_argument("--publish", action="store_true", help="write the results so far to docs/mutants.md, try none")
    return parser.parse_args()


def known(mutants: list[Mutant], again: str | None, ids: list[str]) -> dict[str, dict[str, Any]]:
    """Return the results so far of mutants that are still those of the sources."""
    if not RESULTS.exists():
        return {}
    present = {mutant.id for mutant in mutants}
    results = json.loads(RESULTS.read_text(encoding="utf-8"))
    return {
        name: found
        for name, found in results.items()
        if name in present and found["result"] != again and name not in ids
    }


def tried(mutant: Mutant, tree: Tree, limit: float) -> dict[str, Any]:
    """Run the tests of a mutant's room until one fails."""
    started = time.monotonic()
    seconds = json.loads(SECONDS.read_text(encoding="utf-8")) if SECONDS.exists() else {}
    own, others = tests_of(BY_NAME[mutant.room], mutant.file, tree.root, seconds)
    log = BUILD / "mutants" / "tests.log"
    with tree.changed(mutant.file, mutant.text) as importable:
        runs = (tree.test(tests, limit, log) for tests in (own, others) if tests)
        killer = next(filter(None, runs), "") if importable else "the package's import"
    result = "timeout" if killer == "time limit" else "killed" if killer else "survived"
    place = {name: getattr(mutant, name) for name in ("room", "file", "line", "operator", "before", "after")}
    date = time.strftime("%Y-%m-%d")
    return place | {"result": result, "by": killer, "seconds": round(time.monotonic() - started, 1), "date": date}


def sound(rooms: set[str], tree: Tree, limit: float) -> bool:
    """Try the unchanged sources with the tests of some rooms: a test that fails anyway would kill every mutant."""
    tests = sorted({test for name in rooms for tests in tests_of(BY_NAME[name], "", tree.root) for test in tests})
    print(f"the unchanged sources, {len(tests)} test files", flush=True)
    log = BUILD / "mutants" / "unchanged.log"
    killer = tree.test(tests, limit * len(rooms), log)
    if killer:
        print(f"mutants: error: the unchanged sources fail {killer}: see {log}", file=sys.stderr)
    else:
        before = json.loads(SECONDS.read_text(encoding="utf-8")) if SECONDS.exists() else {}
        SECONDS.write_text(json.dumps(before | tree.seconds(log), indent=1) + "\n", encoding="utf-8")
    return not killer


def main() -> int:
    """Try, print and return the exit status."""
    args = parsed()
    every = chosen(ROOT, args.seed, args.share)
    mutants = [mutant for mutant in every if not args.room or mutant.room in args.room]
    if args.id:
        mutants = [mutant for mutant in mutants if mutant.id in args.id]
    results = known(every, args.again, args.id)
    equivalent = _reasons(EQUIVALENT)
    left = [mutant for mutant in mutants if mutant.id not in results and mutant.id not in equivalent][: args.number]
    if args.list:
        for mutant in mutants:
            found = results.get(mutant.id, {}).get("result", "equivalent" if mutant.id in equivalent else "-")
            print(f"{mutant.id} {found:10} {mutant.file}:{mutant.line}: {mutant.before}  ->  {mutant.after}")
        return 0
    if args.publish:
        PAGE.write_text(page(ROOT, every, results, equivalent, _reasons(SURVIVORS)), encoding="utf-8")
        print(f"wrote {PAGE.relative_to(ROOT)}")
        return 0
    if left:
        (BUILD / "mutants").mkdir(parents=True, exist_ok=True)
        tree = Tree(ROOT, BUILD / "mutants")
        print(f"{len(left)} mutants in {tree.root}; compiling the kernels", flush=True)
        tree.warm_up()
        if not args.unchecked and not sound({mutant.room for mutant in left}, tree, args.limit):
            return 2
        for number, mutant in enumerate(left, 1):
            results[mutant.id] = found = tried(mutant, tree, args.limit)
            _write(results)
            print(
                f"{number}/{len(left)} {found['result']:8} {found['seconds']:5.0f} s  {mutant.file}:{mutant.line}: "
                f"{mutant.before}  ->  {mutant.after}",
                flush=True,
            )
    counted = {name: found for name, found in results.items() if name not in equivalent}
    print(summary([room.name for room in ROOMS], counted, equivalent))
    return 0 if share_killed(counted.values()) >= ENOUGH else 1


def _reasons(path: Path) -> dict[str, str]:
    return yaml.safe_load(path.read_text(encoding="utf-8")) or {}


def _write(results: dict[str, dict[str, Any]]) -> None:
    written = RESULTS.with_suffix(".part")
    written.write_text(json.dumps(results, indent=1) + "\n", encoding="utf-8")
    os.replace(written, RESULTS)


if __name__ == "__main__":
    sys.exit(main())
