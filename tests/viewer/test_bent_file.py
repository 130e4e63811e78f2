"""A rod that lies elsewhere after a touch, as one HTML file: led along a history, let go, straightened."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from chromium_page import assert_no, drag, number, open_file, settled, vector
from playwright.sync_api import Browser, Page

from bent import CREEPS, REACH, YIELDS, D, body
from palpate.surrogates import Surrogate
from palpate.surrogates.moving_rest import MovingRest
from palpate.viewer.file_page import export_html

pytestmark = pytest.mark.timeout(120)

# forces along a history of [seconds, place], and where the rod then lies after a pause
WALK = """([history, pause]) => {
  const { evaluator } = palpate;
  evaluator.start();
  const forces = history.map(([dt, ...place]) => evaluator.step(place, [], dt).force);
  return { forces, lies: evaluator.release(history.at(-1).slice(1), [], pause).lies };
}"""


@pytest.fixture(scope="module", params=[YIELDS, CREEPS], ids=["yields", "creeps"])
def opened(
    request: pytest.FixtureRequest, browser: Browser, tmp_path_factory
) -> Iterator[tuple[Page, list[str], Surrogate]]:
    """The page of a rod."""
    rod = body(request.param, nodes=21)
    done = export_html(rod, tmp_path_factory.mktemp("bent") / "rod.html")
    assert done.comparison is not None
    assert done.comparison.passed
    assert {"memory", "line", "rest"} <= set(done.comparison.parts)
    page, complaints = open_file(browser, done.file)
    yield page, complaints, rod
    page.context.close()


def followed(rod: Surrogate, history: np.ndarray, pause: float) -> tuple[np.ndarray, np.ndarray]:
    """The forces (N, 3) of palpate along a history of (seconds, place), and where (3,) the rod lies after a pause."""
    elastic, state, forces = rod.energy.evaluator(), rod.memory.start(), []
    moved = MovingRest(elastic, state, D)
    for dt, *place in history:
        elastic(np.array(place), np.zeros(0))
        state.step(np.array(place), elastic.amplitude, elastic.slope, dt)
        forces.append(state.force.copy())
    moved.lies[:] = history[-1, 1:]
    moved.release(pause, np.zeros(0))
    return np.array(forces), moved.lies


def test_a_history_of_the_page_is_that_of_palpate(opened: tuple[Page, list[str], Surrogate]):
    page, complaints, rod = opened
    rng = np.random.default_rng(0)
    for ends in ([REACH, 0.0], [0.5 * REACH, -0.9 * REACH, 0.2 * REACH], [0.05 * REACH]):
        way = np.concatenate([np.linspace(a, b, 20) for a, b in zip([0.0, *ends[:-1]], ends, strict=True)])
        history = np.column_stack([rng.uniform(0.0, 0.05, len(way)), way[:, None] * D])
        got = page.evaluate(WALK, [history.tolist(), 0.3])
        forces, lies = followed(rod, history, 0.3)
        np.testing.assert_allclose(got["forces"], forces, rtol=0, atol=1e-11 * np.abs(forces).max())
        np.testing.assert_allclose(got["lies"], lies, rtol=0, atol=1e-11 * REACH)
    if rod.memory is YIELDS:
        assert abs(lies @ D) < 1e-12, "a small load yields nothing"
    page.evaluate("palpate.rest.straighten()")
    assert_no(complaints)


@pytest.mark.full
@pytest.mark.parametrize("opened", [YIELDS], indirect=True, ids=["yields"])
def test_a_rod_that_is_bent_stays_so_until_it_is_straightened(opened: tuple[Page, list[str], Surrogate]):
    page, complaints, rod = opened
    drag(page, 0, 120, steps=30)
    held = settled(page, "inside")
    assert number(held["text"]["force-norm"]) > 1.0
    deepest = vector(held["data"], "position") @ D
    page.mouse.up()
    free = settled(page, "free")
    assert number(free["text"]["force-norm"]) == 0.0
    lies = np.array(page.evaluate("palpate.rest.place"))
    # sliders feel the way and not the time: all that counts is how far it was pulled
    way = np.linspace(0.0, deepest, 50)[:, None]
    _, wanted = followed(rod, np.column_stack([np.full(50, 0.01), way * D]), 0.1)
    assert 0.2 * deepest < wanted @ D < 0.9 * deepest
    # the held place is read in six decimals
    np.testing.assert_allclose(lies, wanted, rtol=0, atol=1e-6 * REACH)
    # the picture: the node that the hand held, under no load
    node = rod.fields["displacement"].values(np.array([lies @ D, 0.0]))[0, -1]
    np.testing.assert_allclose(vector(free["data"], "contact"), node, rtol=0, atol=1e-6)
    # taken by its tip where that lies now: no force until it moves
    drag(page, 0, 0, steps=1)
    again = settled(page, "inside")
    assert number(again["text"]["force-norm"]) < 0.01
    page.mouse.up()
    settled(page, "free")
    page.get_by_role("button", name="straighten").click()
    straight = settled(page, "free")
    assert np.abs(vector(straight["data"], "contact")).max() == 0.0
    drag(page, 0, 120, steps=30)
    anew = settled(page, "inside")
    assert number(anew["text"]["force-norm"]) == pytest.approx(number(held["text"]["force-norm"]), rel=0.02)
    page.mouse.up()
    assert_no(complaints)


def test_a_rod_that_goes_back_has_nothing_to_straighten(browser: Browser, tmp_path: Path):
    page, complaints = open_file(browser, export_html(straight_rod(), tmp_path / "rod.html").file)
    assert not page.get_by_role("button", name="straighten").is_visible()
    page.context.close()
    assert_no(complaints)


def straight_rod() -> Surrogate:
    """The same rod without a memory."""
    rod = body(nodes=21)
    return Surrogate(rod.energy, rod.fields, None, rod.meta)
