"""The page of a body under a tool in a real browser: its shape, its turns, its torque."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from chromium_page import number, open_file, vector
from playwright.sync_api import Page
from slabs import TILT, slab_under_a_still_tool, slab_under_a_tool
from test_pressed_page import middle, stand_still

from palpate.runtime.touchable import touchable
from palpate.surrogates import Surrogate
from palpate.tools import Capsule, PosedTool
from palpate.viewer.drawn_tool import drawn_tool
from palpate.viewer.file_page import export_html

pytestmark = [pytest.mark.full, pytest.mark.timeout(180)]


@pytest.fixture(scope="module")
def tilting() -> Surrogate:
    return slab_under_a_tool()


def held(page: Page) -> tuple[float, float]:
    """Press the middle; where the mouse is."""
    x, y = middle(page)
    page.mouse.move(x, y)
    page.mouse.down()
    stand_still(page, "inside")
    return x, y


def check(body: Surrogate, shown: dict) -> None:
    """Force and torque on the page are the body's own at the pose shown."""
    x = np.append(vector(shown["data"], "position"), vector(shown["data"], "parameters"))[None]
    force = vector(shown["data"], "force")
    np.testing.assert_allclose(force, body.energy.force(x)[0], rtol=1e-4, atol=1e-6)
    torque = body.torque(x)[0]
    # single precision of a place times the stiffness, with the arm of the tool
    np.testing.assert_allclose(vector(shown["data"], "torque"), torque, rtol=1e-3, atol=1e-6)
    assert number(shown["text"]["torque-norm"]) == pytest.approx(1e3 * np.linalg.norm(torque), abs=0.0051)


def test_keys_turn_a_tool_whose_orientation_is_an_input(
    tilting: Surrogate, visit_pressed: Callable[[Surrogate], Page]
):
    page = visit_pressed(tilting)
    assert "capsule of radius 4 mm" in page.inner_text("#model-line")
    held(page)
    page.keyboard.press("e")
    page.keyboard.press("e")
    page.keyboard.press("Shift+F")
    page.wait_for_function("() => Number(document.documentElement.dataset.parameters.split(' ')[0]) < 0")
    shown = stand_still(page, "inside")
    np.testing.assert_allclose(vector(shown["data"], "parameters"), [-0.02 * TILT, 0.2 * TILT], rtol=1e-6)
    check(tilting, shown)
    for _ in range(30):
        page.keyboard.press("r")
        page.keyboard.press("q")
    shown = stand_still(page, "inside")
    tilt = vector(shown["data"], "parameters")
    assert np.linalg.norm(tilt) == pytest.approx(TILT, rel=1e-6), "not beyond what was trained"
    assert tilt[0] > 0 > tilt[1]
    check(tilting, shown)
    assert page.is_visible("#turn-help")


def test_a_second_finger_tilts_the_tool(tilting: Surrogate, visit_pressed: Callable[[Surrogate], Page]):
    page = visit_pressed(tilting)
    x, y = middle(page)
    touch = """([kind, id, x, y]) => {
        const view = document.getElementById("view");
        const box = view.getBoundingClientRect();
        view.setPointerCapture = () => {};
        view.dispatchEvent(new PointerEvent(kind, {pointerId: id, pointerType: "touch", button: 0, bubbles: true,
            clientX: x, clientY: y, isPrimary: id === 5}));
    }"""
    page.evaluate(touch, ["pointerdown", 5, x, y])
    page.wait_for_function("() => document.documentElement.dataset.grabbed === 'true'")
    page.evaluate(touch, ["pointerdown", 6, x + 80, y])
    page.evaluate(touch, ["pointermove", 6, x + 110, y + 60])
    page.evaluate(touch, ["pointerup", 6, x + 110, y + 60])
    page.wait_for_function("() => Number(document.documentElement.dataset.parameters.split(' ')[1]) > 0")
    shown = page.evaluate("() => ({...document.documentElement.dataset})")
    assert shown["grabbed"] == "true", "the first finger still presses"
    np.testing.assert_allclose(vector(shown, "parameters"), [0.5 * TILT, 0.25 * TILT], rtol=1e-6)
    page.evaluate(touch, ["pointerup", 5, x, y])
    page.wait_for_function("() => document.documentElement.dataset.grabbed === 'false'")


def test_a_tool_that_stays_has_a_torque_and_no_keys(visit_pressed: Callable[[Surrogate], Page]):
    body = slab_under_a_still_tool()
    page = visit_pressed(body)
    held(page)
    for key in "qerftg":
        page.keyboard.press(key)
    shown = stand_still(page, "inside")
    check(body, shown)
    assert page.is_hidden("#turn-help")
    assert page.is_hidden("#parameters")
    page.evaluate("document.getElementById('help').open = true")
    assert page.is_hidden("#turn-keys")
    assert "ball" not in page.inner_text("#panel")


def test_the_page_of_one_file_has_the_tool_and_its_torque(browser, tmp_path):
    body = slab_under_a_still_tool()
    file = tmp_path / "slab.html"
    export_html(body, file)  # compared with palpate, its field too
    page, complaints = open_file(browser, file)
    page.wait_for_selector("html[data-tick][data-middle]")
    held(page)
    check(body, stand_still(page, "inside"))
    assert complaints == []
    page.context.close()


def test_a_drawn_tool_touches_the_plane_where_its_surface_begins():
    tool = PosedTool(Capsule(0.004, 0.02), (0.0, 0.2, 0.0), turns="axis", tilt=TILT)
    drawn = drawn_tool(tool, touchable(slab_under_a_tool()).parameters)
    heights = np.reshape(drawn.points, (-1, 3))[:, 2]
    # normals are 13° apart at most: the lowest point is missed by R (1 − cos 6.5°), and digits end at 0.1 µm
    lowest = -tool.offset(np.array([[0.0, 0.0, 1.0]]))[0]
    assert lowest - 1e-7 <= heights.min() <= lowest + 0.004 * (1 - np.cos(np.radians(6.6)))
    assert drawn.turns == (0, 1, -1)
