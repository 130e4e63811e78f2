"""The page of a body between two jaws, drawn and opened as they are: force and effort are the body's own."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from chromium_page import assert_no, number, open_file, open_page, vector
from playwright.sync_api import Browser, Page
from slabs import pinched_slab
from test_driven_page import PAD
from test_pressed_page import middle, stand_still

from palpate.devices.doubles.haply_simulator import HaplySimulator, SimulatorSettings
from palpate.errors import UsageError
from palpate.runtime.touchable import touchable
from palpate.surrogates import Surrogate
from palpate.viewer import Viewer
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


def opening(page: Page, slab: Surrogate, share: float) -> None:
    """Wait until the jaws in the loop are closed by a share of the trained openings."""
    low, high = slab.energy.inputs[3].low, slab.energy.inputs[3].high
    page.wait_for_function(
        "w => Math.abs(Number(document.documentElement.dataset.parameters) - w) < 1e-6",
        arg=high - share * (high - low),
    )


@pytest.mark.full
@pytest.mark.timeout(180)
def test_a_gamepads_trigger_closes_the_jaws(slab: Surrogate, visit_pressed: Callable[[Surrogate], Page]):
    page = visit_pressed(slab)
    page.evaluate(PAD)
    page.wait_for_function("() => document.getElementById('gamepad').textContent.startsWith('Test Pad')")
    weak, strong = 0.0, 0.0
    for share in (0.4, 0.9):
        page.evaluate("share => { pad.buttons[7].value = share; }", share)
        opening(page, slab, share)
        weak, strong = strong, slab.effort(check(slab, stand_still(page, "inside")))[0]
        assert strong > weak
    before = check(slab, stand_still(page, "inside"))
    page.evaluate("pad.axes[1] = -0.3, 0")
    page.wait_for_function(
        "z => Number(document.documentElement.dataset.position.split(' ')[2]) > z + 2e-4", arg=before[0, 2]
    )
    page.evaluate(
        "pad.buttons[7].value = 0, pad.buttons[0].pressed = true, 0"
    )  # the first button keeps the opening
    stand_still(page, "inside")
    opening(page, slab, 0.9)
    page.evaluate("pad.buttons[1].pressed = true, 0")
    page.wait_for_function("() => document.documentElement.dataset.grabbed === 'false'")


@pytest.mark.full
@pytest.mark.timeout(180)
def test_two_fingers_close_the_jaws(slab: Surrogate, browser: Browser, keep):
    complaints: list[str] = []
    phone = {"viewport": {"width": 390, "height": 844}, "has_touch": True, "is_mobile": True}
    with Viewer(slab, port=0) as viewer:
        page = open_page(browser, viewer, complaints, "middle", **phone)
        touch = page.context.new_cdp_session(page)
        x, y = middle(page)

        def send(kind: str, *places: tuple[float, float]) -> None:
            points = [{"x": a, "y": b, "id": i} for i, (a, b) in enumerate(places)]
            touch.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})

        send("touchStart", (x, y))
        before = check(slab, stand_still(page, "inside"))
        low, high = slab.energy.inputs[3].low, slab.energy.inputs[3].high
        share = (high - before[0, 3]) / (high - low)
        send("touchStart", (x, y), (x, y + 120))
        for way in (20, 40):  # 200 px are the whole way
            send("touchMove", (x, y), (x, y + 120 - way))
        opening(page, slab, share + 0.2)
        after = check(slab, stand_still(page, "inside"))
        keep(page, "two-fingers")
        np.testing.assert_allclose(after[0, :3], before[0, :3], atol=1e-6)
        for way in range(0, 260, 20):
            send("touchMove", (x, y), (x, y + 80 + way))
        opening(page, slab, 0.0)  # as wide as was trained, and no wider
        send("touchEnd")
        page.wait_for_function("() => document.documentElement.dataset.grabbed === 'false'")
        page.context.close()
    assert_no(complaints)


def close_by_keys(page: Page, slab: Surrogate) -> None:
    """Close the jaws of a body that a device drives as far as was trained."""
    opening(page, slab, 0.0)
    page.locator("#view").focus()
    for _ in range(60):  # the trained openings are 40 steps wide, and the jaws stay in them
        page.keyboard.press("PageDown")
    opening(page, slab, 1.0)


FREE = 0.061  # m, of jaws beside the slab of 60 mm: a device that began in it would feel nothing


@pytest.mark.full
@pytest.mark.timeout(180)
def test_keys_close_the_jaws_that_a_device_moves(browser: Browser, keep):
    complaints: list[str] = []
    slab = pinched_slab(FREE)
    with HaplySimulator(SimulatorSettings(port=0, events=0, amplitude=0.004, frequency=0.3)) as service:
        device = f"haply:ws://localhost:{service.port},events={service.events_port}"
        with Viewer(slab, port=0, device=device) as viewer:
            page = open_page(browser, viewer, complaints, "middle")
            page.wait_for_function(
                "() => document.getElementById('pinching').innerText.includes('Page Down')"
            )
            close_by_keys(page, slab)
            keep(page, "device")
            page.context.close()
    assert_no([c for c in complaints if "WebSocket" not in c])


@pytest.mark.full
@pytest.mark.timeout(180)
def test_the_force_of_closed_jaws_keeps_to_its_limit(browser: Browser):
    """The device belongs to the loop, so that none of its words is late."""
    complaints: list[str] = []
    slab, limit = pinched_slab(FREE), 0.02  # N
    device = "stroke:amplitude=0.004,x=1,y=0,z=0,frequency=0.5"
    with Viewer(slab, port=0, device=device, max_force=limit) as viewer:
        page = open_page(browser, viewer, complaints, "middle")
        close_by_keys(page, slab)
        states = []
        for _ in range(400):
            states.append(viewer.loop.read())
            page.wait_for_timeout(5)
        forces = [float(np.linalg.norm(state.force)) for state in states]
        assert 0.5 * limit < max(forces) <= limit * (1 + 1e-9)
        page.wait_for_function("() => Number(document.documentElement.dataset.effort) > 0.01")
        page.context.close()
    assert_no([c for c in complaints if "WebSocket" not in c])


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
