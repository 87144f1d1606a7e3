# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The filtration and its zeroth persistent homology (paper, sections IV.A, IV.B and IV.D)."""
