"""`palpate.learn` of datasets that no hand feels, against closed forms: numbers, fields at nodes and cells, curves."""

from __future__ import annotations

import numpy as np
import pytest

import palpate as pp
from answering import answers, rod_solves
from palpate.errors import UsageError


@pytest.fixture(scope="module")
def learnt():
    """A rod's number, field and curve, learnt from 24 solves."""
    return pp.learn(rod_solves(names=("largest", "temperature", "rise")), name="rod")


def test_a_rod_is_learnt_to_a_thousandth_of_its_range(learnt):
    rod, history = learnt
    test = rod_solves(60, seed=1)
    truth = answers(test.X)
    number = rod.predict(test.X)[:, 0]
    assert np.quantile(abs(number - truth["largest"]), 0.95) < 0.01 * np.ptp(truth["largest"])
    for name in ("temperature", "rise"):
        error = abs(rod.fields[name].values(test.X)[..., 0] - truth[name])
        assert np.quantile(error, 0.95) < 0.01 * np.ptp(truth[name])
        assert len(rod.fields[name].modes) == 1, "the closed form is of one shape"
        assert rod.fields[name].meta["truncation_left_out"] < 1e-12 * np.ptp(truth[name]) * 1e3
    assert history.energy is None
    assert "largest: error" in str(history)


def test_it_is_judged_by_unseen_solves(learnt):
    rod, _ = learnt
    judged = pp.validate(rod, rod_solves(60, seed=1))
    assert {one.name for one in judged.answers} == {"largest", "temperature", "rise"}
    assert judged.samples == 56, "the four corners were learnt from"
    assert next(c for c in judged.checks if c.criterion.key == "answer_p95").passed


@pytest.mark.full
def test_cells_and_vectors_are_learnt_too():
    data = rod_solves(names=("flux", "in_cells"))
    rod, _ = pp.learn(data, name="rod")
    truth = answers(data.X)
    for name in ("flux", "in_cells"):
        values = rod.fields[name].values(data.X)
        wanted = truth[name] if truth[name].ndim == 3 else truth[name][..., None]
        assert abs(values - wanted).max() < 0.01 * np.ptp(wanted)
    assert rod.fields["in_cells"].places.kind == "cells"
    assert rod.fields["flux"].components == ("1", "2")


def test_what_can_not_be_told_apart_is_refused_by_name():
    data = rod_solves(names=("largest",))
    fixed = data.data.copy(deep=True)
    fixed["inputs"][:, 1] = 20.0
    with pytest.raises(UsageError, match="'conductivity' never varies"):
        pp.learn(pp.Dataset(fixed))
    alike = data.data.copy(deep=True)
    alike["inputs"][:, 1] = 1e-4 * alike["inputs"][:, 0]
    with pytest.raises(UsageError, match="'heat' and 'conductivity' always vary together"):
        pp.learn(pp.Dataset(alike))
    with pytest.raises(UsageError, match="'units_max' is of bodies that a hand feels"):
        pp.learn(data, units_max=3)
