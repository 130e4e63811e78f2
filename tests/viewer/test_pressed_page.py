"""The page of a body that is pressed anywhere, in a real browser; its numbers are compared with the surrogate's own."""

from __future__ import annotations

import json
from collections.abc import Iterator

import numpy as np
import pytest
from chromium_page import READ, assert_no, hold_again, number, open_page, vector
from playwright.sync_api import Browser, Page
from slabs import DEVIATION, dents, touched_slab

import pressed
from palpate.surrogates import Surrogate
from palpate.viewer import Viewer
from palpate.viewer.surface_drawing import SurfaceDrawing

pytestmark = [pytest.mark.full, pytest.mark.timeout(180)]


@pytest.fixture(scope="module")
def slab() -> Surrogate:
    return touched_slab()


@pytest.fixture(scope="module")
def slab_viewer(slab: Surrogate) -> Iterator[Viewer]:
    with Viewer(slab, port=0) as running:
        yield running


@pytest.fixture(scope="module")
def slab_open(browser: Browser, slab_viewer: Viewer) -> Iterator[tuple[Page, list[str]]]:
    found: list[str] = []
    page = open_page(browser, slab_viewer, found, "middle")
    yield page, found
    page.context.close()


@pytest.fixture
def page(slab_open: tuple[Page, list[str]]) -> Iterator[Page]:
    slab_open[0].mouse.move(2, 2)
    stand_still(slab_open[0], "free")
    yield slab_open[0]
    slab_open[0].mouse.up()
    assert_no(slab_open[1])


def stand_still(page: Page, flag: str) -> dict:
    """What the page shows once the probe has arrived and four frames were alike, with `flag` among the flags.

    Four, over 0.1 s, because two may be on their way while the page is slow to draw.
    """
    was, times = page.evaluate(READ), set()
    for _ in range(600):
        page.wait_for_timeout(40)
        now = page.evaluate(READ)
        if now["withheld"]:
            hold_again(page)
            now, times = page.evaluate(READ), set()
        names = ("position", "force", "grabbed", "largest")  # the last where there is a field
        same = all(now["data"].get(k) == was["data"].get(k) for k in names)
        moving = now["data"].get("sinking") == "true" or "stalled" in now["flags"] or flag not in now["flags"]
        times = {*times, float(now["data"]["time"])} if same and not moving else set()
        was = now
        if len(times) >= 4 and max(times) - min(times) >= 0.1:
            return now
    pytest.fail(f"the page did not settle: {was}")


def middle(page: Page) -> tuple[float, float]:
    x, y = page.evaluate("document.documentElement.dataset.middle").split()
    return float(x), float(y)


def check(slab: Surrogate, shown: dict) -> np.ndarray:
    """The numbers on the page are the surrogate's at the probe shown; that probe, (1, 3)."""
    x = vector(shown["data"], "position")[None]
    force = slab.energy.force(x)[0]
    # three decimals on the page, and a position rounded to 32 bits at the largest stiffness
    slack = 0.5e-3 + 1e-6
    told = [number(shown["text"][f"force-{c}"]) for c in "xyz"]
    np.testing.assert_allclose(told, force, rtol=0, atol=slack)
    assert number(shown["text"]["force-norm"]) == pytest.approx(np.linalg.norm(force), abs=slack)
    assert number(shown["text"]["depth"]) == pytest.approx(1e3 * slab.energy.depth(x)[0], abs=0.0051)
    return x


def test_holding_the_button_presses_and_the_numbers_are_the_surrogates(page: Page, keep, slab: Surrogate):
    assert number(page.inner_text("#force-norm")) == 0.0
    x, y = middle(page)
    page.mouse.move(x + 20, y + 10)
    keep(page, "pressed-hover")
    page.mouse.down()
    shown = stand_still(page, "inside")
    keep(page, "pressed")
    at = check(slab, shown)
    assert slab.energy.depth(at)[0] == pytest.approx(0.5 * pressed.DEEPEST, rel=1e-3), "as the slider says"
    assert shown["text"]["trust"] == "inside"
    assert shown["text"]["deviation"] == f"± {100 * DEVIATION:g}\N{NO-BREAK SPACE}%"
    # the browser has summed modes and dimple to what the field says
    moved = np.linalg.norm(slab.fields["displacement"].values(at)[0], axis=1)
    assert float(shown["data"]["largest"]) == pytest.approx(moved.max(), rel=1e-5)
    rest = 3.0 - 1e3 * moved.max()  # of the 3 mm of depth
    assert f"the soft pad around it takes the other {rest:.2f} mm" in page.inner_text("#largest-note")
    page.mouse.up()
    released = stand_still(page, "free")
    assert number(released["text"]["force-norm"]) == 0.0
    assert float(released["data"]["largest"]) == 0.0, "back at rest"
    assert page.inner_text("#largest-note") == ""


def test_moving_slides_the_probe_at_its_depth(page: Page, slab: Surrogate):
    x, y = middle(page)
    page.mouse.move(x - 30, y - 5)
    page.mouse.down()
    before = check(slab, stand_still(page, "inside"))
    page.mouse.move(x + 30, y + 5, steps=5)
    after = check(slab, stand_still(page, "inside"))
    assert np.linalg.norm(after[0, :2] - before[0, :2]) > 0.005
    assert after[0, 2] == pytest.approx(before[0, 2], abs=1e-5)


def test_the_wheel_presses_deeper_and_beyond_the_training_says_so(page: Page, keep, slab: Surrogate):
    x, y = middle(page)
    page.mouse.move(x, y + 10)
    page.mouse.down()
    shallow = slab.energy.depth(check(slab, stand_still(page, "inside")))[0]
    for _ in range(16):  # of a twentieth of the trained depth
        page.mouse.wheel(0, 100)
    shown = stand_still(page, "outside")
    keep(page, "pressed-outside")
    assert slab.energy.depth(check(slab, shown))[0] == pytest.approx(1.25 * pressed.DEEPEST, rel=1e-3)
    assert shown["text"]["trust"] == "outside"
    assert shown["text"]["deviation"] == "not known", "nothing vouches for a figure there"
    assert "untrained" in page.inner_text("#depth-label")
    page.mouse.up()
    page.locator("#depth-wanted").fill(str(shallow))


def test_space_presses_arrows_slide_and_escape_lets_go(page: Page, slab: Surrogate):
    page.focus("#view")
    page.keyboard.down("Space")
    before = check(slab, stand_still(page, "inside"))
    for _ in range(3):
        page.keyboard.press("ArrowRight")
    page.keyboard.press("PageDown")
    after = check(slab, stand_still(page, "inside"))
    assert np.linalg.norm(after[0, :2] - before[0, :2]) > 0.002
    gone = slab.energy.depth(after)[0] - slab.energy.depth(before)[0]
    assert gone == pytest.approx(0.05 * pressed.DEEPEST, rel=0.05)
    page.keyboard.press("Escape")
    stand_still(page, "free")
    page.keyboard.up("Space")
    page.keyboard.press("PageUp")


def test_a_pen_presses_as_hard_as_its_tip_is_pressed(page: Page, slab: Surrogate):
    x, y = middle(page)
    pen = page.context.new_cdp_session(page)
    event = {"x": x, "y": y + 10, "button": "left", "buttons": 1, "pointerType": "pen", "clickCount": 1}
    pen.send("Input.dispatchMouseEvent", {**event, "type": "mousePressed", "force": 0.3})
    soft = slab.energy.depth(check(slab, stand_still(page, "inside")))[0]
    pen.send("Input.dispatchMouseEvent", {**event, "type": "mouseMoved", "force": 0.6})
    hard = slab.energy.depth(check(slab, stand_still(page, "inside")))[0]
    assert (soft, hard) == pytest.approx(
        (0.3 * 1.25 * pressed.DEEPEST, 0.6 * 1.25 * pressed.DEEPEST), rel=0.01
    )
    pen.send("Input.dispatchMouseEvent", {**event, "type": "mouseReleased", "buttons": 0, "force": 0.0})
    assert number(stand_still(page, "free")["text"]["force-norm"]) == 0.0
    pen.detach()


def test_beside_the_touched_surface_the_view_turns_instead(page: Page):
    x, y = middle(page)
    box = page.locator("#view").bounding_box()
    low = box["y"] + 0.72 * box["height"]  # a side face, or the floor
    page.mouse.move(x, low)
    page.mouse.down()
    page.mouse.move(x + 90, low, steps=4)
    page.mouse.up()
    assert stand_still(page, "free")["data"]["grabbed"] == "false"
    turned = page.evaluate("document.documentElement.dataset.middle")
    page.mouse.move(30, low)
    page.mouse.down(button="right")
    page.mouse.move(90, low, steps=4)
    page.mouse.up(button="right")
    stand_still(page, "free")
    assert page.evaluate("document.documentElement.dataset.middle") != turned
    page.click("#reset-view")
    stand_still(page, "free")
    assert middle(page) == pytest.approx((x, y), abs=0.5)


def test_colours_are_chosen_with_their_own_scale(page: Page, keep, slab: Surrogate):
    assert page.inner_text("#legend-title") == "displacement (mm)"
    x, y = middle(page)
    page.get_by_role("button", name="largest stretch").click()
    assert page.inner_text("#legend-title") == "largest stretch"
    page.mouse.move(x, y + 10)
    page.mouse.down()
    shown = stand_still(page, "inside")
    keep(page, "pressed-stretch")
    at = vector(shown["data"], "position")[None]
    values = slab.fields["largest stretch"].values(at)
    assert float(shown["data"]["largest"]) == pytest.approx(values.max(), rel=1e-5)
    page.mouse.up()
    page.get_by_role("button", name="displacement").click()


def test_the_browser_sums_a_field_as_numpy_does(page: Page, slab: Surrogate):
    from palpate.runtime.touchable import touchable

    drawing = SurfaceDrawing(touchable(slab))
    rest = drawing.surface.rest.reshape(-1, 3)
    for index, one in enumerate(slab.fields.values()):
        for c in ([0.004, 0.006, 0.0061], [-0.018, 0.0199, 0.0095], [0.011, 0.0, 0.0041], [0.0, 0.0, 0.0035]):
            eye = one.evaluator(precision="double")
            eye(np.array(c))
            numbers = [*eye.coefficients, *eye.profile().ravel()]
            got = page.evaluate(
                """async ([index, numbers, foot, components, modes_count]) => {
                    const m = await import("/assets/messages.js");
                    const { Field } = await import("/assets/field.js");
                    const get = async path => (await fetch(path)).arrayBuffer();
                    const surface = m.decodeSurface(await get("/surface"));
                    const modes = m.decodeModes(await get(`/fields/${index}`));
                    const look = { components, modes: modes_count };
                    const field = new Field(look, modes, surface.rest);
                    if (field.count !== numbers.length) throw new Error(`${field.count} numbers`);
                    field.update(Float32Array.from(numbers), foot);
                    return JSON.stringify([...field.values]);
                }""",
                [index, [float(n) for n in numbers], list(eye.place[2:5]), one.rest.shape[1], len(one.modes)],
            )
            wanted = one.values(np.array([c]))[0]
            back = np.array(json.loads(got)).reshape(len(rest), -1)
            # single precision of the sums: a few ulp of the largest value
            slack = 8 * np.finfo("f4").eps * np.abs(wanted).max()
            nodes = drawing.nodes
            np.testing.assert_allclose(back, wanted[nodes], rtol=0, atol=slack)


def test_a_print_stays_on_the_page_when_the_hand_has_gone(browser: Browser, keep):
    complaints: list[str] = []
    with Viewer(touched_slab().with_memory(dents(0.002), spacing=0.002), port=0) as viewer:
        page = open_page(browser, viewer, complaints, "middle")
        x, y = middle(page)
        page.mouse.move(x, y + 5)
        page.mouse.down()
        page.mouse.wheel(0, 300)  # deeper
        shown = stand_still(page, "inside")
        keep(page, "printed-held")
        page.mouse.up()
        page.mouse.move(2, 2)
        left = stand_still(page, "free")
        keep(page, "printed")
        deep, kept = (float(one["data"]["largest"]) for one in (shown, left))
        assert number(left["text"]["force-norm"]) == 0.0
        assert 3e-4 < kept < 0.5 * deep
        page.context.close()
    assert_no([c for c in complaints if "WebSocket" not in c])


def test_a_surrogate_alone_says_that_its_surface_does_not_move(browser: Browser, keep):
    complaints: list[str] = []
    alone = pressed.surrogate()
    with Viewer(alone, port=0) as viewer:
        page = open_page(browser, viewer, complaints, "middle")
        assert "no field in this file" in page.inner_text("#scale-notes")
        assert page.locator("#legend").is_hidden()
        x, y = middle(page)
        page.evaluate("document.documentElement.dataset.largest = '0'")  # it has no field to tell of
        page.mouse.move(x, y + 5)
        page.mouse.down()
        shown = stand_still(page, "inside")
        keep(page, "pressed-alone")
        check(alone, shown)
        assert shown["text"]["deviation"] == "not known"
        page.context.close()
    assert_no([c for c in complaints if "WebSocket" not in c])
