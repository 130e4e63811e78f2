"""How far the held node can go: against dense sampling of the loads."""

from __future__ import annotations

import dataclasses

import numpy as np

from models import linear_network, spring_beam
from palpate.runtime.touchable import touchable
from palpate.surrogates import TouchModel
from palpate.units import Quantity, Range


def reached(model: TouchModel) -> np.ndarray:
    """Offsets (S, 3) of the held node over its one load's range."""
    load = model.inputs[0]
    loads = np.linspace(load.low, load.high, 201)[:, None]
    return np.array([model.displacement(p)[model.touch_node] for p in loads])


def test_a_body_that_mirrors_goes_as_far_to_the_other_side(rod: TouchModel):
    low, high = touchable(rod).travel
    ends = reached(rod)
    assert np.allclose(low, ends.min(axis=0), rtol=0, atol=1e-4)  # the network's rest is not quite 0
    assert high[1] == -low[1]
    assert abs(high[0]) < 1e-4


def test_a_body_that_does_not_mirror_stays_on_its_side(rod: TouchModel):
    low, high = touchable(dataclasses.replace(rod, mirrors=False)).travel
    assert low[1] < -0.5
    assert 0.0 <= high[1] < 1e-4


def test_loads_of_both_signs_and_several_loads_add_up():
    beam = spring_beam()
    inputs = [Range("across", -2.0, 5.0, "N"), Range("along", -1.0, 1.0, "N")]
    names = [Quantity(f"u_{c} at node {i}", "m") for i in range(len(beam.rest)) for c in "xy"]
    tail = np.zeros((len(names), 3))  # columns: value at the middle, half the span of each load
    tail[2 * beam.touch_node] = [0.0, 0.0, 0.02]
    tail[2 * beam.touch_node + 1] = [-0.03, -0.07, 0.01]
    networks = dict(beam.networks) | {"field": linear_network(inputs, names, tail)}
    box = touchable(dataclasses.replace(beam, networks=networks, mirrors=False)).travel
    assert np.allclose(box, [[-0.02, -0.11, 0.0], [0.02, 0.05, 0.0]])
