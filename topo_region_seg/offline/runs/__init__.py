# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Runs: recordings that a replay wrote, with a record of how; read again, and compared frame by frame."""
