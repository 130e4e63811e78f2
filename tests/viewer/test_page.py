"""The page in a real browser: pull on the tip, read the force, compare it with the network's own answer."""

from __future__ import annotations

import base64
import dataclasses
import json

import numpy as np
import pytest
from chromium_page import READ, check_force, drag, let_go, number, settled, tip, vector
from playwright.sync_api import Page
from test_messages import WRITTEN, sample

from palpate import format
from palpate.runtime.touchable import touchable
from palpate.surrogates import Surrogate
from palpate.units import Range
from palpate.viewer import Viewer, typescript

pytestmark = pytest.mark.timeout(120)


def test_mouse_pulls_and_the_force_is_the_networks(page: Page, keep, rod: Surrogate):
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
    assert vector(released["data"], "contact") == pytest.approx(0.0, abs=1e-4 * touchable(rod).reach)


@pytest.mark.full
def test_pulling_beyond_the_trained_range_is_flagged(page: Page, keep, rod: Surrogate):
    drag(page, -40, 250)
    shown = settled(page, "outside")
    keep(page, "outside")
    assert shown["data"]["inside"] == "false"
    check_force(rod, shown, np.zeros(0))
    page.mouse.up()
    assert let_go(page)["flags"][0] == "free"


@pytest.mark.full
def test_arrow_keys_pull_and_escape_lets_go(page: Page, rod: Surrogate):
    page.focus("#view")
    for _ in range(15):
        page.keyboard.press("ArrowDown")
    shown = settled(page, "inside")
    at_rest = rod.fields["displacement"].values(np.zeros((1, 1)))[0]  # the network's is not quite 0
    start = at_rest[-1, 1]
    wanted = start - 15 * 0.02 * touchable(rod).reach
    assert vector(shown["data"], "position")[1] == pytest.approx(wanted, rel=2**-22)
    check_force(rod, shown, np.zeros(0))
    page.keyboard.press("Escape")
    let_go(page)


@pytest.mark.full
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
    settled(page)
    assert abs(tip(page)[0] - x) > 5
    assert page.evaluate(READ)["data"]["grabbed"] == "false"
    page.click("#reset-view")
    settled(page)
    assert tip(page)[0] == pytest.approx(x, abs=0.5)


@pytest.mark.full
def test_a_hidden_tab_lets_go_and_says_so(page: Page, viewer: Viewer):
    drag(page, -20, 100)
    settled(page, "inside")
    # the words are read before the next picture, which may be on its way, takes their place
    turn = """hidden => {
        Object.defineProperty(document, "hidden", {get: () => hidden, configurable: true});
        document.dispatchEvent(new Event("visibilitychange"));
        return ["status", "flags"].map(id => document.getElementById(id).innerText);
    }"""
    assert all("background" in words for words in page.evaluate(turn, True))
    while (state := viewer.loop.read()).grabbed or not state.stalled:
        page.wait_for_timeout(20)
    assert state.force.tolist() == [0.0, 0.0, 0.0]
    page.evaluate(turn, False)
    shown = let_go(page)
    assert number(shown["text"]["force-norm"]) == 0.0
    assert shown["flags"][0] == "free"


@pytest.mark.full
@pytest.mark.parametrize(("width", "height"), [(1060, 640), (390, 780)])
def test_the_first_view_has_room_for_all_that_the_tip_can_do(page: Page, keep, width: int, height: int):
    before = page.viewport_size
    page.set_viewport_size({"width": width, "height": height})
    settled(page)
    box = page.locator("#view").bounding_box()
    title = page.locator("#title").bounding_box()
    legend = page.locator("#legend").bounding_box()
    x = tip(page)[0]
    assert 0.4 * box["width"] < x - box["x"] < box["width"] - 15
    for far, name in ((box["y"] + 2, "up"), (box["y"] + box["height"] - 2, "down")):
        drag(page, 0, far - tip(page)[1], steps=2)
        settled(page, "outside")  # the tip is as far as it goes
        keep(page, f"{name}-{width}")
        assert title["y"] + title["height"] < tip(page)[1] < legend["y"]
        page.mouse.up()
        settled(page, "free")
    page.set_viewport_size(before)


@pytest.mark.full
def test_what_is_known_of_the_model_reads_well(page: Page):
    page.click("#about > summary")
    words = " ".join(page.inner_text("#meta").replace("\N{NO-BREAK SPACE}", " ").split())
    for figure in (
        "unseen solves 101",
        "displacement RMSE / full scale 3.4 × 10⁻⁷",
        "force error, 95th percentile 1.2 %",
        "limits kept yes",
    ):
        assert figure in words
    assert "settings" not in words
    page.get_by_text("body", exact=True).click()
    assert "young 2 GPa length 1 m" in " ".join(
        page.inner_text("#meta").replace("\N{NO-BREAK SPACE}", " ").split()
    )
    page.click("#about > summary")


def test_the_pages_numbers_read_as_the_terminals(page: Page):
    values = [
        0.0,
        3.412e-7,
        0.000123,
        0.05,
        0.5,
        0.00056,
        0.9996,
        1.0,
        12.34,
        999.4,
        12345.6,
        987654.0,
        2.5e6,
        -0.02,
        1e9,
    ]
    words = page.evaluate(
        """async values => {
            const m = await import("/assets/units.js");
            return values.map(v => [m.tidy(v, 2), m.tidy(v), m.share(v), m.measured(v, "m"),
                                    m.measured(Math.abs(v), "Pa"), m.interval(-v, v, "m")]);
        }""",
        values,
    )
    for value, said in zip(values, words, strict=True):
        ours = [
            format.plain(value),
            format.plain(value, 3),
            format.share(value),
            format.length(value),
            format.pressure(abs(value)),
            format.interval(Range("", -value, value, "m")).strip() if value > 0 else said[-1],
        ]
        assert [w.replace("\N{NO-BREAK SPACE}", " ").replace("−", "-") for w in said] == [
            w.replace("−", "-") for w in ours
        ]


@pytest.mark.full
def test_what_can_be_dragged_has_its_cursor(page: Page):
    shown = "getComputedStyle(document.getElementById('view')).cursor"
    x, y = tip(page)
    page.mouse.move(x - 120, y + 90)
    assert page.evaluate(shown) == "auto"
    page.mouse.move(x, y)
    assert page.evaluate(shown) == "grab"
    page.mouse.down()
    assert page.evaluate(shown) == "grabbing"
    page.mouse.up()
    let_go(page)


@pytest.mark.grid
@pytest.mark.parametrize("width", [320, 390, 800])
def test_no_button_covers_the_title(page: Page, width: int):
    before = page.viewport_size
    page.set_viewport_size({"width": width, "height": 700})
    boxes = page.evaluate(
        """() => {
            document.getElementById("model-line").textContent = "trained to 6 mm deep, ".repeat(6);
            document.getElementById("status").textContent = "real-time process stands still";
            document.getElementById("true-scale").hidden = false;
            const all = ["title", "tools"].map(id => document.getElementById(id).getBoundingClientRect().toJSON());
            document.getElementById("true-scale").hidden = true;
            return all;
        }"""
    )
    title, tools = boxes
    assert title["right"] <= tools["left"]
    assert title["left"] >= 0
    assert tools["right"] <= width
    page.set_viewport_size(before)


@pytest.mark.full
def test_slow_drawing_lowers_the_resolution_until_nothing_moves(page: Page):
    full = page.evaluate("document.getElementById('view').clientWidth")  # one pixel of the display each
    page.evaluate(
        """() => {
            window.slow = true;
            const wait = () => {
                const end = performance.now() + 60;
                while (performance.now() < end);
                if (window.slow) requestAnimationFrame(wait);
            };
            requestAnimationFrame(wait);
        }"""
    )
    drag(page, -25, 60)
    for i in range(200):
        page.mouse.move(tip(page)[0], 250 + 20 * (i % 5))
        if page.evaluate("document.getElementById('view').width") < 0.8 * full:
            break
    assert page.evaluate("document.getElementById('view').width") < 0.8 * full
    page.evaluate("window.slow = false")
    page.mouse.up()
    page.wait_for_function(f"() => document.getElementById('view').width === {full}")
    let_go(page)


@pytest.mark.full
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
    for message in WRITTEN:
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
