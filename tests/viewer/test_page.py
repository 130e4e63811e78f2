"""The page in a real browser: pull on the tip, read the force, compare it with the network's own answer.

Chromium draws in software here; every wait is for a state and not for a time. Set PALPATE_SCREENSHOTS to a folder
to keep the pictures.
"""

from __future__ import annotations

import base64
import dataclasses
import json
import os
import signal
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from playwright.sync_api import Browser, Page, sync_playwright
from test_messages import HELLO, sample

from models import linear_network, spring_beam
from palpate.surrogates import TouchModel
from palpate.units import Quantity, Range
from palpate.viewer import Viewer, typescript
from palpate.viewer.messages import Notice

pytestmark = pytest.mark.timeout(120)

ARGUMENTS = [
    "--no-sandbox",  # the tests may run as root, in a container
    "--use-gl=angle",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--no-first-run",
]

READ = """() => ({
    data: {...document.documentElement.dataset},
    text: Object.fromEntries([...document.querySelectorAll("output[id]")].map(o => [o.id, o.textContent])),
    flags: [...document.querySelectorAll("#flags li")].map(li => li.dataset.flag),
})"""


@pytest.fixture(scope="module")
def browser(chromium: str) -> Iterator[Browser]:
    with sync_playwright() as playwright:
        running = playwright.chromium.launch(executable_path=chromium, args=ARGUMENTS)
        yield running
        running.close()


def open_page(browser: Browser, viewer: Viewer, complaints: list[str], **options: Any) -> Page:
    """The page of a viewer, in a context of its own; errors and foreign requests go to `complaints`."""
    options.setdefault("viewport", {"width": 860, "height": 520})
    page = browser.new_context(**options).new_page()
    page.on("console", lambda m: complaints.append(m.text) if m.type in {"error", "warning"} else None)
    page.on("pageerror", lambda error: complaints.append(str(error)))
    local = (viewer.url, "data:", "blob:")
    page.on("request", lambda r: None if r.url.startswith(local) else complaints.append(f"asks {r.url}"))
    page.goto(viewer.url)
    page.wait_for_selector("html[data-tick][data-tip]")
    return page


def assert_no(complaints: list[str]) -> None:
    # what software rendering says of its own slowness is no fault of the page
    assert [c for c in complaints if "GPU stall due to ReadPixels" not in c] == []


@pytest.fixture
def complaints() -> list[str]:
    """What the browser complained of; a test that expects something empties it."""
    return []


@pytest.fixture
def visit(browser: Browser, complaints: list[str]) -> Iterator[Callable[..., Page]]:
    """Open the page of a viewer; afterwards there must be no complaint."""
    pages: list[Page] = []

    def one(viewer: Viewer, **options: Any) -> Page:
        pages.append(open_page(browser, viewer, complaints, **options))
        settled(pages[-1])  # the body may still swing from the test before
        return pages[-1]

    yield one
    for page in pages:
        page.context.close()
    assert_no(complaints)


@pytest.fixture(scope="module")
def kept_open(browser: Browser, viewer: Viewer) -> Iterator[tuple[Page, list[str]]]:
    found: list[str] = []
    page = open_page(browser, viewer, found)
    yield page, found
    page.context.close()


@pytest.fixture
def page(kept_open: tuple[Page, list[str]]) -> Iterator[Page]:
    """One page for all tests that leave it as they found it: opening costs a second of shader compilation."""
    settled(kept_open[0], "free")
    yield kept_open[0]
    assert_no(kept_open[1])
    kept_open[1].clear()


@pytest.fixture
def keep(tmp_path: Path) -> Callable[[Page, str], None]:
    """Keep a screenshot."""
    folder = Path(os.environ.get("PALPATE_SCREENSHOTS", tmp_path))
    folder.mkdir(parents=True, exist_ok=True)
    return lambda page, name: page.screenshot(path=folder / f"{name}.png") and None


def tip(page: Page) -> tuple[float, float]:
    """Where the ball at the tip is, px."""
    x, y = page.evaluate("document.documentElement.dataset.tip").split()
    return float(x), float(y)


def vector(data: dict[str, str], name: str) -> np.ndarray:
    return np.array([float(v) for v in data[name].split()])


def number(text: str) -> float:
    return float(text.replace("−", "-"))


def settled(page: Page, flag: str = "") -> dict[str, Any]:
    """What the page shows once body and force have stood still for 0.1 s, with `flag` among the flags."""
    was = page.evaluate(READ)
    for _ in range(150):
        page.wait_for_timeout(100)
        now = page.evaluate(READ)
        if float(now["data"]["time"]) < float(was["data"]["time"]) + 0.1:
            continue  # a busy machine: no picture since
        still = all(now["data"][k] == was["data"][k] for k in ("position", "contact", "force", "grabbed"))
        if still and "stalled" not in now["flags"] and (not flag or flag in now["flags"]):
            return now
        was = now
    pytest.fail(f"the page did not settle: {was}")


def let_go(page: Page) -> dict[str, Any]:
    """What the page shows once nobody holds the body; it may still swing."""
    page.wait_for_selector("#flags [data-flag=free]")
    return page.evaluate(READ)


def drag(page: Page, dx: float, dy: float, steps: int = 6) -> None:
    """Grab the tip with the mouse and pull it; the button stays down."""
    x, y = tip(page)
    page.mouse.move(x, y)
    page.mouse.down()
    for i in range(1, steps + 1):
        page.mouse.move(x + dx * i / steps, y + dy * i / steps)


def check_force(model: TouchModel, shown: dict[str, Any], parameters: np.ndarray) -> None:
    """The numbers on the page are the network's own answer at the hand shown."""
    evaluator = model.evaluator()
    evaluator(vector(shown["data"], "position"), parameters)
    # three decimals on the page, and a position rounded to 32 bits at the largest stiffness
    slack = 0.5e-3 + 1e-6 + model.reach * 2**-23 * model.stiffness_max
    force = [number(shown["text"][f"force-{c}"]) for c in "xy"]
    assert np.allclose(force, evaluator.force[:2], rtol=0, atol=slack)
    assert number(shown["text"]["force-norm"]) == pytest.approx(np.linalg.norm(evaluator.force), abs=slack)
    moved = [number(shown["text"][f"tip-{c}"]) / 1000 for c in "xy"]
    assert np.allclose(moved, evaluator.contact[:2], rtol=0, atol=0.05e-3 + 1e-6)


def test_mouse_pulls_and_the_force_is_the_networks(page: Page, keep, rod: TouchModel):
    assert number(page.inner_text("#force-norm")) == 0.0
    keep(page, "rest")
    y = tip(page)[1]
    drag(page, -25, 100)
    shown = settled(page, "inside")
    assert tip(page)[1] == pytest.approx(y + 100, abs=3)  # px: upright the ball follows the pointer
    keep(page, "mouse")
    assert shown["data"]["grabbed"] == "true"
    assert vector(shown["data"], "force")[1] > 0.5  # pulled down, it pushes up
    check_force(rod, shown, np.zeros(0))
    page.mouse.up()
    released = settled(page, "free")
    assert number(released["text"]["force-norm"]) == 0.0
    assert vector(released["data"], "contact") == pytest.approx(0.0, abs=1e-4 * rod.reach)


def test_pulling_beyond_the_trained_range_is_flagged(page: Page, keep, rod: TouchModel):
    drag(page, -40, 250)
    shown = settled(page, "outside")
    keep(page, "outside")
    assert shown["data"]["inside"] == "false"
    check_force(rod, shown, np.zeros(0))
    page.mouse.up()
    assert let_go(page)["flags"] == ["free"]


def test_a_finger_pulls(visit, keep, viewer: Viewer, rod: TouchModel):
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


def test_arrow_keys_pull_and_escape_lets_go(page: Page, rod: TouchModel):
    page.focus("#view")
    for _ in range(15):
        page.keyboard.press("ArrowDown")
    shown = settled(page, "inside")
    start = rod.displacement(np.zeros(1))[rod.touch_node, 1]  # the network's own rest is not quite 0
    wanted = start - 15 * 0.02 * rod.reach
    assert vector(shown["data"], "position")[1] == pytest.approx(wanted, rel=2**-22)
    check_force(rod, shown, np.zeros(0))
    page.keyboard.press("Escape")
    let_go(page)


def test_beside_the_ball_nothing_is_grabbed_and_the_right_button_turns(page: Page):
    x, y = tip(page)
    page.mouse.move(x - 120, y + 90)
    page.mouse.down()
    page.mouse.move(x - 120, y + 160, steps=4)
    page.mouse.up()
    assert tip(page) == (x, y)
    page.mouse.move(300, 400)
    page.mouse.down(button="right")
    page.mouse.move(420, 400, steps=4)
    page.mouse.up(button="right")
    page.wait_for_function(f"Math.abs(parseFloat(document.documentElement.dataset.tip) - {x}) > 5")
    assert settled(page)["data"]["grabbed"] == "false"
    page.click("#reset-view")
    page.wait_for_function(f"Math.abs(parseFloat(document.documentElement.dataset.tip) - {x}) < 0.5")


def test_the_second_page_watches(visit, keep, viewer: Viewer):
    first = visit(viewer)
    second = visit(viewer)
    drag(first, -20, 100)
    held = settled(first, "inside")
    assert "watching" in settled(second, "watching")["flags"]
    drag(second, 0, -80)
    second.wait_for_timeout(300)
    assert settled(first)["data"]["position"] == held["data"]["position"]
    keep(second, "watching")
    first.mouse.up()
    second.mouse.up()
    assert let_go(second)["flags"] == ["free"]


def test_a_hidden_tab_lets_go_and_says_so(page: Page, viewer: Viewer):
    drag(page, -20, 100)
    settled(page, "inside")
    turn = """hidden => {
        Object.defineProperty(document, "hidden", {get: () => hidden, configurable: true});
        document.dispatchEvent(new Event("visibilitychange"));
    }"""
    page.evaluate(turn, True)
    assert "background" in page.inner_text("#status")
    assert "background" in page.inner_text("#flags")
    for _ in range(100):
        state = viewer.loop.read()
        if not state.grabbed and state.stalled:
            break
        page.wait_for_timeout(20)
    assert (state.grabbed, state.stalled, state.force.tolist()) == (False, True, [0.0, 0.0, 0.0])
    page.evaluate(turn, False)
    shown = let_go(page)
    assert number(shown["text"]["force-norm"]) == 0.0
    assert shown["flags"] == ["free"]


def test_the_end_of_the_loop_is_shown_and_the_page_returns(visit, keep, complaints, rod: TouchModel):
    with Viewer(rod, port=0) as viewer:
        page = visit(viewer)
        drag(page, -20, 100)
        assert number(settled(page, "inside")["text"]["force-norm"]) > 0.3
        os.kill(viewer.loop.pid, signal.SIGKILL)
        shown = settled(page, "ended")
        keep(page, "ended")
        assert number(shown["text"]["force-norm"]) == 0.0
        assert "real-time process has ended" in page.inner_text("#banner")
        page.mouse.up()
    page.wait_for_selector("#flags [data-flag=lost]")
    assert "disconnected" in page.inner_text("#status")
    assert page.inner_text("#force-norm") == "–"
    keep(page, "disconnected")
    page.evaluate("document.kept = true")
    with Viewer(rod, port=viewer.port, strict_port=True):
        settled(page, "free")
        assert page.evaluate("document.kept")
        assert page.is_hidden("#banner")
        drag(page, -20, 100)
        check_force(rod, settled(page, "inside"), np.zeros(0))
        page.mouse.up()
    with Viewer(spring_beam(), port=viewer.port, strict_port=True):  # another body: a fresh page
        page.wait_for_function("document.getElementById('model-name').textContent === 'spring'")
        page.wait_for_selector("html[data-tick][data-tip]")
        assert not page.evaluate("document.kept")
        page.context.close()
    assert [c for c in complaints if "ERR_CONNECTION_REFUSED" not in c] == []
    complaints.clear()


def two_loads() -> TouchModel:
    """A spring beam with a second load that the hand doesn't supply: it moves the tip and the force."""
    beam = spring_beam()
    inputs = [*beam.inputs, Range("force at midspan", -2.0, 2.0, "N")]
    names = [Quantity(f"u_{c} at node {i}", "m") for i in range(21) for c in "xy"]
    tail = np.hstack([beam.networks["field"].tail, np.zeros((42, 1))])
    tail[1::2, 2] = -0.02 * beam.rest[:, 0]
    force = linear_network(
        [*beam.networks["force"].inputs, inputs[1]], [Quantity("tip", "N")], np.array([[2.5, 2.5, -0.4]])
    )
    field = linear_network(inputs, names, tail)
    networks = {"nodes": field, "field": field, "force": force}
    return dataclasses.replace(beam, name="two loads", networks=networks, mirrors=False)


def test_a_slider_sets_a_load_that_the_hand_does_not_supply(visit, keep):
    model = two_loads()
    with Viewer(model, port=0) as viewer:
        page, other = visit(viewer), visit(viewer)
        page.locator("#parameter-0").fill("1.5")
        page.wait_for_selector('html[data-parameters="1.5"]')
        other.wait_for_function("document.getElementById('parameter-0').value === '1.5'")
        drag(page, 0, 60)
        check_force(model, settled(page, "inside"), np.array([1.5]))
        keep(page, "slider")
        page.context.close()
        other.context.close()


def test_small_displacements_are_drawn_enlarged_and_said_to_be(visit, keep):
    model = dataclasses.replace(spring_beam(160.0), name="stiff")  # reaches 31 mm of 1 m
    with Viewer(model, port=0) as viewer:
        page = visit(viewer, color_scheme="dark")
        assert "displacement drawn × 10" in page.inner_text("#scale-notes")
        drag(page, 0, 50)
        shown = settled(page, "inside")
        keep(page, "enlarged-dark")
        check_force(model, shown, np.zeros(0))
        page.mouse.up()
        settled(page, "free")
        page.click("#true-scale")
        assert "displacement to scale" in page.inner_text("#scale-notes")
        drag(page, 0, 5)
        finer = settled(page, "inside")
        ratio = vector(finer["data"], "position")[1] / vector(shown["data"], "position")[1]
        assert ratio == pytest.approx(1.0, rel=0.3)  # a tenth of the way at ten times the scale, to a pixel
        page.context.close()


def test_messages_mean_the_same_in_typescript(page: Page):
    for before in map(sample, typescript.BINARY):
        read, back = page.evaluate(
            """async ([name, text]) => {
                const m = await import("/assets/messages.js");
                const bytes = Uint8Array.from(atob(text), c => c.charCodeAt(0));
                const value = m["decode" + name](bytes.buffer);
                const back = new Uint8Array(m["encode" + name](value));
                const plain = JSON.stringify(value, (_, v) => v instanceof Float32Array ? [...v] : v);
                return [plain, btoa(String.fromCharCode(...back))];
            }""",
            [type(before).__name__, base64.b64encode(before.pack()).decode()],
        )
        assert base64.b64decode(back) == before.pack()
        values = dataclasses.asdict(before)
        plain = {k: v.tolist() if isinstance(v, np.ndarray) else v for k, v in values.items()}
        assert json.loads(read) == json.loads(json.dumps(plain))
    for message in (HELLO, Notice("what", "why", "fix")):
        back, known = page.evaluate(
            """async ([name, text]) => {
                const m = await import("/assets/messages.js");
                const value = JSON.parse(text);
                return [JSON.stringify(value), m["is" + name](value)];
            }""",
            [type(message).__name__, message.to_json()],
        )
        assert known
        assert type(message).from_json(back) == message
