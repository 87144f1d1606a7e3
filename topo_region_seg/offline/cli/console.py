# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""What the commands show: tables on standard output, progress and notes on standard error."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Protocol

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

from topo_region_seg.offline.cli.status import ToolError

PLAIN_WIDTH = 120
"""Columns of a table that goes to a file or a pipe."""


def output() -> Console:
    """Return a console on standard output."""
    return Console(highlight=False, width=None if sys.stdout.isatty() else PLAIN_WIDTH)


def note(text: str) -> None:
    """Say something beside the result."""
    print(text, file=sys.stderr)


class Steps(Protocol):
    """Counts finished steps."""

    def __call__(self, text: str = "") -> None:
        """Count one more, with a few words about it."""


@contextmanager
def progress(what: str, total: int | None) -> Iterator[Steps]:
    """Show a progress bar, on a terminal only; `total` is None where the end is not known."""
    console = Console(stderr=True)
    if not console.is_terminal:
        yield lambda text="": None
        return
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
        TimeRemainingColumn(),
        TextColumn("{task.fields[text]}"),
    )
    with Progress(*columns, console=console, transient=True) as bar:
        task = bar.add_task(what, total=total, text="")
        yield lambda text="": bar.update(task, advance=1, text=text)


@contextmanager
def waiting(text: str) -> Iterator[None]:
    """Show on a terminal that something takes a while."""
    console = Console(stderr=True)
    if not console.is_terminal:
        yield
        return
    with console.status(text):
        yield


def check_writable(path: Path, suffixes: tuple[str, ...] = ()) -> None:
    """Raise :class:`ToolError` if no file can be made at `path`; for use before the work."""
    if suffixes and path.suffix.lower() not in suffixes:
        raise ToolError(f"{path}: has to end in {', '.join(suffixes)}; choose another name")
    if path.is_dir():
        raise ToolError(f"{path}: is a folder; give the name of a file")
    folder = path.parent
    if not folder.is_dir() or not os.access(folder, os.W_OK):
        raise ToolError(f"{path}: the folder {folder} is missing or not writable; choose another place")


def write_whole(path: Path, text: str) -> None:
    """Write a text file, whole or not at all."""
    temporary = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        temporary.write_text(text, encoding="utf-8")
        os.replace(temporary, path)
    except OSError as error:
        raise ToolError(f"{path}: cannot be written ({error.strerror}); make room or choose another place") from None
    finally:
        temporary.unlink(missing_ok=True)
