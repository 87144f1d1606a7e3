# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""How kernels are compiled, and what several steps share: tree, union-find, threads."""
