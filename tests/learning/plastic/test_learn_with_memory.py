"""Learning held bodies from histories made by known elements, and dents from known tables."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from palpate.dataset import Dataset, Layout, LoadHistory, histories_of
from palpate.dataset.histories import history_dataset
from palpate.errors import UsageError
from palpate.learning.learn_dataset import learn
from palpate.learning.plastic import Press, learn_indentation
from palpate.learning.plastic.learn_with_memory import HIGHEST, LIMITS, LOWEST, PER_DECADE
from palpate.surrogates.memories import Indentation, IwanElements
from palpate.sweeps.drives import random_times, random_turns
from palpate.units import Range
from remembering import press

YIELDS = IwanElements.sliders(
    np.array([15.0, 60.0, 40.0]) / 115.0,
    np.array([math.inf, 0.083, 0.21]) * math.sqrt(115.0),
    np.array([0.0, 0.1, 0.0]),
)
CREEPS = IwanElements.dashpots(np.array([60.0, 25.0, 20.0]) / 105.0, np.array([math.inf, 0.1, 2.0]))
K = {id(YIELDS): 115.0, id(CREEPS): 105.0}  # N/m, of the body at rest


def amplitude(w: np.ndarray, K: float) -> tuple[np.ndarray, np.ndarray]:
    """q = √K w exp(w²/4), √J, and its slope."""
    return math.sqrt(K) * w * np.exp(w * w / 4), math.sqrt(K) * (1 + w * w / 2) * np.exp(w * w / 4)


def path(
    elements: IwanElements, w: np.ndarray, times: np.ndarray | None = None, stiffness: float | None = None
) -> LoadHistory:
    q, slope = amplitude(w, K[id(elements)] if stiffness is None else stiffness)
    force = slope * (elements.elongations(q, times) @ elements.stiffness)
    shape = np.zeros((len(w), 2, 2))
    shape[:, 1, 1] = -w
    nothing = np.zeros(len(w))
    clock = np.arange(1.0, 1.0 + len(w)) if times is None else times
    return LoadHistory(clock, w, force, q * q / 2, nothing, shape)


def paths(*several: LoadHistory, same: LoadHistory | None = None) -> Dataset:
    layout = Layout(np.array([[0.0, 0], [1.0, 0]]), np.array([False, True]), [1], [[0.0, -1.0]])
    origin = {"problem": {"body": {"type": "Cantilever"}}}
    return history_dataset(several, Range("P", -60.0, 60.0, "N"), layout, origin, elastic=same)


def elastic(elements: IwanElements) -> LoadHistory:
    """The same body without its memory."""
    spring = IwanElements.sliders(np.ones(1), np.array([math.inf]), np.zeros(1))
    return path(spring, np.linspace(0.02, 0.55, 30), stiffness=K[id(elements)])


@pytest.mark.full
def test_sliders_are_found_to_the_grid_and_answer_unseen_histories() -> None:
    rng = np.random.default_rng(4)

    def walk(outward: float) -> LoadHistory:
        return path(YIELDS, random_turns(rng, -0.5, 0.5, turns=6, step=0.02, outward=outward))

    body, history = learn(paths(walk(3.0), walk(3.0), walk(3.0), same=elastic(YIELDS)))
    # a limit between two of the grid is at most half their distance from one of them
    half = 0.5 * ((HIGHEST / LOWEST) ** (1 / (LIMITS - 1)) - 1)
    slope = amplitude(np.array([0.5]), 115.0)[1][0]
    worst = half * float(np.sum(YIELDS.stiffness[1:] * YIELDS.limit[1:]) * slope)
    for unseen in (walk(0.0), walk(0.0)):
        led = body.follow(unseen.place[:, None])
        assert np.abs(led.force[:, 1] - unseen.force).max() < worst
        assert led.stored.min() >= 0
        assert (np.diff(led.lost) >= 0).all()
    assert body.memory.total == pytest.approx(1.0, rel=0.01)
    assert history.memory.elastic_error < 1e-3
    assert "elements" in str(history)


@pytest.mark.full
def test_dashpots_are_found_to_the_grid() -> None:
    rng = np.random.default_rng(6)

    def drive() -> LoadHistory:
        times, w = random_times(rng, -0.5, 0.5, span=8.0, step=0.04)
        return path(CREEPS, w, times)

    body, _ = learn(paths(drive(), drive(), same=elastic(CREEPS)), relaxes=True)
    unseen = drive()
    force = body.follow(unseen.place[:, None], unseen.times).force[:, 1]
    # two exponentials of the grid stand for one between them: to the square of half their distance
    half = 0.5 * math.log(10) / PER_DECADE
    assert np.abs(force - unseen.force).max() < half**2 * np.abs(unseen.force).max()
    relaxed = body.memory.stiffness[np.isinf(body.memory.time)].sum() / body.memory.total
    assert relaxed == pytest.approx(60 / 105, abs=0.02)


def test_histories_come_back_from_their_file(tmp_path: Path) -> None:
    some = paths(path(YIELDS, np.array([0.1, 0.3])), path(YIELDS, np.array([0.2, -0.1, 0.0])))
    found = Dataset.open(some.save(tmp_path / "some.zarr"))
    assert found.hash == some.hash
    assert found.size_in_words == "2 histories with 5 samples"
    for one, other in zip(histories_of(some), histories_of(found), strict=True):
        np.testing.assert_array_equal(one.force, other.force)
        np.testing.assert_array_equal(one.displacement, other.displacement)


def test_histories_that_fit_nothing_are_refused() -> None:
    good = path(YIELDS, np.array([0.1, 0.3]))
    with pytest.raises(UsageError, match="no history"):
        LoadHistory(good.times[::-1], good.place, good.force, good.stored, good.lost, good.displacement)
    with pytest.raises(UsageError, match="elastic body was led"):
        learn(paths(path(YIELDS, np.array([0.1, 0.9])), same=elastic(YIELDS)))
    with pytest.raises(UsageError, match="too few"):
        learn(paths(same=elastic(YIELDS)))


def test_the_tables_of_a_dent_come_back() -> None:
    """Knots where the search has its own: what it finds must be what made the presses."""
    reach = np.array([0.5, 1.0, 1.5]) * 2
    made = Indentation.single(np.array([0.0, 0.4, 1.1]), reach, np.array([1.0, 1.1, 1.05]))
    s = np.concatenate([np.linspace(0.1, 1.8, 30), np.linspace(1.8, 0.5, 20), np.linspace(0.5, 2.4, 30)])
    s = np.append(s, np.linspace(2.4, 0.5, 20)) * (3.0**0.8 / 2.4)  # q = s^(5/4), to 3
    energy, slope = 0.5 * s**2.5, np.zeros((len(s), 3))
    slope[:, 2] = -1.25 * s**1.5
    memory, force = made.start(), np.zeros((len(s), 3))
    for i in range(len(s)):
        press(memory, np.array([0.0, 0.0, -s[i]]), float(energy[i]), slope[i])
        force[i] = memory.force
    found, error = learn_indentation([Press(energy, slope, force)], knots=2)
    assert error < 1e-6
    np.testing.assert_allclose(found.reach, made.reach, rtol=1e-4)
    np.testing.assert_allclose(found.residual, made.residual, atol=1e-4)
    np.testing.assert_allclose(found.stiffening, made.stiffening, rtol=1e-3)


def test_a_split_keeps_histories_whole_and_the_elastic_one_to_learn_from() -> None:
    rng = np.random.default_rng(4)
    several = [path(YIELDS, random_turns(rng, -0.5, 0.5, step=0.02, outward=3.0)) for _ in range(4)]
    train, test = paths(*several, same=elastic(YIELDS)).split(test=0.25, seed=1)
    numbers = set(np.unique(train["history"])), set(np.unique(test["history"]))
    assert numbers[0] | numbers[1] == {-1, 0, 1, 2, 3}
    assert numbers[0] & numbers[1] == set()
    assert -1 in numbers[0]
    assert len(numbers[1]) == 1
