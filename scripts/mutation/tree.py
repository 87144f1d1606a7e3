# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""A copy of the project in which the wrong changes are made, with compiled kernels of its own."""

from __future__ import annotations

import ast
import os
import resource
import shutil
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from functools import partial
from pathlib import Path
from xml.etree import ElementTree

from mutation.rooms import PACKAGE

CPU_LIMIT = 240
"""Seconds of processor time for the tests of one mutant: one that never ends uses them up, however busy the machine."""
PLUGINS = ("-p", "pytest_timeout", "-p", "_hypothesis_pytestplugin")
"""What the tests need of pytest's plugins: to load all that are installed takes longer than most tests."""
WHERE = "from topo_region_seg.compiled.cache import cache_folder; print(cache_folder())"
WARM_UP = "from topo_region_seg.pipeline import warm_up; warm_up()"


class Tree:
    """The sources as they are in the checkout, changes that are not committed included, in a folder of their own.

    Compiled kernels are taken over from the unchanged sources unless they may hold code of the changed module: numba
    itself looks at the file of the outermost kernel only.
    """

    def __init__(self, checkout: Path, place: Path) -> None:
        self.root = place / "tree"
        self._caches = place / "kernels"
        listed = subprocess.run(
            ["git", "-C", checkout, "ls-files", "-z", "--cached", "--others", "--exclude-standard"],
            capture_output=True,
            check=True,
            text=True,
        ).stdout
        names = {name for name in listed.split("\0") if name and (checkout / name).is_file()}
        for name in names:
            self._copy(checkout / name, self.root / name)
        for old in self.root.rglob("*.py"):
            if old.relative_to(self.root).as_posix() not in names:
                old.unlink()
        self.environment = os.environ | {
            "PYTHONPATH": str(self.root),
            "PYTHONDONTWRITEBYTECODE": "1",
            "PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1",
            "NUMBA_CACHE_DIR": str(self._caches),
            "HYPOTHESIS_STORAGE_DIRECTORY": str(place / "hypothesis"),
        }
        self._importers = self._read_imports()

    @staticmethod
    def _copy(source: Path, target: Path) -> None:
        target.parent.mkdir(parents=True, exist_ok=True)
        if not target.exists() or target.read_bytes() != source.read_bytes():
            shutil.copy2(source, target)

    def warm_up(self) -> None:
        """Compile the kernels of the unchanged sources, and delete all others."""
        subprocess.run([sys.executable, "-c", WARM_UP], cwd=self.root, env=self.environment, check=True)
        self._base = self._cache_folder()
        assert self._base is not None
        for folder in self._base.parent.iterdir():
            if folder != self._base:
                shutil.rmtree(folder)

    @contextmanager
    def changed(self, file: str, text: str) -> Iterator[bool]:
        """Hold a wrong change of one module; yields False where the package cannot even be imported."""
        path = self.root / PACKAGE / file
        original, times = path.read_bytes(), path.stat()
        path.write_text(text, encoding="utf-8")
        cache = None
        try:
            cache = self._cache_folder()
            if cache is not None and cache != self._base:
                shutil.rmtree(cache, ignore_errors=True)
                shutil.copytree(self._base, cache, copy_function=os.link, ignore=self._outdated(file))
            yield cache is not None
        finally:
            path.write_bytes(original)
            os.utime(path, ns=(times.st_atime_ns, times.st_mtime_ns))
            if cache is not None and cache != self._base:
                shutil.rmtree(cache, ignore_errors=True)

    def test(self, tests: list[str], limit: float, log: Path) -> str:
        """Run tests until the first that fails; return its name, "" if all pass, or why it is not known."""
        command = [sys.executable, "-m", "pytest", "-x", "-q", "-p", "no:cacheprovider", "--no-header"]
        command += [*PLUGINS, f"--junit-xml={log.with_suffix('.xml')}", *tests]
        with log.open("w", encoding="utf-8") as output:
            process = subprocess.Popen(
                command,
                cwd=self.root,
                env=self.environment,
                stdout=output,
                stderr=output,
                start_new_session=True,
                preexec_fn=partial(resource.setrlimit, resource.RLIMIT_CPU, (CPU_LIMIT, CPU_LIMIT)),
            )
            try:
                status = process.wait(limit)
            except subprocess.TimeoutExpired:
                return "time limit"
            finally:
                with_children_ended(process)
        if status == -signal.SIGKILL or status == -signal.SIGXCPU:
            return "time limit"
        if status == 0:
            return ""
        for line in log.read_text(encoding="utf-8", errors="replace").splitlines():
            if line.startswith(("FAILED ", "ERROR ")):
                return line.split(" ", 1)[1].partition(" - ")[0]
        return f"exit status {status}"

    def seconds(self, log: Path) -> dict[str, float]:
        """Return how long each test file took in the run that wrote a log."""
        found: dict[str, float] = {}
        for case in ElementTree.parse(log.with_suffix(".xml")).iter("testcase"):
            parts = case.attrib["classname"].split(".")
            names = ("/".join(parts[:end]) + ".py" for end in range(len(parts), 0, -1))
            name = next((name for name in names if (self.root / name).is_file()), "")
            found[name] = found.get(name, 0.0) + float(case.attrib["time"])
        return found

    def _cache_folder(self) -> Path | None:
        found = subprocess.run(
            [sys.executable, "-c", WHERE], cwd=self.root, env=self.environment, capture_output=True, text=True
        )
        return Path(found.stdout.strip()) if found.returncode == 0 else None

    def _outdated(self, file: str):  # type: ignore[no-untyped-def]
        """Return what shutil shall leave out: kernels of the changed module and of all that import it."""
        changed = _module(file)
        stale, new = {changed}, [changed]
        while new:
            new = [module for module in self._importers.get(new.pop(), ()) if module not in stale] + new
            stale.update(new)
        stems = {(module.split(".")[-2], module.split(".")[-1]) for module in stale if "." in module}

        def ignore(folder: str, names: list[str]) -> list[str]:
            room = Path(folder).name.rpartition("_")[0]
            return [name for name in names if (room, name.split(".")[0]) in stems]

        return ignore

    def _read_imports(self) -> dict[str, set[str]]:
        importers: dict[str, set[str]] = {}
        for path in (self.root / PACKAGE).rglob("*.py"):
            module = _module(path.relative_to(self.root / PACKAGE).as_posix())
            for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
                if isinstance(node, ast.ImportFrom) and (node.module or "").startswith(PACKAGE):
                    for imported in (node.module, *(f"{node.module}.{alias.name}" for alias in node.names)):
                        importers.setdefault(str(imported), set()).add(module)
        return importers


def with_children_ended(process: subprocess.Popen[bytes]) -> None:
    """End a process and all that it started in its session."""
    with suppress(ProcessLookupError):
        os.killpg(process.pid, signal.SIGKILL)
    process.wait()


def _module(file: str) -> str:
    return ".".join((PACKAGE, *Path(file).with_suffix("").parts)).removesuffix(".__init__")
