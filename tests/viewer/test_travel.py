"""How far the held node can go: against dense sampling of the loads."""

from __future__ import annotations

import numpy as np
import pytest
from bodies import one_sided

from models import linear_network, planar_field, spring_beam, spring_energy
from palpate.runtime.touchable import touchable
from palpate.surrogates import Surrogate
from palpate.units import Quantity, Range


def reached(model: Surrogate) -> np.ndarray:
    """Offsets (S, 3) of the held node over its one load's range."""
    field = model.fields["displacement"]
    load = field.inputs[0]
    return field.values(np.linspace(load.low, load.high, 201)[:, None])[:, field.held]


def test_a_body_that_mirrors_goes_as_far_to_the_other_side(rod: Surrogate):
    low, high = touchable(rod).travel
    ends = reached(rod)
    assert np.allclose(low, ends.min(axis=0), rtol=0, atol=1e-4)  # the network's rest is not quite 0
    assert high[1] == -low[1]
    assert abs(high[0]) < 1e-4


def test_a_body_that_does_not_mirror_stays_on_its_side(rod: Surrogate):
    low, high = touchable(one_sided(rod)).travel
    assert low[1] < -0.5
    assert 0.0 <= high[1] < 1e-4


@pytest.mark.full
def test_loads_of_both_signs_and_several_loads_add_up():
    beam = spring_beam()
    inputs = [Range("across", -2.0, 5.0, "N"), Range("along", -1.0, 1.0, "N")]
    points = beam.fields["displacement"].points
    names = [Quantity(f"u_{c} at node {i}", "m") for i in range(len(points)) for c in "xy"]
    tail = np.zeros((len(names), 3))  # columns: value at the middle, half the span of each load
    tail[-2] = [0.0, 0.0, 0.02]
    tail[-1] = [-0.03, -0.07, 0.01]
    field = planar_field("displacement", linear_network(inputs, names, tail), points, touched=np.arange(2))
    hand = [Range("h across", -0.2, 0.2, "m"), Range("h along", -0.2, 0.2, "m")]
    energy = spring_energy(20.0 * np.eye(2), hand, np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0]]))
    box = touchable(Surrogate(energy, {"displacement": field})).travel
    assert np.allclose(box, [[-0.02, -0.11, 0.0], [0.02, 0.05, 0.0]])
