"""Frozen networks: what they were frozen from, and the record of what they learnt from."""

from __future__ import annotations

import numpy as np
import pytest

from laws.beams import INPUT, OUTPUTS, stiffening
from palpate.learning import Learner, freeze, initial, learn, refined_network
from palpate.learning.arrays.array_samples import ArrayProblem
from palpate.learning.stream.output_scaling import OutputScaling
from palpate.network import Network, Scaling
from palpate.rbf.filter.prediction import value
from palpate.rbf.freezing import training_record
from palpate.units import Range


def test_a_frozen_state_says_what_the_state_says_with_modes_or_without():
    X, Y = stiffening(20)
    learnt = learn(X, Y, INPUT, OUTPUTS, passes=1)
    scaled = value(learnt.state, learnt.scaling.scale_inputs(X), learnt.settings)
    plain = freeze(learnt.state, learnt.settings, INPUT, OUTPUTS, learnt.scaling)
    np.testing.assert_allclose(learnt.scaling.scale_outputs(plain.predict(X)), scaled, atol=1e-12)
    V = np.linalg.qr(np.random.default_rng(0).normal(size=(3, 3)))[0]
    turned = OutputScaling(learnt.scaling, V).freeze(learnt.state, learnt.settings, INPUT, OUTPUTS)
    np.testing.assert_allclose(learnt.scaling.scale_outputs(turned.predict(X)), scaled @ V.T, atol=1e-12)


def test_the_hash_is_of_the_numbers_and_the_ranges():
    X, Y = stiffening(10)
    record = training_record(X, Y, INPUT)
    assert record["training"]["samples"] == 10
    assert record == training_record(X.copy(order="F"), Y.copy(order="F"), INPUT)
    nudged = Y.copy()
    nudged[3, 1] = np.nextafter(nudged[3, 1], 2.0)
    others = [(X, nudged, INPUT), (X[::-1], Y, INPUT), (X, Y, (Range("x", 0.0, 5.0, "m"),)), (Y, X, INPUT)]
    hashes = {training_record(*other)["training"]["hash"] for other in others}
    assert len(hashes) == 4
    assert record["training"]["hash"] not in hashes


def test_every_way_to_a_network_leaves_the_record(tmp_path):
    X, Y = stiffening(24)
    record = training_record(X, Y, INPUT)["training"]
    problem = ArrayProblem.of(X, Y, INPUT, OUTPUTS)
    k = problem.basis.shape[0]
    none = (np.zeros((0, 1, 1)), np.zeros((0, 1)), np.zeros((0, k)), np.zeros((2, k)), "gaussian")
    for network in (
        learn(X, Y, INPUT, OUTPUTS, passes=1).network,
        refined_network(X, Y, INPUT, OUTPUTS, units_max=1, starts=1)[0],
        problem.network(*none, heldout=1.0),
    ):
        assert network.meta["training"] == record
        assert Network.load(network.save(tmp_path / "n.palpate")).meta["training"] == record
    learner = Learner(INPUT, OUTPUTS, scaling=Scaling.of(INPUT, Y))
    assert (
        freeze(initial(1, 3, learner.settings), learner.settings, INPUT, OUTPUTS, Scaling.of(INPUT, Y)).units
        == 0
    )
    for x, y in zip(X[:7], Y[:7], strict=True):
        learner.observe(x, y)
    assert learner.network.meta["training"] == {"samples": 7}


def test_too_few_samples_to_judge_are_no_error_that_json_can_not_hold(tmp_path):
    X, Y = stiffening(2)
    network, found, _ = refined_network(X, Y, INPUT, OUTPUTS)
    assert found.loo == np.inf
    assert Network.load(network.save(tmp_path / "n.palpate")).meta["loo"] is None


@pytest.mark.parametrize("bad", [np.zeros(5), np.zeros((5, 2)), np.full((5, 3), np.nan), np.zeros((4, 3))])
def test_what_is_no_output_is_refused(bad):
    from palpate.errors import UsageError

    with pytest.raises(UsageError):
        refined_network(np.zeros((5, 1)), bad, INPUT, OUTPUTS)
