"""A whole record: depths at places, what is printed, what is suspicious."""

from __future__ import annotations

import numpy as np
import pytest
from correction_made import RADIUS, model, scaled, touches

from palpate.dataset.measured import Measurements
from palpate.errors import UsageError
from palpate.learning.correction import Phantom, correct, force_error, probe_positions
from palpate.surrogates import Surrogate


def record(X, F):
    nothing = np.full(len(X), np.nan)
    return Measurements(X, F, np.zeros_like(F), nothing, nothing)


def pressed(place, direction, depths, forces):
    rows = [{"depth": d, "f": f} for d, f in zip(depths, forces, strict=True)]
    return Measurements.of(rows, place=place, direction=direction)


def test_depths_are_counted_from_first_touch_along_the_direction():
    S, tilt = model(), np.array([0.3, 0.0, -1.0])
    found = probe_positions(
        pressed([0.004, -0.002, 0.0], tilt, [0.0, 0.002], [0.0, 1.0]), S.baseline.touched, RADIUS
    )
    unit = tilt / np.linalg.norm(tilt)
    # a sphere that moves along `unit` towards the plane z = 0 touches it when its centre is at z = R
    np.testing.assert_allclose(found.position[0, 2], RADIUS, atol=1e-12)
    np.testing.assert_allclose(found.position[1] - found.position[0], 0.002 * unit, atol=1e-15)
    back = found.position[0] - [0.004, -0.002, 0.0]
    np.testing.assert_allclose(np.cross(back, unit), 0.0, atol=1e-15)
    assert not found.pressed
    assert probe_positions(found, S.baseline.touched, RADIUS) is found
    with pytest.raises(UsageError, match="does not meet"):
        probe_positions(pressed([0.0, 0.0, 0.2], [0, 0, 1], [0.0], [0.0]), S.baseline.touched, RADIUS)


@pytest.mark.full
def test_depths_and_normal_forces_alone_correct_a_surrogate():
    S = model()
    specimen = scaled(S, 1.4)
    depths = np.linspace(0.0005, 0.010, 20)
    position = np.array([0.0, 0.0, RADIUS]) - depths[:, None] * [0, 0, 1]
    forces = specimen.force(position)[:, 2]
    done = correct(Surrogate(S), pressed([0.0, 0.0, 0.0], [0, 0, -1], depths, forces))
    assert done.before.median == pytest.approx(1 - 1 / 1.4, rel=0.01)
    assert done.after.median < 0.01
    np.testing.assert_allclose(done.surrogate.energy.force(position)[:, 2], forces, rtol=0.02, atol=0.005)


@pytest.mark.full
def test_errors_left_out_are_those_of_new_measurements():
    S = model()
    specimen, rng = Phantom(S), np.random.default_rng(1)
    X = touches(150, 1)
    done = correct(Surrogate(S), record(X, specimen.measured(X, 0.005, rng, 0.01)))
    new = touches(400, 2)
    fresh = force_error(done.surrogate.energy, new, specimen.measured(new, 0.005, rng, 0.01))
    assert done.after.median < done.left_out.median < 0.2 * done.before.median
    assert done.left_out.median == pytest.approx(fresh.median, rel=0.35)
    assert "left out" in str(done)
    assert done.as_dict()["counts"]["learnt"] > 140
    assert "no reading was taken in air" in done.warning  # all of these are touches
    assert correct(Surrogate(S), record(X[:5], specimen.force(X[:5]))).left_out is None


@pytest.mark.full
def test_units_that_are_wrong_by_a_thousand_are_suspicious():
    S = model()
    X = touches(30, 3)
    with pytest.raises(UsageError, match="No measurement taught"):
        correct(Surrogate(S), record(1e3 * X, S.force(X)))
    done = correct(Surrogate(S), record(X, 1e3 * S.force(X)))
    # the constant change alone would be ln 1000/0.5 deviations; at most the slow one's share of the variance less
    assert np.log(1e3) / np.hypot(0.5, 0.3) < done.surprise < np.log(1e3) / 0.5
    assert done.ratio == pytest.approx(1e3)
    assert "1e+03 times the model's" in done.warning
    # newtons said to be kilograms or pounds, and forces on the body instead of those on the probe
    for factor, said in [
        (9.80665, "9.8 times the model's"),
        (4.44822, "4.4 times"),
        (-1.0, "Change their sign"),
    ]:
        assert said in correct(Surrogate(S), record(X, factor * S.force(X))).warning
    for factor in (1 / 3, 3.0):
        assert "times the model's" not in correct(Surrogate(S), record(X, factor * S.force(X))).warning
    rng = np.random.default_rng(3)
    X = touches(80, 3)
    slipped = (rng.random((80, 1)) < 0.38) * rng.normal(0.0, 5.0, (80, 3))
    done = correct(Surrogate(S), record(X, S.force(X) + slipped))
    assert "touches are outliers" in done.warning
    done = correct(Surrogate(S), record(X, S.force(X) + 0.2 * rng.standard_normal((80, 3))))
    assert "times as much as the noise" in done.warning


def test_a_record_without_contact_teaches_nothing():
    S = model()
    X = touches(20, 4)
    X[:, 2] = 0.02
    with pytest.raises(UsageError, match="20 no contact"):
        correct(Surrogate(S), record(X, np.zeros((20, 3))))
