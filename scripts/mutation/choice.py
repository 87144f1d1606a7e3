# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Which of all wrong changes are tried: the same ones each time, also after other lines of a file have changed."""

from __future__ import annotations

import hashlib
from collections import Counter
from dataclasses import dataclass
from itertools import zip_longest
from pathlib import Path

from mutation.operators import Edit, edits
from mutation.rooms import PACKAGE, ROOMS, Room

PER_FILE = 12
"""Most mutants of one file."""


@dataclass(frozen=True)
class Mutant:
    """One wrong change: where, of which kind, and the text of its file with it."""

    id: str
    room: str
    file: str
    line: int
    operator: str
    before: str
    after: str
    text: str


def chosen(root: Path, seed: int, share: float = 1.0) -> list[Mutant]:
    """Return the mutants of all rooms in turn, so that any first part of the list is a fair sample.

    Parameters
    ----------
    root : Path
        Folder that holds the package.
    seed : int
        Another number chooses other mutants.
    share : float
        Multiplies the number of mutants of each room.
    """
    of_rooms = [_of_room(root, room, seed, round(share * room.mutants)) for room in ROOMS]
    return [mutant for row in zip_longest(*of_rooms) for mutant in row if mutant is not None]


def _of_room(root: Path, room: Room, seed: int, number: int) -> list[Mutant]:
    found = [mutant for file in room.files(root) for mutant in _of_file(root, room, file, seed)]
    taken: list[Mutant] = []
    of_file: Counter[str] = Counter()
    for mutant in sorted(found, key=lambda mutant: mutant.id):
        if len(taken) < number and of_file[mutant.file] < PER_FILE:
            of_file[mutant.file] += 1
            taken.append(mutant)
    return taken


def _of_file(root: Path, room: Room, file: str, seed: int) -> list[Mutant]:
    text = (root / PACKAGE / file).read_text(encoding="utf-8")
    seen: Counter[str] = Counter()
    return [_mutant(room.name, file, text, edit, seed, seen) for edit in edits(text)]


def _mutant(room: str, file: str, text: str, edit: Edit, seed: int, seen: Counter[str]) -> Mutant:
    changed = text[: edit.start] + edit.text + text[edit.end :]
    start = text.rfind("\n", 0, edit.start) + 1
    end = text.find("\n", edit.end)
    before = text[start:end].strip()
    after = changed[start : end + len(changed) - len(text)].strip()
    name = f"{seed}|{file}|{edit.operator}|{before}|{after}"
    seen[name] += 1
    digest = hashlib.sha256(f"{name}|{seen[name]}".encode()).hexdigest()[:10]
    return Mutant(digest, room, file, text.count("\n", 0, edit.start) + 1, edit.operator, before, after, changed)
