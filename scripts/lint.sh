#!/usr/bin/env bash
# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
# Every linter in turn, all of them even when one complains; the status tells whether any did.
set -u
sources=(topo_region_seg launch test benchmarks scripts setup.py)
status=0

run() {
  echo "  $*"
  "$@" || status=1
}

# The ament linters also list every file and folder that they open.
run_ament() {
  echo "  $*"
  "$@" 2>&1 | grep -vE '^(checking|directory) '
  [ "${PIPESTATUS[0]}" -eq 0 ] || status=1
}

run ruff check --quiet .
run ruff format --quiet --check .
run mypy --no-error-summary
# D401 is ruff's: ament_pep257 takes properties for functions.
run_ament ament_pep257 --add-ignore D213 D401 D413 -- topo_region_seg
run_ament ament_pycodestyle --config setup.cfg "${sources[@]}"
# ament_xmllint fetches the schema that package.xml names. Without a network only the form is checked here; the test suite
# checks the content with catkin_pkg.
if ! command -v xmllint >/dev/null; then
  echo "  ament_xmllint: skipped, no xmllint on this machine (Debian and Ubuntu: libxml2-utils)"
elif ament_xmllint package.xml 2>&1 | grep -q 'failed to load external entity'; then
  echo "  ament_xmllint: the schema cannot be fetched"
  run xmllint --nonet --noout package.xml
else
  run_ament ament_xmllint package.xml
fi
exit "$status"
