"""The page in a real browser beside other hands: a device's, a gamepad's, and a page that is too busy to draw."""

from __future__ import annotations

import re

import numpy as np
import pytest
from chromium_page import READ, assert_no, drag, number, open_page, settled, vector
from playwright.sync_api import Browser, Page
from slabs import touched_slab
from test_pressed_page import middle

from palpate.devices.hand_kind import HandKind
from palpate.runtime.safety import Fault
from palpate.runtime.touchable import touchable
from palpate.surrogates import Surrogate
from palpate.viewer import Viewer

pytestmark = pytest.mark.timeout(120)

BUSY = """ms => { const end = performance.now() + ms; while (performance.now() < end); }"""
PAD = """() => {
    const button = () => ({pressed: false, touched: false, value: 0});
    window.effects = [];
    window.pad = {
        id: "Test Pad (STANDARD GAMEPAD Vendor: 1234)", index: 0, connected: true, mapping: "standard",
        axes: [0, 0, 0, 0], buttons: Array.from({length: 17}, button), timestamp: 0,
        vibrationActuator: {
            effects: ["dual-rumble"],
            playEffect: (kind, values) => (window.effects.push({kind, ...values}), Promise.resolve("complete")),
        },
    };
    navigator.getGamepads = () => [window.pad, null, null, null];
}"""


def stalls(viewer: Viewer) -> int:
    return int(viewer.loop.read().fault_counts[Fault.INPUT_STALLED])


@pytest.mark.full
def test_a_page_too_busy_to_draw_keeps_its_force_and_one_that_hangs_says_why_not(page: Page, viewer: Viewer):
    for _ in range(5):  # on a machine under load the worker may be late as well
        drag(page, -20, 80)
        settled(page, "inside")
        before = stalls(viewer)
        page.evaluate(BUSY, 600)
        if kept := stalls(viewer) == before:
            break
        page.mouse.up()
    assert kept
    page.evaluate(BUSY, 2600)
    page.wait_for_function("() => !document.getElementById('reason').hidden")
    assert HandKind.PAGE.silence in page.inner_text("#reason")
    assert stalls(viewer) > before
    page.mouse.up()
    settled(page, "free")
    drag(page, -20, 80)
    assert number(settled(page, "inside")["text"]["force-norm"]) > 0.1, "let go, and the force comes back"
    page.mouse.up()


@pytest.mark.full
def test_a_gamepad_pulls_and_rumbles_with_the_force(page: Page, rod: Surrogate, viewer: Viewer):
    assert "No" in page.inner_text("#gamepad")
    page.evaluate(PAD)
    page.wait_for_function(
        "() => document.getElementById('gamepad').textContent.startsWith('Test Pad: rumble')"
    )
    page.evaluate("pad.axes[1] = 0.56, pad.buttons[7].value = 1, 0")  # half of the way behind the dead zone
    shown = settled(page, "inside")
    assert shown["data"]["grabbed"] == "true"
    y = vector(shown["data"], "position")[1]
    assert y == pytest.approx(-0.5 * viewer.model.deepest, rel=2e-3)
    page.wait_for_function("() => window.effects.length > 3")
    effect = page.evaluate("window.effects.at(-1)")
    force = number(page.inner_text("#force-norm"))
    assert effect["kind"] == "dual-rumble"
    assert effect["duration"] == 100
    assert effect["weakMagnitude"] == pytest.approx(min(1.0, force / viewer.model.force_max), abs=0.01)
    assert effect["strongMagnitude"] < 0.05, "the force stands still"
    page.evaluate("pad.buttons[1].pressed = true, 0")
    settled(page, "free")
    page.evaluate("pad.buttons[1].pressed = false, 0")
    settled(page, "free")  # although the trigger is still pulled
    page.evaluate("pad.buttons[7].value = 0, pad.axes[1] = 0")
    settled(page, "free")
    page.evaluate("pad.buttons[0].pressed = true, 0")
    settled(page, "inside")
    page.evaluate("pad.connected = false, 0")  # unplugged
    settled(page, "free")
    page.evaluate("delete navigator.getGamepads, 0")


@pytest.mark.full
def test_sticks_have_a_dead_zone_without_a_jump(page: Page):
    got = page.evaluate(
        """async () => {
            const m = await import("/assets/gamepad.js");
            return [[0, 0], [0.1, 0.05], [0.1201, 0], [0.56, 0], [1, 0], [0, 1], [-0.9, 0.9], [NaN, 0]]
                .map(([x, y]) => m.stick(x, y))
                .concat([[0, 0, 2], [1, 0, 2], [5, -5, 2], [1, 20, 0]].map(a => Object.values(m.motors(...a))));
        }"""
    )
    corner = np.sqrt(0.5)
    wanted = [(0, 0), (0, 0), (0.0001 / 0.88, 0), (0.5, 0), (1, 0), (0, -1), (-corner, -corner), (0, 0)]
    wanted += [(0, 0), (0.5, 0), (1, 0.25), (1, 1)]
    np.testing.assert_allclose(np.array(got, float), wanted, atol=1e-9)


@pytest.mark.full
@pytest.mark.timeout(180)
def test_a_device_drives_and_the_page_stops_it(browser: Browser, keep):
    complaints: list[str] = []
    body = touched_slab()
    stroke = touchable(body).stroke(touchable(body).workspace(0.075).scale)  # in and out of the body
    # at 200 Hz with 5 ms it is passive up to 67 N/m
    hand = "simulated:delay=0.005," + ",".join(f"{name}={value:.6g}" for name, value in stroke.items())
    with Viewer(body, port=0, device=hand, rate=200) as viewer:
        page = open_page(browser, viewer, complaints, "middle")
        page.wait_for_function("() => parseFloat(document.getElementById('force-norm').textContent) > 0.02")
        keep(page, "driven")
        shown = page.evaluate(READ)
        assert "device" in shown["flags"]
        felt = [int(shown["text"][f"feel-{name}"]) for name in ("body", "limit", "felt")]
        assert felt[0] > felt[1] == felt[2]
        assert felt[1] == pytest.approx(0.5 / 0.0075, rel=0.05)
        assert "200 Hz" in page.inner_text("#feel-words")
        assert page.locator("#depth-wanted").is_hidden()
        for details in page.locator("details").all():
            details.evaluate("d => d.open = true")
        steered = re.compile("finger|mouse|lets? go|take hold|gamepad|space bar", re.IGNORECASE)
        assert steered.findall(page.inner_text("#panel")) == [], "nobody is told to do what the program does"
        assert "A program (simulated) moves the hand" in page.inner_text("#flags")
        page.evaluate(
            """() => {
                Object.defineProperty(document, "hidden", {get: () => true, configurable: true});
                document.dispatchEvent(new Event("visibilitychange"));
            }"""
        )
        assert "The program goes on." in page.inner_text("#flags")
        page.evaluate("delete document.hidden")
        page.mouse.move(*middle(page))
        page.mouse.down()  # the page doesn't steer: this turns the view
        page.mouse.up()
        assert not viewer.loop.shared.command.record["grabbed"]
        page.keyboard.press("Escape")
        page.wait_for_selector("#resume:visible")
        assert "Stopped" in page.inner_text("#reason")
        assert not viewer.loop.read().force.any()
        keep(page, "stopped")
        page.click("#resume")
        page.wait_for_selector("#resume", state="hidden")
        page.click("#stop")
        page.wait_for_selector("#resume:visible")
        page.context.close()
    assert_no([c for c in complaints if "WebSocket" not in c])
