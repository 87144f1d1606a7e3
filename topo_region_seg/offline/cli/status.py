# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""How the commands end."""

from __future__ import annotations

DONE = 0
FAILED = 1
"""Some frames or files failed; the command said which."""
USAGE = 2
"""The command line or the input it names is wrong."""
TRUNCATED = 3
"""The input is cut short; all complete messages were processed."""
INTERRUPTED = 130
"""Ended by Ctrl-C: 128 and the number of the signal, as in shells."""


class ToolError(Exception):
    """A command cannot go on; the message is one line with the file or option, the reason and how to fix it."""
