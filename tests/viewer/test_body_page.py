"""The page of a solved body in a real browser: states, colours, scale, and what its pixels say."""

from __future__ import annotations

import io
from collections.abc import Iterator

import matplotlib.image
import numpy as np
import pytest
from blocks import ball, dents
from chromium_page import assert_no
from playwright.sync_api import Browser, Page, expect

from palpate.viewer import BodyViewer
from palpate.viewer.shown_body import ShownBody, ShownStep
from palpate.viewer.web_server import way_in

pytestmark = [pytest.mark.full, pytest.mark.timeout(120)]


@pytest.fixture(scope="module")
def block_viewer() -> Iterator[BodyViewer]:
    with BodyViewer(dents(), name="pressed block", port=0) as running:
        yield running


def open_body(browser: Browser, viewer: BodyViewer, complaints: list[str], **options) -> Page:
    options.setdefault("viewport", {"width": 1060, "height": 640})
    page = browser.new_context(**options).new_page()
    page.on("console", lambda m: complaints.append(m.text) if m.type in {"error", "warning"} else None)
    page.on("pageerror", lambda error: complaints.append(str(error)))
    local = (viewer.address, "data:", "blob:")
    page.on("request", lambda r: None if r.url.startswith(local) else complaints.append(f"asks {r.url}"))
    page.goto(viewer.url)
    page.wait_for_selector('html[data-drawn="0"]')
    return page


@pytest.fixture
def body_page(browser: Browser, block_viewer: BodyViewer, complaints: list[str]) -> Iterator[Page]:
    page = open_body(browser, block_viewer, complaints)
    yield page
    page.context.close()
    assert_no(complaints)


def go(page: Page, step: int) -> None:
    page.locator("#state").fill(str(step))
    page.wait_for_selector(f'html[data-drawn="{step}"]')


def canvas_pixels(page: Page) -> np.ndarray:
    """Red, green and blue of the canvas at rest, in all its pixels, without its rim, where the mark of the focus is."""
    for _ in range(100):
        if page.locator("#view").evaluate("c => c.clientWidth * devicePixelRatio - c.width") <= 1.0:
            break
        page.wait_for_timeout(100)
    return matplotlib.image.imread(io.BytesIO(page.locator("#view").screenshot()))[4:-4, 4:-4, :3]


def share_of(page: Page, test) -> float:
    """Share of the canvas, above the legend, whose colours (red, green, blue) pass a test."""
    pixels = canvas_pixels(page)
    return float(np.mean(test(*np.moveaxis(pixels[: int(0.85 * len(pixels))], 2, 0))))


def purple(r: np.ndarray, g: np.ndarray, b: np.ndarray) -> np.ndarray:
    return (b > g + 0.12) & (b > r + 0.05) & (g < 0.4)


def test_states_their_figures_and_colours(body_page: Page, keep, block_viewer: BodyViewer):
    page, steps = body_page, block_viewer.body.steps
    expect(page.locator("#model-name")).to_have_text("pressed block")
    expect(page.locator("#legend-title")).to_have_text("displacement (mm)")
    page.locator("#show-probe").uncheck()  # it would cover the dent
    assert share_of(page, purple) == 0.0  # at rest nothing is near the scale's end
    for step in (3, 5):
        go(page, step)
        largest = np.linalg.norm(steps[step].displacement, axis=1).max()
        shown = float(page.evaluate("document.documentElement.dataset.largest"))
        assert shown == pytest.approx(largest, rel=2**-22)
        expect(page.locator("#largest")).to_have_text(f"{1e3 * largest:g}")
        expect(page.locator("#state-count")).to_have_text(f"{step + 1} of 6")
    expect(page.locator("#figures")).to_contain_text("0.8 N")
    assert share_of(page, purple) > 1e-4
    page.locator("#show-probe").check()
    keep(page, "body-displacement")
    page.get_by_role("button", name="von Mises stress").click()
    expect(page.locator("#legend-title")).to_have_text("von Mises stress (Pa)")
    largest = block_viewer.body.steps[5].values["von Mises stress"].max()
    shown = float(page.evaluate("document.documentElement.dataset.largest"))
    assert shown == pytest.approx(largest, rel=2**-22)
    keep(page, "body-von-mises")


def test_layers_scale_keys_and_turning(body_page: Page, keep):
    page = body_page
    go(page, 4)
    before = canvas_pixels(page)
    page.locator("#show-mesh").check()
    with_mesh = canvas_pixels(page)
    assert np.mean(np.abs(with_mesh - before) > 0.02) > 0.05
    page.locator("#show-probe").uncheck()
    page.locator("#factor").fill("2")
    expect(page.locator("#factor-label")).to_have_text("× 2")
    expect(page.locator("#scale-notes")).to_contain_text("displacement drawn × 2")
    keep(page, "body-mesh")
    page.focus("#view")
    page.keyboard.press("ArrowLeft")
    page.wait_for_selector('html[data-drawn="3"]')
    still = canvas_pixels(page)
    page.mouse.move(300, 300)
    page.mouse.down()
    page.mouse.move(420, 260, steps=4)
    page.mouse.up()
    page.wait_for_timeout(100)
    assert np.mean(np.abs(canvas_pixels(page) - still) > 0.05) > 0.05
    keep(page, "body-turned")
    page.click("#reset-view")
    page.wait_for_timeout(100)
    assert np.mean(np.abs(canvas_pixels(page) - still) > 0.05) < 0.01


def test_playing_goes_round(body_page: Page):
    body_page.click("#play")
    for step in (2, 5, 1):
        body_page.wait_for_selector(f'html[data-drawn="{step}"]')
    body_page.click("#play")
    expect(body_page.locator("#play")).to_have_text("play")


@pytest.mark.parametrize(("width", "height", "scheme"), [(390, 780, "light"), (1060, 640, "dark")])
def test_one_state_on_small_and_dark_screens(
    browser: Browser, complaints: list[str], keep, width: int, height: int, scheme: str
):
    with BodyViewer(dents(2, 0.008)[-1], name="one dent", port=0) as viewer:
        page = open_body(
            browser, viewer, complaints, viewport={"width": width, "height": height}, color_scheme=scheme
        )
        assert page.is_hidden("#states")
        assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")
        keep(page, f"body-{width}-{scheme}")
        page.context.close()
    assert_no(complaints)


def test_shading_is_smooth_across_the_facets_of_a_ball(browser: Browser, complaints: list[str], keep):
    points, triangles = ball(8)
    with BodyViewer(ShownBody("ball", points, triangles, [ShownStep(0 * points)]), port=0) as viewer:
        page = open_body(browser, viewer, complaints)
        page.locator("#show-ghost").uncheck()
        page.wait_for_timeout(100)
        keep(page, "body-ball")
        pixels = canvas_pixels(page).mean(axis=2)
        dark = pixels < 0.6
        row = pixels[int(np.mean(np.flatnonzero(dark.any(axis=1))))]
        inside = np.flatnonzero(row < 0.6)
        middle = row[inside[0] + len(inside) // 5 : inside[-1] - len(inside) // 5]
        # facets of 22 degrees, each in one shade, would jump by 0.02 within three pixels
        assert np.abs(middle[3:] - middle[:-3]).max() < 0.01
        page.context.close()
    assert_no(complaints)


def test_the_file_that_opens_the_page_leaves_a_cookie_and_no_token(
    browser: Browser, block_viewer: BodyViewer, complaints: list[str]
):
    page = browser.new_context().new_page()
    with way_in(block_viewer) as file:
        page.goto(file)
        page.wait_for_url(block_viewer.address)
    page.wait_for_selector('html[data-drawn="0"]')
    page.reload()  # the cookie suffices
    page.wait_for_selector('html[data-drawn="0"]')
    assert page.evaluate("document.cookie") == ""
    (cookie,) = page.context.cookies()
    assert (cookie["httpOnly"], cookie["sameSite"], cookie["expires"]) == (True, "Strict", -1)
    page.context.close()
    assert_no(complaints)
