# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Objects on all data sets, beside other programs: ``python -m benchmarks.objects``."""
