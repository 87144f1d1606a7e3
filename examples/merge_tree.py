# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""One filtration, all scales: the merge tree, the paper's ten steps, and cuts.

Needs numpy, scipy and numba.
"""

import numpy as np

import topo_region_seg as trs


def main() -> None:
    """Follow two patches of points, 7 mm apart, from single points to one component."""
    side = 0.0015 * np.arange(30)
    x, y = (grid.ravel() for grid in np.meshgrid(side, side))
    xyz = np.column_stack([np.append(x, x + side[-1] + 0.007), np.append(y, y), np.full(2 * len(x), 0.8)])
    lab, normals = np.full_like(xyz, 50.0), np.tile([0.0, 0.0, -1.0], (len(xyz), 1))
    params = trs.Params(max_radius=0.02)

    tree = trs.persistent_components(xyz, lab, normals, params)
    print(f"{len(xyz)} points, {np.count_nonzero(np.isinf(tree.death))} component at {tree.max_radius} m")
    last = np.max(tree.death[np.isfinite(tree.death)])
    print(f"the last two components meet at {1e3 * last:.1f} mm")
    print("components at the paper's ten steps:", *tree.counts(10))

    for radius in (0.001, 0.004, 0.012):  # no new filtration: a cut of the same tree
        print(f"cut at {1e3 * radius:g} mm: {len(np.unique(tree.cut(radius).root))} components")
    print(f"two components up to {1e3 * tree.cut(regions=2).max_radius:.1f} mm")


if __name__ == "__main__":
    main()
