"""A growing network as frames, as lines in a terminal, and as a page that plays it in a browser."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator

import numpy as np
import pytest
from playwright.sync_api import sync_playwright

from palpate.cli.growth_view import growth_lines
from palpate.errors import UsageError
from palpate.learning import PRESETS, learn
from palpate.learning.growth_frames import GrowthRecorder
from palpate.units import Quantity, Range
from palpate.validation.report.growth_page import growth_html, write_growth_page

PLANE = (Range("a", -2.0, 2.0, "m"), Range("b", 0.0, 1.0, "m"))
NAME = "a </script> body"


def run(preset, count=120, passes=4, inputs=PLANE, watch=None):
    rng = np.random.default_rng(0)
    X = np.stack([rng.uniform(r.low, r.high, count) for r in inputs], axis=1)
    Y = np.column_stack([np.exp(-((X[:, 0] - 0.7) ** 2) / 0.1), np.sin(2 * X[:, 0]) * X[:, -1]])
    outputs = [Quantity("p", "J"), Quantity("q", "J")]
    heldout = (X[:30], Y[:30])
    return learn(
        X, Y, inputs, outputs, settings=PRESETS[preset](), passes=passes, heldout=heldout, watch=watch
    )


@pytest.fixture(scope="module")
def pruned():
    """A run of MRAN, which also prunes, and its record."""
    recorder = GrowthRecorder()
    return run("mran", watch=recorder), recorder


@pytest.mark.full
def test_watching_changes_nothing(pruned):
    watched, _ = pruned
    alone = run("mran")
    np.testing.assert_array_equal(watched.state.coefficients, alone.state.coefficients)
    np.testing.assert_array_equal(watched.state.theta, alone.state.theta)


def test_frames_tell_every_unit_that_appears_and_vanishes(pruned):
    learned, recorder = pruned
    history = learned.history
    assert history.pruned.sum() > 0
    assert sum(frame.grew is not None for frame in recorder.frames) == history.grew.sum()
    assert sum(len(frame.vanished) for frame in recorder.frames) == history.pruned.sum()
    np.testing.assert_array_equal(recorder.counts, history.units)
    np.testing.assert_array_equal(recorder.errors, history.heldout)
    for frame in recorder.frames:
        assert frame.units == history.units[frame.observation - 1]
        assert frame.centres.shape == frame.widths.shape == (frame.units, 2)
    # a unit that vanishes was a unit of the frame before, and is none of this one
    for before, frame in zip(recorder.frames[:-1], recorder.frames[1:], strict=True):
        for place in frame.vanished:
            assert frame.observation > before.observation
            near = np.linalg.norm(before.centres - place, axis=1).min() if before.units else np.inf
            assert near < 0.5
    last = recorder.frames[-1]
    assert last.observation == recorder.total == 480


@pytest.mark.full
def test_of_one_input_the_frames_hold_the_networks_answer():
    recorder = GrowthRecorder()
    learned = run("default", inputs=PLANE[:1], watch=recorder)
    frame = recorder.frames[-1]
    np.testing.assert_allclose(
        frame.curve, learned.network.predict(recorder.grid())[:, recorder.drawn], atol=1e-9
    )
    assert not np.allclose(frame.curve, recorder.frames[0].curve)


def test_the_terminal_shows_space_error_and_count(pruned):
    _, recorder = pruned
    lines = growth_lines(recorder, "bowl")
    text = "\n".join(lines)
    assert f"{recorder.counts[-1]} units; " in lines[0]
    assert "observation 480 of 480 (100%)" in text
    assert "a -2 … 2 m →   b 0 … 1 m ↑" in text
    assert {len(line) for line in lines if line.startswith("│")} == {62}
    assert 0 < sum(line.count("●") for line in lines if line.startswith("│")) <= recorder.counts[-1]
    assert growth_lines(GrowthRecorder(inputs=PLANE, samples=(np.empty((0, 2)), np.empty((0, 2)))), "none")


@pytest.fixture(scope="module")
def page(chromium: str, pruned, tmp_path_factory) -> Iterator:
    path = write_growth_page(tmp_path_factory.mktemp("growth") / "growth.html", pruned[1], NAME)
    with sync_playwright() as playwright:
        running = playwright.chromium.launch(executable_path=chromium, args=["--no-sandbox"])
        opened = running.new_page(viewport={"width": 900, "height": 800})
        complaints: list[str] = []
        opened.on("console", lambda message: complaints.append(message.text))
        opened.on("pageerror", lambda error: complaints.append(str(error)))
        opened.goto(path.as_uri())
        yield opened
        assert complaints == []
        running.close()


@pytest.mark.full
def test_the_page_plays_the_frames(page, pruned):
    _, recorder = pruned
    assert page.locator("h1").inner_text() == f"How the network of {NAME} grew"
    frames = page.evaluate("growth.frames")
    assert frames == len(recorder.frames)
    page.evaluate(f"growth.seek({frames - 1})")
    assert f"{recorder.counts[-1]} units" in page.locator("#state").inner_text()
    drawn = "() => { const c = document.getElementById('space'); return c.toDataURL(); }"
    late = page.evaluate(drawn)
    page.evaluate("growth.seek(0)")
    assert page.evaluate(drawn) != late
    page.click("#play")
    page.wait_for_function("document.getElementById('time').value > 3", timeout=20_000)


@pytest.mark.full
def test_the_page_is_one_file(pruned):
    text = growth_html(pruned[1], NAME)
    assert not re.search(r"https?:|src=|@import", text)
    data = re.search(r'<script type="application/json" id="data">(.*?)</script>', text, re.DOTALL)[1]
    assert json.loads(data)["total"] == 480
    with pytest.raises(UsageError, match="no growth"):
        growth_html(GrowthRecorder(), NAME)


@pytest.mark.full
@pytest.mark.parametrize(
    "name", ["<!--<script>", "</script><script>alert(1)</script>", "{{data}}", "&lt;\u2028"]
)
def test_no_name_changes_the_page(pruned, monkeypatch, name):
    """A comment that is opened in a script hides its end, and with it the rest of the page."""
    growth = pruned[1]
    stated = growth.describe() | {"name": name}
    monkeypatch.setattr(growth, "describe", lambda: stated)
    text, plain = growth_html(growth, name), growth_html(growth, "x")
    assert text.count("<script") == plain.count("<script") == text.count("</script")
    assert "<!--" not in text.partition("<body>")[2]
    assert text.count('"frames"') == 1
    data = re.search(r'<script type="application/json" id="data">(.*?)</script>', text, re.DOTALL)[1]
    assert json.loads(data) == json.loads(json.dumps(stated))
