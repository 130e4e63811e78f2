"""Pages of their own: a finger, two pages, other bodies, and servers that come and go."""

from __future__ import annotations

import contextlib
import os
import signal
import threading
from collections.abc import Iterator

import numpy as np
import pytest
from chromium_page import assert_no, check_force, drag, let_go, number, settled, tip, vector
from playwright.sync_api import expect

from models import DOWN, linear_network, planar_field, spring_beam
from palpate.runtime.touchable import touchable
from palpate.surrogates import ConstantBaseline, LearntEnergy, Surrogate
from palpate.units import Quantity, Range
from palpate.viewer import Viewer, hand_lock
from websocket_page import client_of

pytestmark = [pytest.mark.full, pytest.mark.timeout(120)]


def test_a_finger_pulls(visit, keep, viewer: Viewer, rod: Surrogate):
    page = visit(viewer, viewport={"width": 390, "height": 780}, has_touch=True, is_mobile=True)
    touch = page.context.new_cdp_session(page)
    x, y = tip(page)

    def send(kind: str, *points: tuple[float, float]) -> None:
        touch.send(
            "Input.dispatchTouchEvent", {"type": kind, "touchPoints": [{"x": a, "y": b} for a, b in points]}
        )

    send("touchStart", (x + 15, y + 12))  # a finger is not a pixel
    for i in range(1, 11):
        send("touchMove", (x + 15, y + 12 + 5 * i))
    shown = settled(page, "inside")
    keep(page, "finger")
    assert vector(shown["data"], "force")[1] > 0.3
    check_force(rod, shown, np.zeros(0))
    send("touchEnd")
    assert number(let_go(page)["text"]["force-norm"]) == 0.0
    assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")


@contextlib.contextmanager
def held_elsewhere(viewer: Viewer, y: float) -> Iterator[None]:
    """Another page holds the tip at y (m) meanwhile, however long a busy machine keeps it from saying so."""
    held, over = threading.Event(), threading.Event()

    def hold() -> None:
        with client_of(viewer) as client:
            while not over.wait(0.02):
                client.hand(0.0, y)
                if not held.is_set():
                    client.grant(1)
                    if client.frame().position[1] == pytest.approx(y, rel=2**-22):
                        held.set()
            client.hand(grabbed=False)

    other = threading.Thread(target=hold)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(hand_lock, "FORGOTTEN", 60.0)
        other.start()
        try:
            assert held.wait(10.0)
            yield
        finally:  # the viewer is other tests' too
            over.set()
            other.join()


def test_the_second_page_watches(visit, keep, viewer: Viewer, rod: Surrogate):
    page = visit(viewer)
    y = -0.4 * touchable(rod).reach

    def check_watching() -> None:
        shown = settled(page, "watching")
        assert vector(shown["data"], "position")[1] == pytest.approx(y, rel=2**-22)
        check_force(rod, shown, np.zeros(0))

    with held_elsewhere(viewer, y):
        check_watching()
        drag(page, 0, -80)
        page.wait_for_timeout(200)
        check_watching()
        keep(page, "watching")
        page.mouse.up()
    assert let_go(page)["flags"][0] == "free"


def test_the_end_of_the_loop_is_shown_and_the_page_returns(visit, keep, complaints, caplog, rod: Surrogate):
    with Viewer(rod, port=0) as viewer:
        page = visit(viewer)
        drag(page, -20, 100)
        assert number(settled(page, "inside")["text"]["force-norm"]) > 0.3
        os.kill(viewer.loop.pid, signal.SIGKILL)
        shown = settled(page, "ended")
        keep(page, "ended")
        assert number(shown["text"]["force-norm"]) == 0.0
        expect(page.locator("#banner")).to_contain_text("real-time process has ended")
        page.mouse.up()
    page.wait_for_selector("#flags [data-flag=lost]")
    assert "disconnected" in page.inner_text("#status")
    assert page.inner_text("#force-norm") == "–"
    keep(page, "disconnected")
    page.evaluate("document.kept = true")
    with Viewer(rod, port=viewer.port, strict_port=True) as again:
        expect(page.locator("#banner")).to_contain_text("Open the new address", timeout=10_000)
        assert page.inner_text("#status") == "started again"
        page.wait_for_timeout(4000)  # it asks on, and the terminal tells it once
        (line,) = [record.getMessage() for record in caplog.records if "refused" in record.getMessage()]
        assert "earlier start" in line
        page.context.request.get(again.url)  # as opening the new address in the same browser does
        settled(page, "free")
        assert page.evaluate("document.kept")
        assert page.is_hidden("#banner")
        drag(page, -20, 100)
        check_force(rod, settled(page, "inside"), np.zeros(0))
        page.mouse.up()
    with Viewer(spring_beam(), port=viewer.port, strict_port=True) as other:  # another body: a fresh page
        page.context.request.get(other.url)
        expect(page.locator("#model-name")).to_have_text("spring", timeout=10_000)
        page.wait_for_selector("html[data-tick][data-tip]")
        assert not page.evaluate("document.kept")
        page.context.close()
    known = ("ERR_CONNECTION_REFUSED", "401", "403")  # no server, or one whose token it has not got yet
    assert_no([c for c in complaints if not any(word in c for word in known)])
    complaints.clear()


def stiff_with_two_loads() -> Surrogate:
    """A stiff beam (31 mm of 1 m) with a second load, not the hand's, that moves tip and force."""
    beam = spring_beam(160.0)
    field = beam.fields["displacement"]
    inputs = [*field.inputs, Range("force at midspan", -2.0, 2.0, "N")]
    tail = np.hstack([field.network.tail, np.zeros((42, 1))])
    tail[1::2, 2] = -0.0025 * field.points[:, 0]
    shown = planar_field(
        "displacement", linear_network(inputs, list(field.network.outputs), tail), field.points
    )
    # U + U₀ = U₀ exp ℓ with ℓ = 40 w + 0.05 p: pulled from the start, the more the further
    hand = [Range("h", 0.0, 0.03125, "m"), inputs[1]]
    flat = linear_network(hand, [Quantity("ℓ", "")], np.array([[0.625, 0.625, 0.1]]))
    energy = LearntEnergy(flat, ConstantBaseline(0.03, DOWN))
    return Surrogate(energy, {"displacement": shown}, meta={"name": "two loads"})


def test_a_load_that_the_hand_does_not_supply_and_a_small_displacement(visit, keep):
    model = stiff_with_two_loads()
    with Viewer(model, port=0) as viewer:
        page = visit(viewer, color_scheme="dark")
        page.locator("#parameter-0").fill("1.5")
        page.wait_for_selector('html[data-parameters="1.5"]')
        expect(page.locator("#sliders output")).to_have_text("1.5 N")
        assert "displacement drawn × 10" in page.inner_text("#scale-notes")
        settled(page, "free")
        drag(page, 0, 50)
        shown = settled(page, "inside")
        keep(page, "enlarged-dark")
        check_force(model, shown, np.array([1.5]))
        page.mouse.up()
        rest = vector(settled(page, "free")["data"], "contact")[1]
        page.click("#true-scale")
        assert "displacement to scale" in page.inner_text("#scale-notes")
        drag(page, 0, 5)
        finer = settled(page, "inside")
        ways = [vector(s["data"], "position")[1] - rest for s in (shown, finer)]
        assert ways[1] == pytest.approx(
            ways[0], rel=0.3
        )  # a tenth of the way at ten times the scale, to a pixel
        page.context.close()
