"""A body as one HTML file, opened from disk in a real browser without a network."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from bodies import loaded_twice
from chromium_page import assert_no, open_file
from playwright.sync_api import Browser, Page
from slabs import carried_slab, dents, family, touched_slab

from palpate.runtime.touchable import touchable
from palpate.surrogates import Surrogate
from palpate.viewer import file_page
from palpate.viewer.file_page import export_html
from palpate.viewer.indentation_drawing import IndentationDrawing

ASK = """(X) => {
  const { evaluator } = palpate;
  return X.map((x) => {
    const { flags, energy, force, stiffness } = evaluator.answer(x.slice(0, 3), x.slice(3));
    return [flags, energy, ...force, ...stiffness, evaluator.deviation(x.slice(0, 3), x.slice(3))];
  });
}"""


PARTS = """() => {
  const { surface: { rest, triangles, touchable }, fields } = palpate;
  const list = (numbers) => Array.from(numbers);
  const all = fields.map((field) =>
    Object.fromEntries(["rest", "modes", "touched", "shares"].map((name) => [name, list(field[name])])));
  return { rest: list(rest), triangles: list(triangles), touchable: list(touchable), fields: all };
}"""
KEPT = """() => {
  const { surface: { rest, yielding, normals }, evaluator, kept } = palpate;
  const points = Array.from(yielding, (i) => Array.from(rest.slice(3 * i, 3 * i + 3))).flat();
  const [amplitudes, depths] = [evaluator.amplitudes, kept.depths].map((numbers) => Array.from(numbers));
  return { points, normals: Array.from(normals), amplitudes, depths };
}"""


@pytest.fixture(scope="module")
def pressed() -> Surrogate:
    """A slab that relaxes, with a further input."""
    return replace(family(), meta={"name": "slab", "runtime": {"max_force": 12.0, "rate": 1000.0}})


@pytest.fixture(scope="module")
def opened(pressed: Surrogate, browser: Browser, tmp_path_factory) -> Iterator[tuple[Page, list[str]]]:
    """The page of a pressed body with a memory, and what the browser complains of."""
    done = export_html(pressed, tmp_path_factory.mktemp("page") / "body.html")
    assert done.comparison is not None
    assert done.comparison.passed
    assert done.file.stat().st_size < 5_000_000
    page, complaints = open_file(browser, done.file)
    yield page, complaints
    page.context.close()


@pytest.fixture(scope="module")
def yielding() -> Surrogate:
    """A slab that keeps indentations, with a displacement and a stretch."""
    return touched_slab().with_memory(dents(0.002), spacing=0.002)


@pytest.fixture(scope="module")
def opened_yielding(
    yielding: Surrogate, browser: Browser, tmp_path_factory
) -> Iterator[tuple[Page, list[str]]]:
    """Its page."""
    done = export_html(yielding, tmp_path_factory.mktemp("yielding") / "body.html")
    assert done.left_out == ()
    assert done.comparison is not None
    assert {"field displacement", "field largest stretch"} <= set(done.comparison.parts)
    page, complaints = open_file(browser, done.file)
    yield page, complaints
    page.context.close()


def test_the_page_answers_as_palpate_does(opened: tuple[Page, list[str]], pressed: Surrogate):
    page, complaints = opened
    low, high = np.array([[r.low, r.high] for r in pressed.inputs]).T
    X = np.random.default_rng(0).uniform(low, high, (50, len(low)))
    got, energy = np.array(page.evaluate(ASK, X.tolist())), pressed.energy
    for column, wanted in (
        (slice(1, 2), energy.energy(X)[:, None]),
        (slice(2, 5), energy.force(X)),
        (slice(5, 14), energy.stiffness(X).reshape(len(X), 9)),
    ):
        np.testing.assert_allclose(got[:, column], wanted, rtol=0, atol=1e-12 * np.abs(wanted).max())
    if energy.root is not None:
        np.testing.assert_allclose(got[:, 14], energy.deviation(X), rtol=1e-5)
    assert_no(complaints)


@pytest.mark.full
def test_the_page_is_pressed_with_the_mouse(opened: tuple[Page, list[str]]):
    page, complaints = opened
    press(page)
    # the curve of force over depth has been drawn
    drawn = "(c) => c.getContext('2d').getImageData(0, 0, c.width, c.height).data.some((v) => v > 0)"
    assert page.locator("#curve-plot").evaluate(drawn)
    page.mouse.up()
    page.wait_for_function("parseFloat(document.getElementById('force-norm').textContent) === 0")
    assert page.locator("#about").is_visible()
    assert not page.locator("#timing").is_visible()  # there is no loop
    assert_no(complaints)


def test_the_page_shows_its_model_card(opened: tuple[Page, list[str]], pressed: Surrogate):
    page, _ = opened
    shown = page.locator("#meta").text_content()
    card = json.loads(page.locator("#palpate-card").text_content())
    for words in (
        *card["limits"],
        *card["warnings"],
        *card["hashes"].values(),
    ):
        assert words in shown
    assert page.locator("#meta dt:text-is('force limit') + dd").text_content() == "12 N"
    assert "limited to 12 N" in " ".join(card["limits"])
    assert card["author"] not in shown, "nobody is told what the file does not say"
    assert "real-time loop" not in page.locator("#flags").inner_text()  # there is none that could be late


LINE = """(X) => {
  const { line, hello } = palpate;
  return X.map(([force, ...further]) => Array.from(line.held([0, 0, 0], [0, force, 0], further, 0)));
}"""


@pytest.fixture(scope="module")
def opened_line(
    rod: Surrogate, browser: Browser, tmp_path_factory
) -> Iterator[tuple[Page, list[str], Surrogate]]:
    """The page of a body drawn as a line, with a further input."""
    body = loaded_twice(rod)
    done = export_html(body, tmp_path_factory.mktemp("line") / "rod.html")
    assert done.comparison is not None
    assert done.comparison.passed
    assert "line" in done.comparison.parts
    page, complaints = open_file(browser, done.file)
    yield page, complaints, body
    page.context.close()


def test_a_line_bends_on_its_page_as_palpate_bends_it(opened_line: tuple[Page, list[str], Surrogate]):
    page, complaints, body = opened_line
    field = body.fields["displacement"]
    low, high = np.array([[r.low, r.high] for r in field.inputs]).T
    X = np.random.default_rng(0).uniform(low, high, (50, 2))
    got = np.array(page.evaluate(LINE, X.tolist())).reshape(50, -1, 3)
    np.testing.assert_allclose(got, field.values(X), rtol=0, atol=1e-6)  # single precision is drawn
    # and its force is that of the energy, further input and all
    low, high = np.array([[r.low, r.high] for r in body.inputs]).T
    U = np.random.default_rng(0).uniform(low, high, (50, 2))
    places = np.column_stack([U[:, :1] @ body.energy.baseline.directions, U[:, 1]])
    force = np.array(page.evaluate(ASK, places.tolist()))[:, 2:5]
    np.testing.assert_allclose(force, body.energy.force(U), rtol=0, atol=1e-12 * np.abs(force).max())
    assert_no(complaints)


def test_a_further_input_of_a_line_is_a_slider_that_bends_it(opened_line: tuple[Page, list[str], Surrogate]):
    page, complaints, _ = opened_line
    slider = page.locator("#parameter-0")
    before = page.evaluate("document.documentElement.dataset.tip")
    slider.fill("2")
    page.wait_for_function("(tip) => document.documentElement.dataset.tip !== tip", arg=before)
    assert_no(complaints)


@pytest.mark.full
def test_a_notebook_shows_the_page(pressed: Surrogate):
    bare = replace(pressed, meta={"name": "<b>body</b>"})
    shown = bare._repr_html_()
    assert shown.startswith("<iframe srcdoc=")
    # no allow-same-origin: the page reaches neither the notebook nor its server
    assert 'sandbox="allow-scripts allow-downloads"' in shown
    assert "<b>body</b>" not in shown
    assert "<title>&lt;b&gt;body&lt;/b&gt;" in bare.to_html()
    assert "three.js authors" in bare.to_html()  # whose licence goes with their code
    hostile = replace(pressed, meta={"name": "<!--<script>"}).to_html()
    assert "<!--" not in hostile.partition("<body>")[2].replace("palpate-card", "")


@pytest.mark.full
def test_a_body_that_was_loaded_shows_itself_without_the_viewer_being_imported(
    pressed: Surrogate, tmp_path: Path
):
    file = pressed.save(tmp_path / "slab.palpate")
    program = """
import sys
import palpate as pp
body = pp.load(sys.argv[1])
assert "palpate.viewer" not in sys.modules
print(body._repr_html_()[:15])
"""
    done = subprocess.run(
        [sys.executable, "-c", program, str(file)], capture_output=True, text=True, check=True
    )
    assert done.stdout.strip() == "<iframe srcdoc="


@pytest.mark.full
def test_the_surface_and_its_fields_are_those_of_the_body(
    opened_yielding: tuple[Page, list[str]], yielding: Surrogate
):
    page, _ = opened_yielding
    got = page.evaluate(PARTS)
    rest = np.reshape(got["rest"], (-1, 3))
    shown = yielding.fields["displacement"]
    nodes = nearest_nodes(rest, shown.points)
    assert np.abs(rest - shown.points[nodes]).max() < 1e-5 * np.ptp(shown.points)
    triangles = nodes[np.reshape(got["triangles"], (-1, 3)).astype(int)]
    assert turned(triangles) == turned(shown.triangles)
    touched = {tuple(sorted(t)) for t in triangles[np.array(got["touchable"]) > 0].tolist()}
    assert touched == {tuple(sorted(t)) for t in shown.triangles.tolist() if (shown.points[t, 2] == 0).all()}
    for name, field in zip(yielding.fields, got["fields"], strict=True):
        own = yielding.fields[name]
        X = deep_touches(yielding)
        modes = np.reshape(field["modes"], (len(own.modes), len(rest), -1))
        off = np.tensordot(own.coefficients(X), modes - own.modes[:, nodes], axes=1)
        off += np.reshape(field["rest"], (len(rest), -1)) - own.rest[nodes]
        assert np.abs(off).max() <= 1e-4 * np.abs(own.values(X) - own.rest).max()
        assert set(np.array(field["touched"], dtype=int)) == set(np.flatnonzero(own.touched[nodes]))


@pytest.mark.full
def test_a_page_carries_the_body_s_own_surface(browser: Browser, tmp_path: Path):
    body = carried_slab()
    done = export_html(body, tmp_path / "carried.html")
    page, complaints = open_file(browser, done.file)
    got, shown = page.evaluate(PARTS), body.fields["displacement"]
    points, triangles = shown.pictured
    rest = np.reshape(got["rest"], (-1, 3))
    nodes = nearest_nodes(rest, points)
    assert np.abs(rest - points[nodes]).max() < 1e-5 * np.ptp(points)
    assert turned(nodes[np.reshape(got["triangles"], (-1, 3)).astype(int)]) == turned(triangles)
    X = deep_touches(body)
    for own, field in zip(body.fields.values(), got["fields"], strict=True):
        modes = np.reshape(field["modes"], (len(own.modes), len(rest), -1))
        off = np.tensordot(own.coefficients(X), modes - own.at_pictured(own.modes)[:, nodes], axes=1)
        off += np.reshape(field["rest"], (len(rest), -1)) - own.at_pictured(own.rest)[nodes]
        # a binding's weights have steps of 1/2,048 of a triangle's side, an eighth of the slab
        assert np.abs(off).max() <= 1e-3 * np.abs(own.values(X) - own.rest).max()
        shares = own.at_pictured(own.touched[:, None].astype(float))[nodes, 0]
        sparse = np.zeros(len(rest))
        sparse[np.array(field["touched"], dtype=int)] = field["shares"]
        np.testing.assert_allclose(sparse, shares, rtol=0, atol=2e-3)
    press(page)
    assert_no(complaints)
    page.context.close()


@pytest.mark.full
def test_another_field_colours_the_body(opened_yielding: tuple[Page, list[str]]):
    page, complaints = opened_yielding
    page.get_by_role("button", name="largest stretch").click()
    assert page.locator("#legend-title").inner_text() == "largest stretch"
    press(page)
    assert float(page.evaluate("document.documentElement.dataset.largest")) > 1.0
    page.mouse.up()
    page.get_by_role("button", name="displacement").click()
    assert_no(complaints)


@pytest.mark.full
def test_an_indentation_stays_on_the_page(opened_yielding: tuple[Page, list[str]], yielding: Surrogate):
    page, complaints = opened_yielding
    press(page)
    page.mouse.up()
    page.wait_for_function("parseFloat(document.getElementById('force-norm').textContent) === 0")
    page.wait_for_function("palpate.kept.pending === 0")
    # what is left once the probe is gone: the indentation alone
    page.wait_for_function(
        "Math.abs(document.documentElement.dataset.largest - Math.max(...palpate.kept.depths)) < 1e-6"
    )
    got = page.evaluate(KEPT)
    drawing = IndentationDrawing(touchable(yielding), np.reshape(got["points"], (-1, 3)))
    wanted = drawing.depths(np.array(got["amplitudes"]))
    assert wanted.max() > 2e-4
    np.testing.assert_allclose(got["depths"], wanted, rtol=0, atol=1e-3 * wanted.max())
    np.testing.assert_allclose(np.reshape(got["normals"], (-1, 3)), drawing.normals, rtol=0, atol=1e-3)
    assert_no(complaints)


@pytest.mark.full
def test_fields_for_which_there_is_no_room_are_left_out_and_named(
    yielding: Surrogate, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setattr(file_page, "LARGEST", 500_000)
    done = export_html(yielding, tmp_path / "small.html", check=False)
    assert done.left_out == ("largest stretch",)


def press(page: Page) -> None:
    """Hold the mouse button on the body until the probe is as deep as it goes."""
    x, y = map(float, page.evaluate("document.documentElement.dataset.middle").split())
    page.mouse.move(x, y)
    page.mouse.down()
    page.wait_for_function("parseFloat(document.getElementById('force-norm').textContent) > 0")
    page.wait_for_function("document.documentElement.dataset.sinking === 'false'")


def deep_touches(body: Surrogate) -> np.ndarray:
    """Inputs (40, n) of deep touches."""
    low, high = np.array([[r.low, r.high] for r in body.inputs]).T
    X = np.random.default_rng(1).uniform(low, high, (40, len(low)))
    X[:, 2] = low[2]
    return X


def nearest_nodes(points: np.ndarray, nodes: np.ndarray) -> np.ndarray:
    """The node (n,) nearest to each point."""
    return np.array([((nodes - p) ** 2).sum(axis=1).argmin() for p in points])


def turned(triangles: np.ndarray) -> list[tuple[int, ...]]:
    """Triangles, each from its smallest node on, in order."""
    first = triangles.argmin(axis=1)
    rows = np.take_along_axis(triangles, (first[:, None] + np.arange(3)) % 3, axis=1)
    return sorted(map(tuple, rows.tolist()))
