# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The soak test's promises, whether they were kept, and the page that says so."""

from __future__ import annotations

from typing import Any

MEMORY_GROWTH_PERCENT = 3.0
SERVICE_MS = 100.0
ANSWERED_PERCENT = 95.0

DEPTH = "## With depth images"
"""Heading of the second part of the page."""

Verdict = list[tuple[str, bool, str]]


def verdict(result: dict[str, Any]) -> Verdict:
    """Return each promise, whether it was kept, and the figures that show it."""
    node, process = result["node"], result["process"]
    received, processed, dropped, rejected, lost = (
        int(node[f"clouds {what}"]) for what in ("received", "processed", "dropped", "rejected", "lost in transport")
    )
    sent = result["done"]["good"] + result["done"]["malformed"]
    memory, threads, files = process["memory_mb"], process["threads"], process["descriptors"]
    service = result["service_ms"].get("95 %", 0.0)
    return [
        (
            "no crash: exit status 0, no traceback",
            result["exit_status"] == 0 and not result["tracebacks"],
            f"status {result['exit_status']}, {result['tracebacks']} tracebacks",
        ),
        (
            "every cloud received is answered, dropped or rejected",
            received == processed + dropped + rejected,
            f"{received} = {processed} + {dropped} + {rejected}",
        ),
        (
            "every cloud sent is received or counted as lost in transport",
            sent == received + lost,
            f"{sent} = {received} + {lost}",
        ),
        (
            f"at least {ANSWERED_PERCENT:g} % of the good frames are answered, but for bursts and lost transforms",
            100.0 * result["due_and_answered"] >= ANSWERED_PERCENT * result["due"],
            f"{result['due_and_answered']} of {result['due']}",
        ),
        (
            "no internal error",
            "rejected: internal_error" not in node,
            ", ".join(f"{key} {value}" for key, value in node.items() if key.startswith("rejected: ")) or "none",
        ),
        (
            f"memory grows by less than {MEMORY_GROWTH_PERCENT:g} %",
            memory["growth_percent"] < MEMORY_GROWTH_PERCENT,
            f"{memory['start']} MB to {memory['end']} MB, {memory['growth_percent']:+} %",
        ),
        ("no thread left over", threads["end"] <= threads["start"], f"{threads['start']:g} to {threads['end']:g}"),
        ("no descriptor left over", files["end"] <= files["start"], f"{files['start']:g} to {files['end']:g}"),
        (
            f"parameter services answer within {SERVICE_MS:g} ms (95 %)",
            service < SERVICE_MS,
            f"{service} ms; max {result['service_ms'].get('max', 0.0)} ms",
        ),
    ]


def with_part(page: str, result: dict[str, Any]) -> str:
    """Return a page with the part that a run belongs to in place of the one that was there."""
    clouds, found, images = page.partition(DEPTH)
    parts = [clouds, found + images]
    parts[result["input"] == "depth"] = markdown(result)
    return "\n\n".join(part.strip() for part in parts if part.strip()) + "\n"


def markdown(result: dict[str, Any]) -> str:
    """Return the part of the page that shows a run."""
    machine, node, done = result["machine"], result["node"], result["done"]
    depth = result["input"] == "depth"
    options, frames = (" --input depth", "depth and color images") if depth else ("", "clouds of 4.9 MB")
    lines = [
        DEPTH if depth else "# Soak test",
        "",
        f"`python -m benchmarks.soak --minutes {result['minutes']:g}{options}` wrote this page: one node, VGA {frames}"
        f" at {result['hz']['wanted']:g} Hz",
        f"(reached: {result['hz']['reached']:g} Hz; sender and node share the machine), one in fifty malformed.",
        f"{machine['cpu']}, {machine['cores']} cores, Python {machine['python']}, commit {machine['commit']}.",
        "",
        "| promise | kept | figures |",
        "|---|---|---|",
        *(f"| {name} | {'yes' if kept else '**no**'} | {figures} |" for name, kept, figures in result["verdict"]),
        "",
        "| what happened | count |",
        "|---|---|",
        *(f"| {name} | {count} |" for name, count in done.items()),
        *(f"| {name} | {value} |" for name, value in node.items() if name.startswith(("clouds", "rejected"))),
        f"| labels received by the sender | {result['labels_received']} |",
        f"| lines in the node's log | {result['log_lines']} |",
        "",
        "| time, ms | median | 95 % | 99 % | max |",
        "|---|---|---|---|---|",
        _times("cloud sent to labels received", result["latency_ms"]),
        _times("set of parameters, while clouds are processed", result["service_ms"]),
        "",
        "Clouds that come faster than they are processed are dropped by design: the newest wins. Memory is the median",
        "over a tenth of the run, after its first fifth and at its end. Threads and files are counted while idle.",
        "",
    ]
    return "\n".join(lines)


def _times(name: str, times: dict[str, float]) -> str:
    return f"| {name} | {' | '.join(str(times.get(key, '')) for key in ('median', '95 %', '99 %', 'max'))} |"
