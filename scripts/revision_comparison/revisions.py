# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The sources of a revision, and the process that runs them."""

from __future__ import annotations

import io
import json
import os
import subprocess
import sys
import tarfile
import tempfile
from pathlib import Path
from types import TracebackType
from typing import Any

from revision_comparison.inputs import ROOT

WORKER = Path(__file__).with_name("worker.py")
KEPT = ROOT / "build" / "revisions"


class RevisionError(Exception):
    """A revision cannot be had or run; one line with the reason."""


def unpacked(revision: str) -> Path:
    """Return a folder with the package as of `revision`; it is kept, as its kernels are compiled only once there."""
    git = subprocess.run(
        ["git", "rev-parse", "--verify", "--quiet", f"{revision}^{{commit}}"], cwd=ROOT, capture_output=True, text=True
    )
    if git.returncode:
        raise RevisionError(f"{revision}: git knows no such revision; give a branch, a tag or a commit")
    commit = git.stdout.strip()
    folder = KEPT / commit[:12]
    if not folder.exists():
        archive = subprocess.run(
            ["git", "archive", commit, "topo_region_seg"], cwd=ROOT, capture_output=True, check=True
        ).stdout
        KEPT.mkdir(parents=True, exist_ok=True)
        made = Path(tempfile.mkdtemp(dir=KEPT))
        with tarfile.open(fileobj=io.BytesIO(archive)) as tar:
            tar.extractall(made, filter="data")
        made.rename(folder)
    return folder


class Worker:
    """A process with the package of one folder; requests are sent first and answered later, so two can work at once."""

    def __init__(self, tree: Path) -> None:
        path = os.pathsep.join(part for part in (str(tree), os.environ.get("PYTHONPATH", "")) if part)
        self.tree = tree
        self._log = tempfile.TemporaryFile("w+")  # noqa: SIM115  (closed by __exit__)
        self._process = subprocess.Popen(
            [sys.executable, str(WORKER), str(tree)],
            cwd=tree,
            env={**os.environ, "PYTHONPATH": path},
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self._log,
            text=True,
            bufsize=1,
        )

    def send(self, request: dict[str, Any]) -> None:
        """Send a request; one that cannot be sent is noticed by `receive`."""
        assert self._process.stdin is not None
        try:
            self._process.stdin.write(json.dumps(request) + "\n")
        except BrokenPipeError:
            return

    def receive(self) -> dict[str, Any]:
        """Wait for the answer to a request.

        Raises
        ------
        RevisionError
            The process has ended.
        """
        assert self._process.stdout is not None
        line = self._process.stdout.readline()
        if not line:
            self._log.seek(0)
            last = (self._log.read().strip().splitlines() or ["it said nothing"])[-1]
            raise RevisionError(f"{self.tree}: the worker ended with status {self._process.wait()}: {last}")
        answer: dict[str, Any] = json.loads(line)
        return answer

    def ask(self, request: dict[str, Any]) -> dict[str, Any]:
        """Send a request and wait for its answer."""
        self.send(request)
        return self.receive()

    def __enter__(self) -> Worker:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        assert self._process.stdin is not None and self._process.stdout is not None
        self._process.stdin.close()
        if kind is not None:
            self._process.kill()
        self._process.wait()
        self._process.stdout.close()
        self._log.close()
