"""What lumps add, learnt from presses whose lookups are a formula: a half space that a ball presses."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from palpate.errors import UsageError
from palpate.learning.lumps import LumpPresses, learn_lumps
from palpate.learning.lumps.learn_lumps import _curvature, change_errors
from palpate.surrogates.lumps.lump_contrast import closed_form
from palpate.surrogates.lumps.lump_room import LumpRoom
from palpate.units import Range
from palpate.validation.figures.contrast_error import contrast_error

RADIUS, K = 0.008, 0.14
ROOM = LumpRoom(
    np.array([-0.015, -0.015, -0.025]),
    np.array([0.015, 0.015, -0.010]),
    Range("radius", 0.004, 0.008, "m"),
    Range("ratio", 1.5, 10.0),
)


def _looked_up(X, P, r):
    """ln(D/U) = 3 ln r − 4 ln |p − c| + ½ ln s − 1.5 and ln β, with their slopes by c."""
    offset, s = P - X, RADIUS - X[..., 2]
    squared = (offset**2).sum(axis=-1)
    slopes = 4 * offset / squared[..., None]
    slopes[..., 2] -= 0.5 / s
    softness = np.log(0.3) + 0.1 * np.sin(60 * offset[..., 0])
    bends = np.zeros_like(offset)
    bends[..., 0] = -6 * np.cos(60 * offset[..., 0])
    return 3 * np.log(r) - 2 * np.log(squared) + 0.5 * np.log(s) - 1.5, slopes, softness, bends


def _presses(places: int, lookups: int, seed: int) -> LumpPresses:
    """Presses at places, two depths each: U = 100 s^(5/2)."""
    rng = np.random.default_rng(seed)
    s = rng.uniform(0.001, 0.006, 2 * places)
    X = np.column_stack([np.repeat(rng.uniform(-0.015, 0.015, (places, 2)), 2, axis=0), RADIUS - s])
    U, F = 100 * s**2.5, np.column_stack([0 * s, 0 * s, 250 * s**1.5])
    P = rng.uniform(ROOM.lower, ROOM.upper, (len(X), lookups, 3))
    r = rng.uniform(0.004, 0.008, (len(X), lookups))
    value, slopes, softness, bends = _looked_up(X[:, None] + 0 * P, P, r)
    D = U[:, None] * np.exp(value)
    ratio = np.exp(rng.uniform(0.5, 2.3, len(X)))
    first = (np.exp(value[:, 0]), slopes[:, 0], np.exp(softness[:, 0]), bends[:, 0])
    more, by_place = closed_form(*first, ratio - 1, K)
    return LumpPresses(
        X, U, F, P, r, D, D[..., None] * (slopes - (F / U[:, None])[:, None]), np.exp(softness[:, :6]), ratio,
        U * more, F * more[:, None] - U[:, None] * by_place, ROOM,
    )  # fmt: skip


@pytest.fixture(scope="module")
def learnt():
    return learn_lumps(_presses(14, 40, seed=0), units=160)


def test_the_change_of_force_by_unseen_lumps_is_found(learnt):
    errors = change_errors(learnt, _presses(30, 6, seed=1))
    assert np.median(errors) < 0.03
    assert np.quantile(errors, 0.95) < 0.12


def test_its_own_error_is_about_that_of_unseen_lumps(learnt):
    own = learnt.meta["contrast_error"]
    unseen = np.median(change_errors(learnt, _presses(30, 6, seed=1)))
    assert 0.3 * unseen < own["median"] < 5 * unseen
    assert learnt.meta["presses"] == 28


def test_the_figure_is_of_the_presses_whose_force_a_lump_changes_by_a_hundredth(learnt, monkeypatch):
    presses = _presses(30, 6, seed=1)
    monkeypatch.setattr(LumpPresses, "of", lambda data: presses)
    subject = SimpleNamespace(lumps=learnt, data={"lump_energy": None})
    figure = contrast_error(subject)
    errors = change_errors(learnt, presses.take(presses.contrast_rows))
    assert figure.count == len(errors)
    assert figure.measured() == {"contrast_p95": (pytest.approx(np.quantile(errors, 0.95)), None)}
    monkeypatch.setattr(LumpPresses, "of", lambda data: presses.take(presses.contrast_rows[:7]))
    assert "takes 8 unseen presses" in contrast_error(subject)


def test_the_constant_of_the_closed_form_is_found(learnt):
    assert learnt.curvature == pytest.approx(K, rel=1e-9)


def test_a_change_of_the_wrong_sign_is_no_word_of_the_closed_form():
    presses = _presses(14, 40, seed=0)
    presses.added[3] *= -1e-3  # as of a lump far away, whose change is less than the solves' own error
    assert _curvature(presses) == pytest.approx(K, rel=1e-9)


def test_a_lump_that_met_no_quadrature_point_is_left_out():
    presses = _presses(5, 10, seed=0)
    presses.density[2, 3] = 0.0
    assert np.isfinite(learn_lumps(presses, units=20).density.weights).all()


def test_presses_at_few_places_are_refused():
    with pytest.raises(UsageError, match="4 places or more"):
        learn_lumps(_presses(3, 10, seed=0))
