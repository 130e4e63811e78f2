"""Placements: balance, the proportions that staircases head for, and the information that adaptive placement seeks."""

from __future__ import annotations

import numpy as np
import pytest

from palpate.experiments import Adaptive, Constant, Course, Observer, Psychometric, Staircase
from palpate.experiments.simulation import simulate_people

SIGNED = Psychometric()
LEVELS = np.linspace(-0.6, 0.6, 13)


def placements():
    strengths = np.geomspace(0.02, 0.6, 9)
    return [
        Constant(LEVELS, 52),
        Adaptive(LEVELS, SIGNED),
        Staircase(strengths),
        Staircase(strengths, down=1, step_up=3),
    ]


@pytest.mark.parametrize("placement", placements(), ids=lambda p: type(p).__name__)
def test_each_level_comes_as_often_first_as_second(placement):
    course = Course(placement, SIGNED, 52, catch=4)
    state = simulate_people(course, Observer(), 20, np.random.default_rng(0))
    index, order = np.stack(state.index, axis=1), np.stack(state.order, axis=1)
    for person in range(20):
        for level in range(len(course.levels)):
            assert abs(order[person, index[person] == level].sum()) <= 1
    assert (state.catch.sum(axis=1) == 4).all()
    counted = course.counts(state)
    assert (counted.total.sum(axis=1) == 52).all()  # catch trials are in no fit


@pytest.mark.parametrize("placement", placements(), ids=lambda p: type(p).__name__)
def test_one_person_is_placed_as_among_many(placement):
    """A catch trial of one person moves nobody else, and the answers alone move a person."""
    course = Course(placement, SIGNED, 30, catch=5)
    many = course.begin(3, np.random.default_rng(1))
    answers = np.random.default_rng(2).random((course.total, 3)) < 0.6
    shown = []
    for row in answers:
        stimulus = course.next(many)
        shown.append(stimulus.index.copy())
        course.answer(many, stimulus, row)
    alone = course.begin(3, np.random.default_rng(1))
    for name in ("orders", "signs", "catch", "pending"):
        setattr(alone, name, getattr(alone, name)[1:2])
    alone.placed = {k: v[1:2] for k, v in alone.placed.items()}
    for t, row in enumerate(answers):
        stimulus = course.next(alone)
        assert stimulus.index[0] == shown[t][1]
        course.answer(alone, stimulus, row[1:2])


def test_constant_stimuli_come_equally_often():
    course = Course(Constant(LEVELS, 39), SIGNED, 39)
    state = simulate_people(course, Observer(), 10, np.random.default_rng(3))
    index = np.stack(state.index, axis=1)
    assert all((np.bincount(row, minlength=13) == 3).all() for row in index)


@pytest.mark.parametrize(
    ("down", "up", "target"), [(2, 1, 0.5**0.5), (3, 1, 0.5 ** (1 / 3)), (1, 3, 0.75), (1, 1, 0.5)]
)
def test_a_staircase_heads_for_its_proportion(down, up, target):
    """On a flat function with exactly that proportion correct, it steps up as far as it steps down."""
    placement = Staircase(np.arange(4001.0), down=down, step_up=up)
    assert placement.target == pytest.approx(target)
    rng = np.random.default_rng(4)
    state = placement.start(400, rng)
    state["index"] = np.full(400, 2000)
    trials = 600
    for _ in range(trials):
        correct = rng.random(400) < target
        placement.learn(state, placement.choose(state), correct, correct)
    drift = (state["index"] - 2000).mean() / trials
    assert abs(drift) < 0.02 * up  # steps a trial; a hundredth of proportion more would be as much


def test_adaptive_placement_asks_where_the_answer_tells_most():
    """Of one unknown σ and μ about 0, the obvious and the impossible say nothing; the information is brute force's."""
    placement = Adaptive(LEVELS, SIGNED)
    state = placement.start(1, np.random.default_rng(0))
    for level in np.random.default_rng(5).integers(0, 13, 30):
        placement.learn(state, np.array([level]), np.array([level > 6]), np.array([True]))
    weights = np.exp(state["log"][0] - state["log"][0].max())
    weights /= weights.sum()

    def entropy(w):
        w = w[w > 0]
        return -(w * np.log(w)).sum()

    expected = []
    for p in placement._yes:
        yes, no = weights * p, weights * (1 - p)
        expected.append(yes.sum() * entropy(yes / yes.sum()) + no.sum() * entropy(no / no.sum()))
    best = np.min(expected)
    assert expected[int(placement.choose(state)[0])] == pytest.approx(best, abs=1e-9)


def test_a_person_without_lapses_is_placed_too():
    """Answers that a function without lapses takes for impossible leave a posterior."""
    placement = Adaptive(LEVELS, Psychometric(lapse=0.0))
    state = placement.start(1, np.random.default_rng(0))
    for _ in range(3):
        for level in (0, len(LEVELS) - 1):
            wrong = np.array([level == 0])
            placement.learn(state, np.array([level]), wrong, ~wrong)
    assert np.isfinite(state["log"]).all()
    assert 0 <= placement.choose(state)[0] < len(LEVELS)
