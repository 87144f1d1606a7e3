#!/usr/bin/env bash
# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
# Runs a command, saying first what it is for and afterwards how long it took.
# usage: step.sh "what it does" command argument...
set -u
printf '==> %s\n' "$1"
started=$SECONDS
"${@:2}"
status=$?
if [ "$status" -eq 0 ]; then
  printf '    done in %d s: %s\n' "$((SECONDS - started))" "$1"
else
  printf '    FAILED after %d s: %s\n' "$((SECONDS - started))" "$1" >&2
fi
exit "$status"
