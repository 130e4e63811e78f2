"""The contact law of two jaws: learning sees its derivatives, and the effort is one of the learnt energy."""

from __future__ import annotations

import json

import numpy as np
import pytest
from touch_made import slab, touch_energy

from palpate.errors import UsageError
from palpate.surrogates import ContactLaw, Continuation
from palpate.surrogates.baselines import PinchBaseline
from palpate.surrogates.grip_effort import efforts
from palpate.tools import Capsule, Gripper
from palpate.units import Range


def test_learning_sees_the_derivatives_by_centre_and_opening():
    """ln U₀ by central differences, where both jaws touch and where one does."""
    gripper = Gripper(Capsule(0.005, 0.016))
    baseline = PinchBaseline(ContactLaw("series", 1e-3), slab(), 0.005, tool=json.dumps(gripper.describe()))
    inputs = tuple(Range(name, -1.0, 1.0, "m") for name in "abcd")
    rng = np.random.default_rng(0)
    X = rng.uniform([-0.003, -0.01, -0.01, 0.014], [0.003, 0.01, 0.01, 0.018], (30, 4))
    X = X[baseline.coordinate(X) > 2e-4]
    depths = np.array([s for s, _, _ in baseline.jaw_depths(X)])
    assert (depths.min(axis=0) > 0).any()
    assert (depths.min(axis=0) < 0).any()
    value, slope, bend = baseline.logarithm(X, inputs)
    for i, way in enumerate(1e-7 * np.eye(4)):
        ends = [baseline.logarithm(X + sign * way, inputs) for sign in (1, -1)]
        np.testing.assert_allclose(
            slope[:, i], (ends[0][0] - ends[1][0]) / 2e-7, atol=1e-5 * np.abs(slope).max()
        )
        curved = (ends[0][1] - ends[1][1]) / 2e-7
        np.testing.assert_allclose(bend[:, i], curved, atol=1e-4 * np.abs(bend).max())
    assert np.isfinite(value).all()


def test_the_work_of_the_effort_is_the_change_of_the_energy():
    """From a clear opening to a narrow one, by Gauss's rule from first touch on; clear of the body it is zero."""
    gripper = Gripper(Capsule(0.005, 0.016))
    box = [Range(f"grip_{axis}", -0.003, 0.003, "m") for axis in "xyz"]
    opening = Range("grip_opening", 0.014, 0.022, "m")
    energy = touch_energy(
        box=box,
        extra=(opening,),
        baseline=PinchBaseline(
            ContactLaw("series", 1e-3), slab(), 0.005, tool=json.dumps(gripper.describe())
        ),
        continuation=Continuation.of([*box, opening], deepest=0.006),
    )
    nodes, weights = np.polynomial.legendre.leggauss(40)
    ends = np.array([0.0145, 0.0198])  # m: both jaws touch the slab of 20 mm between them
    w = ends.mean() + nodes * np.diff(ends) / 2
    X = np.column_stack([np.zeros((40, 3)), w])
    work = float(weights @ efforts(energy, X) * np.diff(ends)[0] / 2)
    low, high = energy.energy(np.column_stack([np.zeros((2, 3)), ends]))
    assert work == pytest.approx(low - high, rel=1e-6)
    clear = efforts(energy, np.array([[0.0, 0.0, 0.0, 0.0205]]))
    assert not clear.any()
    assert not np.signbit(clear).any()
    with pytest.raises(UsageError, match="no effort of jaws"):
        efforts(touch_energy(), np.zeros((1, 3)))
