# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Compiled kernels: free functions over flat arrays, no validation, no orchestration."""
