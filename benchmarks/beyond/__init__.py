# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Measure what goes beyond the paper: one part per capability, each writes its tables into its document in docs/."""
