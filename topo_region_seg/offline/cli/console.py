# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""What the commands show: tables on standard output, progress and notes on standard error."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

from topo_region_seg.offline.cli.status import ToolError

if TYPE_CHECKING:
    from rich.console import Console

PICTURES = (".png", ".pdf", ".svg")
"""Endings of pictures."""
PLAIN_WIDTH = 120
"""Columns of a table that goes to a file or a pipe."""


def output() -> Console:
    """Return a console on standard output."""
    from rich.console import Console

    return Console(highlight=False, width=None if sys.stdout.isatty() else PLAIN_WIDTH)


def has_rich() -> bool:
    """Whether the package that draws tables and progress bars is installed."""
    try:
        return find_spec("rich") is not None
    except ImportError:
        return False


def note(text: str) -> None:
    """Print a line beside the result."""
    print(text, file=sys.stderr)


class Steps(Protocol):
    """Counts finished steps."""

    def __call__(self, text: str = "") -> None:
        """Count one more, with a few words about it."""


@contextmanager
def progress(what: str, total: int | None) -> Iterator[Steps]:
    """Show a progress bar, on a terminal only; `total` is None where the number of steps is not known."""
    if not sys.stderr.isatty():
        yield lambda text="": None
        return
    from rich.console import Console
    from rich.progress import (
        BarColumn,
        MofNCompleteColumn,
        Progress,
        TextColumn,
        TimeElapsedColumn,
        TimeRemainingColumn,
    )

    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
        TimeRemainingColumn(),
        TextColumn("{task.fields[text]}"),
    )
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(what, total=total, text="")
        yield lambda text="": bar.update(task, advance=1, text=text)


@contextmanager
def waiting(text: str, *, always: bool = False) -> Iterator[None]:
    """Show that something takes a while, and how long it has taken so far.

    Parameters
    ----------
    text : str
        What is done.
    always : bool
        Print a line where standard error is no terminal, too.
    """
    if not sys.stderr.isatty() or not has_rich():
        if always or sys.stderr.isatty():
            note(f"{text} ...")
        yield
        return
    from rich.console import Console
    from rich.progress import Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

    columns = (SpinnerColumn(), TextColumn("{task.description}"), TimeElapsedColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True) as shown:
        shown.add_task(text, total=None)
        yield


@contextmanager
def loading_kernels() -> Iterator[None]:
    """Show that the compiled kernels are loaded."""
    with waiting("loading the compiled kernels (the first run compiles them, which takes a minute)"):
        yield


def check_writable(path: Path, suffixes: tuple[str, ...] = ()) -> None:
    """Raise :class:`ToolError` if no file can be made at `path`; called before the work begins."""
    if suffixes and path.suffix.lower() not in suffixes:
        raise ToolError(f"{path}: the name must end in {', '.join(suffixes)}; choose another name")
    if path.is_dir():
        raise ToolError(f"{path}: is a folder; give the name of a file")
    folder = path.parent
    if not folder.is_dir() or not os.access(folder, os.W_OK):
        raise ToolError(f"{path}: the folder {folder} is missing or not writable; choose another place")


def check_picture(path: Path | None) -> None:
    """Check before the work that a picture can be drawn and written to `path`, if there is one.

    Raises
    ------
    ToolError
        No such file can be made.
    ImportError
        The package that draws is missing.
    """
    if path is not None:
        check_writable(path, PICTURES)
        import topo_region_seg.offline.figures.barcode  # noqa: F401


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
