# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Runs: recordings written by ``replay``, with a record of how they were made; read back and compared by frame."""
