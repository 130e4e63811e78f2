"""The contact law of two jaws: learning sees its derivatives, and the effort is one of the learnt energy."""

from __future__ import annotations

import json

import numpy as np
from touch_made import slab

from palpate.surrogates import ContactLaw
from palpate.surrogates.baselines import PinchBaseline
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
