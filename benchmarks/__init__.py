# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Every figure that the project says it reaches, measured beside other programs: `python -m benchmarks`."""
