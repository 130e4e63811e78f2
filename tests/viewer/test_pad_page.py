"""A body held by a pad, on the page: drawn, pulled, let go; its numbers are the closed form's (`tests/held.py`)."""

from __future__ import annotations

import numpy as np
import pytest
from chromium_page import assert_no, drag, number, open_page, settled, tip, vector
from playwright.sync_api import Browser

from held import PAD_SPRING, pad, pad_force
from palpate.viewer import Viewer

pytestmark = [pytest.mark.full, pytest.mark.timeout(120)]


def test_a_pad_is_pulled_with_the_force_of_its_energy(browser: Browser, keep):
    complaints: list[str] = []
    with Viewer(pad(), port=0) as viewer:
        page = open_page(browser, viewer, complaints)
        settled(page, "free")
        keep(page, "pad-rest")
        told = page.inner_text("#model-line") + page.inner_text("#sliders")
        assert "pad moved along x" in told
        assert "pad's place along" in told
        assert "_" not in told
        assert page.inner_text("#legend-title") == "displacement (mm)"
        page.locator("#parameter-0").fill("0.01")
        page.wait_for_selector('html[data-parameters^="0.00999"]')  # in 32 bits
        x, y = tip(page)
        drag(page, 15, -20)
        shown = settled(page, "inside")
        keep(page, "pad-pulled")
        d = vector(shown["data"], "position")
        assert d[2] > 1e-3, "pulled up"
        told = [number(shown["text"][f"force-{axis}"]) for axis in "xyz"]
        np.testing.assert_allclose(told, pad_force(d, 0.01), rtol=0, atol=1e-3)
        moved = [number(shown["text"][f"tip-{axis}"]) for axis in "xyz"]
        np.testing.assert_allclose(moved, 1e3 * d, atol=0.051)
        assert tip(page) == pytest.approx((x + 15, y - 20), abs=2), "it follows the pointer"
        page.mouse.up()
        free = settled(page, "free")
        assert number(free["text"]["force-norm"]) == 0.0
        page.focus("#view")
        for _ in range(10):
            page.keyboard.press("ArrowDown")
        keyed = vector(settled(page, "inside")["data"], "position")
        np.testing.assert_allclose(keyed, [0.0, 0.0, -0.2 * viewer.model.deepest], atol=1e-6)
        page.keyboard.press("Escape")
        settled(page, "free")
        assert viewer.model.stiffness_max < 1.25 * PAD_SPRING.max()
        page.context.close()
    assert_no([c for c in complaints if "WebSocket" not in c])
