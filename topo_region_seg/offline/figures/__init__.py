# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Figures with Matplotlib: clouds before and after, barcodes, differences between runs, and sweeps."""
