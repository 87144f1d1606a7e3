# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The plane that carries the objects, and what is removed with it (paper, section V)."""
