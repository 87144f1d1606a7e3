# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""With --strict-skips or CI=true, a test that is skipped for a reason not listed in allowed_skips.txt fails the run."""

from __future__ import annotations

import os

import pytest
from places import TEST

ALLOWED = [
    line
    for line in (TEST / "allowed_skips.txt").read_text(encoding="utf-8").splitlines()
    if line and not line.startswith("#")
]


class StrictSkips:
    """Collects what is skipped for a reason that is not allowed, and fails the run at its end."""

    def __init__(self) -> None:
        self.wrong: list[str] = []

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        self._note(report)

    def pytest_collectreport(self, report: pytest.CollectReport) -> None:
        self._note(report)

    def _note(self, report: pytest.TestReport | pytest.CollectReport) -> None:
        if not report.skipped or hasattr(report, "wasxfail"):
            return
        reason = report.longrepr[2] if isinstance(report.longrepr, tuple) else str(report.longrepr)
        if not any(allowed in reason for allowed in ALLOWED):
            self.wrong.append(f"{report.nodeid}: {reason.removeprefix('Skipped: ')}")

    def pytest_sessionfinish(self, session: pytest.Session, exitstatus: int) -> None:
        if self.wrong and exitstatus in (pytest.ExitCode.OK, pytest.ExitCode.NO_TESTS_COLLECTED):
            session.exitstatus = pytest.ExitCode.TESTS_FAILED

    def pytest_terminal_summary(self, terminalreporter: pytest.TerminalReporter) -> None:
        if self.wrong:
            terminalreporter.section("skipped for reasons that are not in test/allowed_skips.txt", red=True)
            for line in self.wrong:
                terminalreporter.line(line)


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--strict-skips", action="store_true", help="fail where a skip is not in test/allowed_skips.txt")


def pytest_configure(config: pytest.Config) -> None:
    if config.getoption("--strict-skips") or os.environ.get("CI", "").lower() in ("1", "true"):
        config.pluginmanager.register(StrictSkips())
