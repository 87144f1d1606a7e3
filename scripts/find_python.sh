#!/usr/bin/env bash
# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
# Prints the first Python of the wanted versions that really runs and can make a virtual environment.
# usage: find_python.sh 3.12 3.13 ...
set -u

# A version manager's shim may be on the PATH and yet start nothing, so each candidate is run before it is believed.
usable() {
  local check="import sys, venv, ensurepip; sys.exit('%d.%d' % sys.version_info[:2] not in sys.argv[1:])"
  "$1" -c "$check" "${wanted[@]}" >/dev/null 2>&1
}

wanted=("$@")
for version in "${wanted[@]}"; do
  for candidate in "python$version" "${PYENV_ROOT:-$HOME/.pyenv}"/versions/"$version".*/bin/python; do
    if usable "$candidate"; then
      command -v "$candidate"
      exit 0
    fi
  done
done
if usable python3; then
  command -v python3
  exit 0
fi
echo "no usable Python among ${wanted[*]} found: install one with its venv module (on Ubuntu: python3-venv)," \
  "or name one: make PYTHON=/path/to/python ..." >&2
exit 1
