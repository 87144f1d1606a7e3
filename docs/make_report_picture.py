# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Make docs/images/report.png, a picture of the page that `report` writes; needs playwright and chromium."""

from __future__ import annotations

import io
import os
import shutil
import tempfile
from pathlib import Path

from PIL import Image
from playwright.sync_api import sync_playwright

from topo_region_seg.offline.cli.main import main as tool

DOCS = Path(__file__).resolve().parent
BAG = DOCS.parent / "bags" / "tabletop_sim"
WIDTH, HEIGHT = 1280, 2010  # down to the end of the 3D view and the barcode
FRAME = 4


def main() -> None:
    """Replay the simulated recording, write its page and take the picture."""
    chromium = shutil.which("chromium") or shutil.which("chromium-browser")
    if chromium is None:
        raise SystemExit("no chromium on this machine; Debian and Ubuntu: apt-get install chromium")
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as playwright:
        run, page_file = Path(folder, "tabletop.mcap"), Path(folder, "tabletop.html")
        tool(["replay", str(BAG), "-o", str(run)])
        tool(["report", str(run), "--frames", f"0,{FRAME}"])
        arguments = ["--no-sandbox"] if os.geteuid() == 0 else []
        browser = playwright.chromium.launch(executable_path=chromium, args=arguments)
        page = browser.new_page(viewport={"width": WIDTH, "height": HEIGHT})
        page.goto(page_file.as_uri())
        page.locator(".column").nth(FRAME).click()
        page.locator(f'[data-detail="{FRAME}"]').click()
        page.mouse.move(0, 0)
        picture = Image.open(io.BytesIO(page.screenshot()))
        browser.close()
    small = picture.convert("RGB").quantize(128, dither=Image.Dither.NONE)
    small.save(DOCS / "images" / "report.png", optimize=True)


if __name__ == "__main__":
    main()
