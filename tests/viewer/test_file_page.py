"""A body as one HTML file, opened from disk in a real browser without a network."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from chromium_page import assert_no
from playwright.sync_api import Browser, Page
from slabs import family

from palpate.errors import UsageError
from palpate.surrogates import Surrogate
from palpate.viewer.file_page import export_html

ASK = """(X) => {
  const { evaluator } = palpate;
  return X.map((x) => {
    const { flags, energy, force, stiffness } = evaluator.answer(x.slice(0, 3), x.slice(3));
    return [flags, energy, ...force, ...stiffness, evaluator.deviation(x.slice(0, 3), x.slice(3))];
  });
}"""


@pytest.fixture(scope="module")
def pressed() -> Surrogate:
    """A slab that relaxes, with a further input."""
    return replace(family(), meta={"name": "slab"})


@pytest.fixture(scope="module")
def opened(pressed: Surrogate, browser: Browser, tmp_path_factory) -> Iterator[tuple[Page, list[str]]]:
    """The page of a pressed body with a field and a memory, and what the browser complains of."""
    done = export_html(pressed, tmp_path_factory.mktemp("page") / "body.html")
    assert done.comparison is not None
    assert done.comparison.passed
    assert done.file.stat().st_size < 5_000_000
    context = browser.new_context(viewport={"width": 1200, "height": 800}, offline=True)
    page, complaints = context.new_page(), []
    page.on("console", lambda message: complaints.append(message.text) if message.type == "error" else None)
    page.on("pageerror", lambda error: complaints.append(str(error)))
    page.on(
        "request",
        lambda request: (
            None if request.url.startswith(("file:", "data:", "blob:")) else complaints.append(request.url)
        ),
    )
    page.goto(done.file.as_uri())
    page.wait_for_function("document.documentElement.dataset.middle !== undefined")
    yield page, complaints
    context.close()


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


def test_the_page_is_pressed_with_the_mouse(opened: tuple[Page, list[str]]):
    page, complaints = opened
    x, y = map(float, page.evaluate("document.documentElement.dataset.middle").split())
    page.mouse.move(x, y)
    page.mouse.down()
    page.wait_for_function("parseFloat(document.getElementById('force-norm').textContent) > 0")
    page.wait_for_function("document.documentElement.dataset.sinking === 'false'")
    # the curve of force over depth has been drawn
    drawn = "(c) => c.getContext('2d').getImageData(0, 0, c.width, c.height).data.some((v) => v > 0)"
    assert page.locator("#curve-plot").evaluate(drawn)
    page.mouse.up()
    page.wait_for_function("parseFloat(document.getElementById('force-norm').textContent) === 0")
    assert page.locator("#about").is_visible()
    assert not page.locator("#timing").is_visible()  # there is no loop
    assert_no(complaints)


def test_a_page_is_refused_where_its_shape_has_no_c_source(rod: Surrogate, tmp_path: Path):
    with pytest.raises(UsageError, match="drawn as a line"):
        export_html(rod, tmp_path / "rod.html")
    assert rod._repr_html_() is None
    assert not any(tmp_path.iterdir())


def test_a_notebook_shows_the_page(pressed: Surrogate):
    bare = replace(pressed, meta={"name": "<b>body</b>"})
    shown = bare._repr_html_()
    assert shown.startswith("<iframe srcdoc=")
    assert "<b>body</b>" not in shown
    assert "<title>&lt;b&gt;body&lt;/b&gt;" in bare.to_html()
