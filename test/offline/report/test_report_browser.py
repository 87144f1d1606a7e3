# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""The page of a run in a real browser: the system's chromium, without a window."""

from __future__ import annotations

import io
import os
import shutil
from contextlib import contextmanager

import numpy as np
import pytest
from PIL import Image
from report_maker import hostile_page, sim_page

CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
if CHROMIUM is None:
    pytest.skip("no chromium on this machine (Debian: apt-get install chromium)", allow_module_level=True)
sync_api = pytest.importorskip("playwright.sync_api", reason="playwright is not installed: pip install '.[test]'")

DESKTOP = {"viewport": {"width": 1280, "height": 900}}
PHONE = {"viewport": {"width": 360, "height": 740}, "is_mobile": True, "has_touch": True, "device_scale_factor": 2}


@pytest.fixture(scope="module")
def browser():
    with sync_api.sync_playwright() as playwright:
        # Where tests run as root, as in containers, chromium's sandbox refuses to.
        arguments = ["--no-sandbox"] if os.geteuid() == 0 else []
        found = playwright.chromium.launch(executable_path=CHROMIUM, args=arguments, timeout=120_000)
        yield found
        found.close()


@pytest.fixture(scope="module")
def sim(tmp_path_factory):
    return sim_page(tmp_path_factory.mktemp("sim"), "--frames", "0,4")


@contextmanager
def opened(browser, path, **options):
    """Open a page; nothing but the page itself may be asked for, and nothing may go wrong."""
    context = browser.new_context(**(options or DESKTOP))
    context.set_default_timeout(60_000)
    page = context.new_page()
    wrong = []
    page.on("console", lambda message: wrong.append(message.text) if message.type in ("error", "warning") else None)
    page.on("pageerror", lambda error: wrong.append(str(error)))
    page.on("dialog", lambda dialog: wrong.append(dialog.message))
    asked = []
    page.on("request", lambda request: asked.append(request.url))
    page.goto(path.as_uri())
    yield page
    assert wrong == []
    assert [url for url in asked if not url.startswith("data:")] == [path.as_uri()]
    context.close()


def pixels(page):
    """Return the 3D view as drawn, (H, W, 3), after the frames that it has asked for."""
    page.evaluate("new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)))")
    return np.asarray(Image.open(io.BytesIO(page.locator("#view").screenshot())).convert("RGB")).astype(int)


def differ(before, after):
    return (np.abs(before - after).max(axis=2) > 30).mean()


def test_charts_are_drawn(browser, sim):
    with opened(browser, sim) as page:
        assert page.locator(".chart").count() == 3
        for name, drawn in (("regions", "rect[fill]"), ("time", "rect[fill]"), ("quality", "polyline")):
            shapes = page.locator(f'.chart[data-chart="{name}"] svg[role="img"] {drawn}')
            assert shapes.count() >= 3
            boxes = [shapes.nth(i).bounding_box() for i in range(shapes.count())]
            assert all(box["width"] > 3 for box in boxes) and max(box["height"] for box in boxes) > 20
        bars = page.locator('.chart[data-chart="regions"] rect[fill="var(--bar)"]')
        heights = [bars.nth(i).bounding_box()["height"] for i in range(bars.count())]
        counts = page.evaluate("run.frames.map(frame => frame.regions)")
        np.testing.assert_allclose(np.array(heights) / max(heights), np.array(counts) / max(counts), atol=0.02)
        assert page.locator("#bars svg path").count() >= 5 and page.locator("#bars svg rect").count() > 40


def test_pictures_are_shown_frame_by_frame(browser, sim):
    with opened(browser, sim) as page:
        shown = page.locator(".frame:visible")
        assert shown.count() == 1 and "Frame 0" in shown.text_content()
        page.wait_for_function("[...document.images].every(image => image.complete && image.naturalWidth > 100)")
        page.locator("#next").click()
        assert "Frame 1" in shown.text_content()
        page.locator("#frame").focus()
        page.keyboard.press("End")
        assert shown.count() == 1 and "Frame 5" in shown.text_content()
        page.locator('.chart[data-chart="time"] .column').nth(2).click()
        assert "Frame 2" in shown.text_content()


def test_the_3d_view_turns_by_mouse_and_keyboard(browser, sim):
    with opened(browser, sim) as page:
        view = page.locator("#view")
        view.scroll_into_view_if_needed()
        first = pixels(page)
        assert len(np.unique(first.reshape(-1, 3), axis=0)) > 20
        assert differ(first, pixels(page)) == 0
        box = view.bounding_box()
        page.mouse.move(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
        page.mouse.down()
        page.mouse.move(box["x"] + box["width"] / 2 + 90, box["y"] + box["height"] / 2, steps=4)
        page.mouse.up()
        dragged = pixels(page)
        assert differ(first, dragged) > 0.05
        view.focus()
        page.keyboard.press("ArrowLeft")
        turned = pixels(page)
        assert differ(dragged, turned) > 0.02
        page.keyboard.press("ArrowUp")
        assert differ(turned, pixels(page)) > 0.02
        page.keyboard.press("Home")
        assert differ(first, pixels(page)) < 0.01
        page.keyboard.press("+")
        assert differ(first, pixels(page)) > 0.02


def test_the_3d_view_shows_other_frames_and_colors(browser, sim):
    with opened(browser, sim) as page:
        page.locator("#view").scroll_into_view_if_needed()
        first = pixels(page)
        page.locator('[data-mode="rgb"]').click()
        assert differ(first, pixels(page)) > 0.05
        page.locator('[data-detail="4"]').click()
        page.locator('[data-mode="label"]').click()
        assert page.locator('[data-detail="4"]').get_attribute("aria-pressed") == "true"
        assert differ(first, pixels(page)) > 0.02


def test_the_3d_view_turns_by_touch(browser, sim):
    with opened(browser, sim, **PHONE) as page:
        page.locator("#view").scroll_into_view_if_needed()
        first, box = pixels(page), page.locator("#view").bounding_box()
        x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
        client = page.context.new_cdp_session(page)
        for kind, across in (("touchStart", 0), ("touchMove", 30), ("touchMove", 80), ("touchEnd", None)):
            points = [] if across is None else [{"x": x + across, "y": y}]
            client.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})
        assert differ(first, pixels(page)) > 0.02


@pytest.mark.parametrize("kind", ["sim", "hostile"])
def test_a_phone_needs_no_sideways_scrolling(browser, sim, tmp_path, kind):
    with opened(browser, sim if kind == "sim" else hostile_page(tmp_path), **PHONE) as page:
        assert page.evaluate("document.documentElement.scrollWidth") <= 360
        # Wide tables scroll by themselves.
        assert page.evaluate("Math.max(...[...document.querySelectorAll('.scroll')].map(e => e.clientWidth))") <= 360


def luminance(page, selector, what):
    color = page.evaluate(
        "([selector, what]) => getComputedStyle(document.querySelector(selector))[what]", [selector, what]
    )
    channel = np.array([float(part) for part in color.strip("rgba()").split(",")[:3]]) / 255
    linear = np.where(channel <= 0.04045, channel / 12.92, ((channel + 0.055) / 1.055) ** 2.4)
    return float(linear @ [0.2126, 0.7152, 0.0722])


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_text_is_readable_in_light_and_in_dark(browser, sim, scheme):
    with opened(browser, sim, **DESKTOP, color_scheme=scheme) as page:
        back = luminance(page, "body", "backgroundColor")
        assert (back > 0.8) if scheme == "light" else (back < 0.05)
        for selector, what in (("p.lead", "color"), (".hint", "color"), ("nav a", "color"), ("svg text", "fill")):
            low, high = sorted((back, luminance(page, selector, what)))
            assert (high + 0.05) / (low + 0.05) >= 4.5, selector  # WCAG 2.2, level AA


def test_every_control_is_reached_by_keyboard_and_has_a_name(browser, sim):
    with opened(browser, sim) as page:
        wanted = page.locator("button:visible, input:visible, canvas, .scroll").count()
        reached = set()
        for _ in range(wanted + 20):
            page.keyboard.press("Tab")
            state = page.evaluate(
                """() => { const e = document.activeElement, s = getComputedStyle(e); window.order ??= new Map();
                if (!order.has(e)) order.set(e, order.size);
                return [order.get(e), e.tagName, e.getAttribute('aria-label') || e.textContent, s.outlineStyle]; }"""
            )
            if state[1] in ("BUTTON", "INPUT", "CANVAS", "DIV"):
                assert state[2].strip() and state[3] == "solid", state
                reached.add(state[0])
        assert len(reached) == wanted


def test_attacks_in_a_recording_do_nothing(browser, tmp_path):
    with opened(browser, hostile_page(tmp_path)) as page:
        assert page.evaluate("window.hacked") is None
        assert page.locator("main img").count() > 0
        page.keyboard.press("Tab")
        assert page.evaluate("window.hacked") is None


def test_paper_shows_the_tables_in_full(browser, sim):
    with opened(browser, sim) as page:
        page.emulate_media(media="print")
        assert page.locator(".controls:visible").count() == 0
        assert page.evaluate(
            "[...document.querySelectorAll('.scroll')].every(e => e.scrollHeight <= e.clientHeight + 1)"
        )
        assert page.pdf()[:5] == b"%PDF-"


def test_without_scripts_all_frames_are_there(browser, sim):
    with opened(browser, sim, **DESKTOP, java_script_enabled=False) as page:
        assert page.locator(".frame:visible").count() == 6
        assert page.locator("noscript").count() == 1
