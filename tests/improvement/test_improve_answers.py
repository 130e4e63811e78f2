"""The choice of the next solves of numbers and fields, by its own mathematics and on a closed form."""

from __future__ import annotations

import numpy as np
import pytest

import palpate as pp
from answering import RANGES, answers, plate_mesh
from palpate.dataset import Layout
from palpate.dataset.schema import Field
from palpate.errors import UsageError
from palpate.improvement.answer_choice import choose_answers
from palpate.learning.arrays.input_bends import process_of
from palpate.sweeps import ExternalProblem, Space, random, sobol


def rod_problem(description=None) -> ExternalProblem:
    points, triangles = plate_mesh()
    return ExternalProblem(
        RANGES,
        Layout(np.hstack([points, np.zeros((len(points), 1))]), triangles=triangles),
        (Field("temperature", ("node",), (len(points),), "K"), Field("largest", unit="K")),
        solved,
        description or {"body": {"type": "rod"}},
    )


def solved(x):
    found = answers(x[None])
    return {"temperature": found["temperature"][0], "largest": found["largest"][0]}


def test_chosen_places_leave_less_variance_than_random_ones_and_none_is_beside_a_failed_solve():
    space = Space(RANGES)
    X, places = random(space, 20, 0), sobol(space, 300, 5)
    truth = answers(X)
    parts = [truth["temperature"], truth["largest"][:, None]]
    failed = places[:1]
    chosen = choose_answers(parts, X, RANGES, 5, failed=failed, candidates=places)
    process = process_of(X, parts, RANGES)

    def variance(more):
        after = process.scale(np.vstack([X, failed, more]))
        return np.trace(process.covariance_after(process.scale(places), after))

    rng = np.random.default_rng(1)
    others = [variance(places[rng.choice(len(places), 5, replace=False)]) for _ in range(20)]
    assert variance(chosen) < min(others)
    assert len(np.unique(chosen, axis=0)) == 5
    assert not (chosen[:, None] == failed).all(axis=2).any()


def test_what_is_of_no_interest_is_not_chosen():
    space = Space(RANGES)
    X, places = random(space, 20, 0), sobol(space, 300, 5)
    wanted = space.to_unit(places)[:, 0] > 0.5
    parts = [answers(X)["temperature"]]
    chosen = choose_answers(
        parts, X, RANGES, 4, failed=X[:0], interest=wanted.astype(float), candidates=places
    )
    assert (space.to_unit(chosen)[:, 0] > 0.4).all()


@pytest.mark.full
def test_a_problem_without_touch_is_improved_until_the_error_is_kept(tmp_path):
    steps = list(pp.improve(rod_problem(), unseen=20, until=0.01, workers=1, path=tmp_path / "rod.zarr"))
    assert steps[-1].reached
    assert steps[-1].error <= 0.01
    assert "The error is" in steps[-1].reason
    unseen = random(Space(RANGES), 50, 99)
    surrogate, truth = steps[-1].surrogate, answers(unseen)["temperature"]
    error = abs(surrogate.fields["temperature"].values(unseen)[..., 0] - truth) / np.ptp(truth)
    assert np.quantile(error, 0.95) < 0.02, "places that judged nothing"


def test_a_body_that_acts_otherwise_is_refused():
    acting = {"body": {"type": "rod"}, "interactions": [{"type": "pad"}]}
    with pytest.raises(UsageError, match="under one probe or tool, or for a problem without touch"):
        next(pp.improve(rod_problem(acting), unseen=20))


def test_what_would_not_choose_or_not_end_in_time_is_refused(tmp_path):
    with pytest.raises(UsageError, match="rule 'farthest' is for bodies under a probe"):
        next(pp.improve(rod_problem(), unseen=20, rule="farthest"))
    with pytest.raises(UsageError, match="12 solves can't be chosen one by one"):
        next(pp.improve(rod_problem(), unseen=20, most=12, workers=1))
