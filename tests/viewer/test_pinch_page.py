"""The page of a body between two jaws, drawn and opened as they are: force and effort are the body's own."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from chromium_page import number, open_file, vector
from playwright.sync_api import Page
from slabs import pinched_slab
from test_pressed_page import middle, stand_still

from palpate.errors import UsageError
from palpate.runtime.touchable import touchable
from palpate.surrogates import Surrogate
from palpate.viewer.drawn_tool import drawn_tool
from palpate.viewer.file_page import export_html
from palpate.viewer.page_model import PageModel


@pytest.fixture(scope="module")
def slab() -> Surrogate:
    return pinched_slab()


def test_jaws_are_drawn_where_they_are(slab: Surrogate):
    gripper = touchable(slab).gripper
    assert gripper is not None
    drawn = drawn_tool(gripper, touchable(slab).parameters)
    assert drawn.opening == 0
    opening = 0.054
    for jaw, side, own in zip(
        gripper.jaws, (1, -1), np.split(np.reshape(drawn.points, (-1, 3)), [drawn.first]), strict=True
    ):
        points = own + side * opening / 2 * np.array(drawn.along)
        # its foremost point, to the digits that are sent
        assert (side * points[:, 0]).min() == pytest.approx(opening / 2, abs=2e-7)
        # it lies along y; normals are 1° off at its ends
        normals = np.array([[0.0, 1.0, 0.0], [0.0, -1.0, 0.0]])
        reach = np.array([-points[:, 1].min(), points[:, 1].max()])
        np.testing.assert_allclose(reach, jaw.offset(normals), rtol=1e-3)


def test_no_place_of_a_pinched_body_is_pressed(slab: Surrogate):
    surface = PageModel(touchable(slab)).surface
    assert surface is not None
    assert not surface.touchable.any()
    with pytest.raises(UsageError, match="between two jaws has no shape to draw"):
        PageModel(touchable(replace(slab, fields={})))


def pinch(page: Page) -> tuple[float, float]:
    x, y = middle(page)
    page.mouse.move(x, y)
    page.mouse.down()
    return x, y


def check(slab: Surrogate, shown: dict) -> np.ndarray:
    """Force and effort on the page are the body's own at the jaws shown; their inputs (1, 4)."""
    x = np.append(vector(shown["data"], "position"), vector(shown["data"], "parameters"))[None]
    # single precision of a place times the stiffness
    np.testing.assert_allclose(vector(shown["data"], "force"), slab.energy.force(x)[0], rtol=1e-4, atol=1e-5)
    effort = slab.effort(x)[0]
    assert effort > 0.0
    assert float(shown["data"]["effort"]) == pytest.approx(effort, rel=1e-4)
    assert number(shown["text"]["effort"]) == pytest.approx(effort, abs=1e-3)
    return x


@pytest.mark.full
@pytest.mark.timeout(180)
def test_a_hand_moves_the_jaws_and_keys_close_them(
    slab: Surrogate, visit_pressed: Callable[[Surrogate], Page], keep
):
    page = visit_pressed(slab)
    assert "two jaws" in page.inner_text("#model-line")
    assert page.is_hidden("#pressing")
    x, y = pinch(page)
    before = check(slab, stand_still(page, "inside"))
    for _ in range(4):
        page.keyboard.press("PageDown")
    page.mouse.move(x + 6, y - 4, steps=3)
    page.wait_for_function(
        f"() => Number(document.documentElement.dataset.parameters) < {before[0, 3] - 6e-4}"
    )
    shown = stand_still(page, "inside")
    keep(page, "pinched")
    after = check(slab, shown)
    assert after[0, 3] == pytest.approx(before[0, 3] - 4 * 0.025 * 0.007, abs=1e-7)
    assert np.linalg.norm(after[0, :3] - before[0, :3]) > 1e-4
    assert slab.effort(after)[0] > slab.effort(before)[0]
    page.mouse.up()
    page.wait_for_function("() => document.documentElement.dataset.grabbed === 'false'")


@pytest.mark.full
@pytest.mark.timeout(180)
def test_the_page_of_one_file_pinches(slab: Surrogate, browser, tmp_path):
    file = tmp_path / "slab.html"
    export_html(slab, file)  # compared with palpate
    page, complaints = open_file(browser, file)
    page.wait_for_selector("html[data-tick][data-middle]")
    pinch(page)
    check(slab, stand_still(page, "inside"))
    assert complaints == []
    page.context.close()
