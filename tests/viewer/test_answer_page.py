"""The page of a surrogate that no hand feels, in a real browser: from disk without a network, and served."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from chromium_page import assert_no
from playwright.sync_api import Browser, Page

import palpate as pp
from answering import LENGTH, RANGES, answering, plate_mesh, quantities, rod_solves
from palpate.network.radial import radial
from palpate.surrogates import LearntQuantities, MeshPlaces, ModalField, Surrogate
from palpate.viewer import answer_page
from palpate.viewer.answer_viewer import AnswerViewer
from palpate.viewer.file_page import export_html
from waiting import wait_for

PHONE = {"width": 390, "height": 844}
WIDE = {"width": 1440, "height": 900}


def plate() -> Surrogate:
    """The rod's answers as a plate, with a displacement upwards and a heat flux in its cells beside them."""
    body, (points, triangles) = answering(), plate_mesh()
    points = np.hstack([points, np.zeros((len(points), 1))])
    mesh, cells = (
        MeshPlaces(points, triangles),
        MeshPlaces(points, triangles, "cells", points[triangles].mean(axis=1), np.arange(len(triangles))),
    )
    bend = np.stack([np.zeros((2, len(points), 3)), np.zeros((2, len(points), 3))])[0]
    bend[0, :, 2], bend[1, :, 0] = 1e-4 * np.sin(np.pi * points[:, 0] / LENGTH), 1e-5
    moved = ModalField(
        "displacement",
        "m",
        mesh,
        quantities(("a", "b"), "m"),
        np.zeros((len(points), 3)),
        bend,
        np.full((len(points), 3), 1e-7),
        components=("x", "y", "z"),
    )
    flux = ModalField(
        "flux",
        "W/m²",
        cells,
        quantities(("a", "b"), "W/m²"),
        np.arange(len(triangles), dtype=float)[:, None],
        np.ones((2, len(triangles), 1)),
        np.ones((len(triangles), 1)),
    )
    return replace(body, fields={**body.fields, "displacement": moved, "flux": flux})


def opened(browser: Browser, address: str, **options: Any) -> tuple[Page, list[str]]:
    """Return the page at an address, once it answers, and what the browser complains of."""
    options.setdefault("viewport", WIDE)
    page, complaints = browser.new_context(**options).new_page(), []
    page.on("console", lambda m: complaints.append(m.text) if m.type in {"error", "warning"} else None)
    page.on("pageerror", lambda error: complaints.append(str(error)))
    page.goto(address)
    page.wait_for_selector("html[data-ready]", state="attached")
    return page, complaints


@pytest.fixture(scope="module")
def plate_page(browser: Browser, tmp_path_factory) -> Iterator[tuple[Page, list[str], Surrogate]]:
    """The plate's page from disk, without a network."""
    body = plate()
    done = export_html(body, tmp_path_factory.mktemp("plate") / "plate.html")
    assert done.left_out == ()
    page, complaints = opened(browser, done.file.as_uri(), offline=True)
    yield page, complaints, body
    page.context.close()


def inside_and_beyond(count: int) -> np.ndarray:
    """Inputs (count, 2) in the trained ranges and around them."""
    low, high = np.array([[r.low, r.high] for r in RANGES]).T
    return np.random.default_rng(0).uniform(low - 0.2 * (high - low), high + 0.2 * (high - low), (count, 2))


def rounding_of_deviation(part: LearntQuantities, row: np.ndarray) -> float:
    """The relative rounding error of the deviation at one input: the form 1 + rᵀMr is small beside its terms."""
    sure = part.uncertainty
    if sure is None or not sure.coefficients.size:
        return 0.0
    xs = sure.network.scaling.scale_inputs(row)
    q = ((np.einsum("kri,ni->nkr", sure.network.factors, xs) - sure.network.shifts) ** 2).sum(axis=2)
    r, M = np.hstack([[[1.0]], xs])[0], sure.coefficients
    r = np.concatenate([r[: len(M) - sure.network.units], radial(sure.network.radial, q)[0][0]])
    # half of the form's relative error (n ε Σ |terms|, Higham 2002, 3.1), since the deviation is its root
    terms = np.abs(r) @ np.abs(M) @ np.abs(r)
    return float(0.5 * len(M) * np.finfo(float).eps * terms / abs(1.0 + r @ M @ r))


def assert_equal(got: Any, wanted: np.ndarray, tolerance: float = 1e-6) -> None:
    """Compare to a share of the largest; unknown deviations come as null."""
    got = np.array(got, dtype=float).reshape(wanted.shape)
    size = np.nanmax(np.abs(wanted)) if np.isfinite(wanted).any() else 1.0
    np.testing.assert_allclose(got, wanted, rtol=0, atol=tolerance * size)


def compare(page: Page, body: Surrogate, X: np.ndarray) -> None:
    """Compare all that a page computes with palpate."""
    for x in X:
        got, row = page.evaluate("(x) => palpate.ask(x)", x.tolist()), x[None]
        for told, part in zip(got["numbers"], body.quantities.values(), strict=True):
            assert_equal(told["values"], part.predict(row)[0])
            assert_equal(told["deviation"], part.deviation(row)[0], 1e-6 + rounding_of_deviation(part, row))
            assert told["trusted"] == bool(part.trusted(row)[0])
        for kind, curves in (("fields", False), ("curves", True)):
            shown = [field for field in body.fields.values() if field.is_curve is curves]
            for told, field in zip(got[kind], shown, strict=True):
                assert_equal(told["values"], field.values(row)[0])
                assert_equal(told["deviation"], field.deviation(row)[0])
                assert told["trusted"] == bool(field.trusted(row)[0])


def test_the_page_answers_as_palpate_does(plate_page: tuple[Page, list[str], Surrogate]):
    page, complaints, body = plate_page
    compare(page, body, inside_and_beyond(20))
    assert_no(complaints)


def test_a_slider_changes_the_numbers_and_the_address(plate_page: tuple[Page, list[str], Surrogate]):
    page, complaints, body = plate_page
    slider = page.locator("#answer-inputs input[name=heat]")
    slider.focus()
    slider.press("End")
    x = np.array([[RANGES[0].high, (RANGES[1].low + RANGES[1].high) / 2]])
    told = float(page.locator("#numbers output").get_attribute("data-value"))
    assert told == pytest.approx(body.quantities["largest"].predict(x)[0, 0], rel=1e-9)
    again, more = opened(page.context.browser, page.url, offline=True)
    assert again.locator("#answer-inputs input[name=heat]").input_value() == str(int(RANGES[0].high))
    assert float(again.locator("#numbers output").get_attribute("data-value")) == told
    again.context.close()
    assert_no(complaints + more)


def test_a_click_reads_the_value_there(plate_page: tuple[Page, list[str], Surrogate]):
    page, complaints, body = plate_page
    page.get_by_role("button", name="temperature", exact=True).click()
    box = page.locator("#view").bounding_box()
    page.mouse.click(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    reading = page.locator("#reading")
    words = reading.text_content()
    assert words.startswith("temperature")
    x = [float(page.locator(f"#answer-inputs input[name={r.name}]").input_value()) for r in RANGES]
    values = body.fields["temperature"].values(np.array([x]))[0]
    place = np.array([float(v.replace("−", "-")) for v in words.split("(")[1].split(")")[0].split(",")]) / 1e3
    # linear on the triangle that holds the place, by its three areas
    points, triangles = plate_mesh()
    corners = points[triangles]
    sides = np.stack([corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]], axis=2)
    u, v = np.linalg.solve(sides, (place[:2] - corners[:, 0])[..., None])[..., 0].T
    t = int(np.argmax(np.minimum(np.minimum(u, v), 1.0 - u - v)))
    wanted = np.array([1.0 - u[t] - v[t], u[t], v[t]]) @ values[triangles[t], 0]
    # the page says the place to three digits
    assert float(reading.get_attribute("data-value")) == pytest.approx(wanted, abs=5e-3 * np.ptp(values))
    assert_no(complaints)


@pytest.mark.full
def test_every_colouring_is_drawn(plate_page: tuple[Page, list[str], Surrogate]):
    page, complaints, _ = plate_page
    buttons = page.locator("#fields button")
    names = buttons.all_text_contents()
    assert {"temperature", "displacement", "displacement z", "flux"} <= set(names)
    for i, name in enumerate(names):
        buttons.nth(i).click()
        page.wait_for_selector(f'html[data-drawn="{name}"]', state="attached")
        assert name in page.locator("#legend-title").text_content()
    assert_no(complaints)


@pytest.mark.full
def test_a_learnt_table_shows_numbers_and_a_response(browser: Browser, tmp_path):
    X = np.random.default_rng(0).uniform(0.0, 1.0, (40, 2))
    Y = np.stack([np.sin(3.0 * X[:, 0]) + X[:, 1] ** 2, X[:, 0] * X[:, 1]], axis=1)
    body = pp.fit(X, Y).surrogate("table")
    page, complaints = opened(browser, export_html(body, tmp_path / "table.html").file.as_uri(), offline=True)
    compare(page, body, np.random.default_rng(1).uniform(-0.2, 1.2, (20, 2)))
    assert page.locator("#numbers output").count() == 2
    assert not page.locator("#view").is_visible()
    drawn = "(c) => c.getContext('2d').getImageData(0, 0, c.width, c.height).data.some((v) => v > 0)"
    assert page.locator("#response").evaluate(drawn)
    page.locator("#to-nearest").click()
    x = [float(slider.input_value()) for slider in page.locator("#answer-inputs input").all()]
    assert np.abs(X - x).max(axis=1).min() < 1e-3
    assert_no(complaints)
    page.context.close()


@pytest.mark.full
def test_a_phone_scrolls_down_only_and_every_target_is_44_px(browser: Browser, tmp_path):
    file = export_html(plate(), tmp_path / "plate.html").file
    page, complaints = opened(browser, file.as_uri(), viewport=PHONE, has_touch=True, offline=True)
    assert page.evaluate("document.documentElement.scrollWidth") <= PHONE["width"]
    for target in page.locator("button:visible, select:visible, input:visible, summary:visible").all():
        box = target.bounding_box()
        assert box["height"] >= 44.0, target.evaluate("e => e.outerHTML")
        assert box["width"] >= 44.0, target.evaluate("e => e.outerHTML")
    assert_no(complaints)
    page.context.close()


@pytest.mark.full
def test_the_served_page_is_the_same(browser: Browser):
    body = plate()
    with AnswerViewer(body, port=0) as viewer:
        page, complaints = opened(browser, viewer.url)
        compare(page, body, inside_and_beyond(3))
        assert_no(complaints)
        page.context.close()


def test_a_field_without_room_is_left_out_by_name(monkeypatch: pytest.MonkeyPatch, tmp_path):
    monkeypatch.setattr(answer_page, "LARGEST", 0)
    assert export_html(plate(), tmp_path / "plate.html").left_out == ("temperature", "displacement", "flux")


def test_the_nearest_solve_is_drawn_beside_with_its_own_values(browser: Browser, tmp_path):
    data = rod_solves(names=("temperature", "flux"))
    body, _ = pp.learn(data, name="rod")
    page, complaints = opened(browser, export_html(body, tmp_path / "rod.html").file.as_uri(), offline=True)
    row = 7  # a solve: near it, it is the nearest
    low, high = np.array([[r.low, r.high] for r in RANGES]).T
    x = data.X[row] + 1e-3 * (high - low)
    told = page.evaluate("(x) => palpate.ask(x)", x.tolist())["nearest"]
    for values, facts in zip(told, page.evaluate("palpate.facts.fields"), strict=True):
        wanted = data[facts["name"]][row].ravel()
        # modes in single precision
        np.testing.assert_allclose(values, wanted, atol=1e-4 * np.ptp(data[facts["name"]]))
    before = page.locator("#view").screenshot()
    button = page.locator("#beside")
    button.click()
    assert button.get_attribute("aria-pressed") == "true"
    assert "right: the nearest solve" in page.locator("#scale-notes").text_content()
    wait_for(lambda: page.locator("#view").screenshot() != before)
    button.click()
    assert "nearest solve" not in page.locator("#scale-notes").text_content()
    assert_no(complaints)
    page.context.close()
