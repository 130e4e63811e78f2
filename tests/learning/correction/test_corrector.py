"""A surrogate corrected by measured forces of specimens that are known."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from correction_made import BOX, DEEPEST, MODULUS, RADIUS, corrector_of, model, scaled, touches

from palpate.errors import UsageError
from palpate.learning.correction import Corrector, Discrepancy, Noise, Phantom, force_error
from palpate.learning.correction.corrected_surrogate import corrected_surrogate, raise_surface
from palpate.learning.correction.prior import specimen_prior
from palpate.learning.correction.touches import Touches
from palpate.surrogates import Surrogate
from palpate.units import bounds

ONLY_FACTOR = Discrepancy(constant=0.5, varying=0.0, offset=0.0)
QUIET = Noise(absolute=0.005, relative=0.0)


def fed(corrector, X, F):
    for x, f in zip(X, F, strict=True):
        corrector.observe(x[:3], f)
    return corrector


def test_rows_are_derivatives_of_the_force_and_the_force_is_the_written_surrogates():
    S = model(extra=[MODULUS])
    prior = specimen_prior(S, Discrepancy())
    X = touches(30, extra=[MODULUS])
    ones = np.zeros((30, 3))
    measured = Touches.of(S, prior, X, ones, ones, Noise(1.0, 0.0))
    rng = np.random.default_rng(2)
    theta = 0.3 * rng.normal(size=prior.root.shape[1] + 1)
    rows = measured.rows(theta)
    direction = rng.normal(size=theta.size)
    h = 1e-6
    difference = (measured.forces(theta + h * direction) - measured.forces(theta - h * direction)) / (2 * h)
    np.testing.assert_allclose(rows @ direction, difference, rtol=1e-6, atol=1e-7 * np.abs(difference).max())

    class At:
        mean, root = theta, np.eye(theta.size)

        @staticmethod
        def spread(index):
            return 1.0

    written = corrected_surrogate(Surrogate(S), S, prior, At, {}).energy
    np.testing.assert_allclose(measured.forces(theta), written.force(X), rtol=1e-9, atol=1e-12)


def test_a_raised_surface_is_nearer_by_its_height_everywhere():
    S, h = model(), 3e-4
    X = touches(50)
    d, g, _ = S.baseline.touched.at(X[:, :3])
    up, h_g, _ = raise_surface(S.baseline.touched, h, RADIUS).at(X[:, :3])
    np.testing.assert_allclose(d - up, h, atol=1e-15)
    np.testing.assert_allclose(g, h_g, atol=1e-12)
    with pytest.raises(UsageError, match="can't be raised"):
        raise_surface(S.baseline.touched, 0.005, RADIUS)


@pytest.mark.full
@pytest.mark.parametrize("factor", [0.5, 1.4, 2.5])
def test_a_constant_factor_is_found_to_within_the_bound_of_the_noise(factor):
    """One unknown: no unbiased estimate of ln m is surer than σ/√Σ‖F‖² (Cramér & Rao)."""
    S, errors = model(certain=True), []
    specimen = scaled(S, factor)
    for seed in range(40):
        rng = np.random.default_rng(seed)
        X = touches(8, seed, shallowest=0.002)
        F = specimen.force(X)
        bound = QUIET.absolute / np.sqrt((F**2).sum())
        corrector = fed(
            corrector_of(S, discrepancy=ONLY_FACTOR, noise=QUIET, gate=50.0),
            X,
            F + QUIET.absolute * rng.standard_normal(F.shape),
        )
        found = corrector.surrogate.energy.network.tail[0, 0] - S.network.tail[0, 0]
        errors.append((0.5 * found - np.log(factor)) / bound)
        expected = 1.0 / np.hypot(1.0 / ONLY_FACTOR.constant, 1.0 / bound)  # prior and data
        deviation = ONLY_FACTOR.constant * corrector.posterior.spread(0)
        assert deviation == pytest.approx(expected, rel=0.05)  # the rows are where θ is, not at the truth
    # a sum of 40 squares of unit normals is within 17 … 74 but for one time in a thousand
    assert 17 < np.sum(np.square(errors)) < 74
    assert np.abs(np.mean(errors)) < 3.3 / np.sqrt(40)


def test_height_and_factor_are_told_apart():
    S = model(certain=True)
    higher = dataclasses.replace(
        scaled(S, 1.3),
        baseline=dataclasses.replace(S.baseline, touched=raise_surface(S.baseline.touched, 3e-4, RADIUS)),
        continuation=dataclasses.replace(S.continuation, deepest=DEEPEST + 3e-4),
    )
    X = touches(60, 3)
    F = higher.force(X) + QUIET.absolute * np.random.default_rng(3).standard_normal((60, 3))
    differs = Discrepancy(constant=0.5, varying=0.0, offset=5e-4)
    corrector = fed(corrector_of(S, discrepancy=differs, noise=QUIET), X, F)
    found = corrector.surrogate.energy
    height, sure = corrector.offset
    assert abs(height - 3e-4) < 4 * sure
    assert sure < 2e-5
    assert force_error(found, X, higher.force(X)).rms < 0.005
    np.testing.assert_allclose(S.depth(X) + height, found.depth(X), atol=1e-12)
    # the learnt factor is taken where it was, also where it is no longer followed
    deep = np.array([[0.0, 0.0, -0.006], [0.03, 0.0, 0.002]])
    ratio = found.energy(deep) / found.baseline.law.energy(found.depth(deep))[0]
    before = S.energy(deep) / S.baseline.law.energy(S.depth(deep))[0]
    log_factor = corrector.posterior.mean[0] * 0.5
    np.testing.assert_allclose(ratio / before, np.exp(log_factor), rtol=1e-9)


@pytest.mark.full
def test_the_order_of_a_record_does_not_matter():
    S = model()
    X = touches(60, 4)
    F = Phantom(S).measured(X, 0.005, np.random.default_rng(4))
    turned = np.random.default_rng(5).permutation(60)
    one, other = (fed(corrector_of(S), X[i], F[i]) for i in (np.arange(60), turned))
    test = touches(40, 6)
    np.testing.assert_allclose(
        one.surrogate.energy.force(test), other.surrogate.energy.force(test), rtol=1e-5, atol=1e-7
    )
    np.testing.assert_allclose(one.posterior.covariance, other.posterior.covariance, atol=1e-5)


@pytest.mark.full
def test_a_specimen_with_a_stiffer_layer_is_followed_and_the_deviation_shrinks_where_it_was_measured():
    S = model()
    specimen, differs = Phantom(S), Discrepancy()
    start = corrector_of(S, discrepancy=differs).surrogate.energy
    left = touches(150, 7)
    left[:, 0] = -np.abs(left[:, 0])
    F = specimen.measured(left, 0.005, np.random.default_rng(7), 0.01)
    found = fed(corrector_of(S, discrepancy=differs), left, F).surrogate.energy
    test = touches(300, 8, shallowest=0.002)
    known, unknown = test[test[:, 0] < -0.002], test[test[:, 0] > 0.012]
    assert force_error(S, known, specimen.force(known)).median > 0.3
    assert force_error(found, known, specimen.force(known)).median < 0.02
    assert (found.deviation(test) < start.deviation(test)).all()
    assert np.median(found.deviation(known)) < 0.1 * np.median(start.deviation(known))
    assert np.median(found.deviation(unknown)) > 3 * np.median(found.deviation(known))


@pytest.mark.full
def test_more_measurements_mean_less_error():
    S = model()
    specimen = Phantom(S)
    test = touches(300, 9, shallowest=0.001)
    X = touches(400, 10)
    F = specimen.measured(X, 0.005, np.random.default_rng(10))
    errors = [force_error(S, test, specimen.force(test)).relative]
    for count in (5, 40, 400):
        found = fed(corrector_of(S), X[:count], F[:count]).surrogate.energy
        errors += [force_error(found, test, specimen.force(test)).relative]
    assert (np.diff(errors) < 0).all()
    assert errors[-1] < 0.05 * errors[0]


def test_a_closed_path_yields_no_work_after_correction():
    S = model()
    X = touches(80, 11)
    found = fed(corrector_of(S), X, Phantom(S).measured(X, 0.005, np.random.default_rng(11))).surrogate.energy
    turn = np.linspace(0.0, 2 * np.pi, 4097)[:-1]
    tilt = np.random.default_rng(12).normal(0.0, 0.3, (2, 3))
    path = np.stack([0.01 * np.cos(turn), 0.012 * np.sin(turn), 0.005 + 0 * turn], axis=1)
    path += 0.004 * (np.cos(turn)[:, None] * tilt[0] + np.sin(2 * turn)[:, None] * tilt[1])
    # the path is periodic and smooth: its trapezium rule converges faster than any power of the step
    frequency = np.fft.fftfreq(turn.size, 1.0 / turn.size)
    velocity = np.fft.ifft(1j * frequency[:, None] * np.fft.fft(path, axis=0), axis=0).real
    power = (found.force(path) * velocity).sum(axis=1)
    assert found.depth(path).min() > 0
    assert abs(power.mean()) < 1e-9 * np.abs(power).mean()


def test_a_corrected_surrogate_is_saved_and_corrected_further(tmp_path):
    S = model()
    specimen = scaled(S, 1.4)
    X = touches(80, 13)
    F = specimen.force(X) + 0.005 * np.random.default_rng(13).standard_normal((80, 3))
    before = fed(corrector_of(S), X[:10], F[:10]).surrogate
    again, once = Surrogate.load(before.save(tmp_path / "once.touch")), before.energy
    np.testing.assert_array_equal(again.energy.force(X), once.force(X))
    np.testing.assert_array_equal(again.energy.deviation(X), once.deviation(X))
    assert once.root.shape[1] <= len(once.root)
    # the same specimen: nothing new is unknown but what the height was known to
    left = again.meta["correction"]["offset_deviation"]
    twice = fed(
        Corrector(again, discrepancy=Discrepancy(0.0, 0.0, 1.0, left)), X[10:], F[10:]
    ).surrogate.energy
    test = touches(100, 14)
    true = specimen.force(test)
    assert force_error(twice, test, true).median < 0.5 * force_error(once, test, true).median


def test_outliers_are_left_out_and_what_teaches_nothing_is_named():
    S = model()
    specimen = scaled(S, 1.2)
    X = touches(60, 15, shallowest=0.002)
    F = specimen.force(X) + 0.005 * np.random.default_rng(15).standard_normal((60, 3))
    spoilt = F.copy()
    spoilt[::10] += [0.0, 3.0, -8.0]
    corrector = fed(corrector_of(S), X, spoilt)
    found = corrector.surrogate.energy
    assert corrector.counts["outlier"] == 6
    assert corrector.counts["learnt"] == 54
    clean = np.arange(60) % 10 > 0
    alone = fed(corrector_of(S), X[clean], F[clean]).surrogate.energy
    apart = np.linalg.norm(found.force(X) - alone.force(X), axis=1) / np.linalg.norm(found.force(X), axis=1)
    assert (apart < 0.3 * found.deviation(X)).all()  # the scatter is judged by all touches
    assert corrector.observe([0, 0, 0.02], [0, 0, 0.001]).verdict == "no contact"
    assert corrector.observe([0, 0, -0.01], [0, 0, 30.0]).verdict == "outside"
    assert corrector.observe([0.03, 0, 0.005], [0, 0, 1.0]).verdict == "outside"
    assert corrector.observe([0, 0, 0.02], [0, 0, 1.0]).verdict == "outlier"
    assert corrector.observe([0, np.nan, 0.0], [0, 0, 1.0]).verdict == "not finite"
    np.testing.assert_array_equal(corrector.surrogate.energy.force(X), found.force(X))


def test_noise_larger_than_said_is_noticed_and_the_deviation_widened():
    S, rng = model(certain=True), np.random.default_rng(22)
    specimen, X = scaled(S, 1.4), touches(300, 22, shallowest=0.002)
    F = specimen.force(X) + 0.02 * rng.standard_normal((300, 3))  # four times as much
    corrector = fed(corrector_of(S, discrepancy=ONLY_FACTOR, noise=QUIET), X, F)
    found = corrector.surrogate.energy
    # 300 sizes of three normals: their median is within a twentieth of 1.538 (four deviations)
    assert corrector.noise_inflation == pytest.approx(4.0, rel=0.1)
    assert corrector.counts["outlier"] == 0
    bound = 0.02 / np.sqrt((F**2).sum())
    assert found.deviation(X)[0] == pytest.approx(bound, rel=0.1)


def test_one_component_alone_teaches_only_of_itself():
    S = model(certain=True)
    X = touches(30, 16)
    F = scaled(S, 1.5).force(X)
    spoilt = F.copy()
    spoilt[:, :2] = 99.0
    corrector = corrector_of(S, discrepancy=ONLY_FACTOR, noise=QUIET)
    for x, f in zip(X, spoilt, strict=True):
        corrector.observe(x, f, along=np.array([0.0, 0.0, 1.0]))
    found = corrector.surrogate.energy.network.tail[0, 0] - S.network.tail[0, 0]
    bound = QUIET.absolute / np.sqrt((F[:, 2] ** 2).sum())
    assert 0.5 * found == pytest.approx(np.log(1.5), abs=4 * bound)


@pytest.mark.full
def test_windows_bound_what_is_kept_and_change_little():
    S = model()
    X = touches(120, 17)
    F = Phantom(S).measured(X, 0.005, np.random.default_rng(17), 0.01)
    whole, parts = fed(corrector_of(S), X, F), fed(corrector_of(S, window=25), X, F)
    assert len(parts._seen) < 25
    assert sum(parts.counts.values()) == 120
    test = touches(200, 18, shallowest=0.002)
    a, b = whole.surrogate.energy, parts.surrogate.energy
    apart = np.linalg.norm(a.force(test) - b.force(test), axis=1) / np.linalg.norm(a.force(test), axis=1)
    assert np.median(apart / a.deviation(test)) < 1.0


@pytest.mark.full
def test_a_memory_follows_a_specimen_that_softens():
    S = model()
    rng = np.random.default_rng(19)
    kept, forgetful = corrector_of(S), corrector_of(S, memory=30.0)
    for i, x in enumerate(touches(400, 19, shallowest=0.003)):
        f = scaled(S, 1.3 if i < 250 else 1.1).force(x[None])[0] + 0.005 * rng.standard_normal(3)
        kept.observe(x, f)
        forgetful.observe(x, f)
    test = touches(100, 20, shallowest=0.003)
    true = scaled(S, 1.1).force(test)
    assert force_error(forgetful.surrogate.energy, test, true).median < 0.02
    assert force_error(kept.surrogate.energy, test, true).median > 0.04
    assert (np.linalg.eigvalsh(forgetful.posterior.covariance) > 0).all()


def test_a_member_of_a_family_needs_its_parameters():
    S = model(extra=[MODULUS])
    with pytest.raises(UsageError, match="0 parameters"):
        corrector_of(S)
    X = touches(30, 21, extra=[MODULUS])
    X[:, 3] = 9e3
    F = scaled(S, 1.3).force(X)
    corrector = fed(corrector_of(S, parameters=[9e3]), X, F)
    assert force_error(corrector.surrogate.energy, X, F).median < 0.01


@pytest.mark.parametrize("wrong", [{"constant": -1.0}, {"length": 0.0}, {"offset": np.nan}])
def test_a_discrepancy_that_is_none_is_refused(wrong):
    with pytest.raises(UsageError):
        Discrepancy(**wrong)


def test_nothing_that_may_change_is_refused():
    with pytest.raises(UsageError, match="nothing to correct"):
        corrector_of(model(certain=True), discrepancy=Discrepancy(0.0, 0.0, 1.0, 0.0))
    with pytest.raises(UsageError):
        Noise(absolute=0.0)
    with pytest.raises(UsageError):
        corrector_of(model(), window=0)
    low, _ = bounds(BOX)
    with pytest.raises(UsageError, match="no measurement"):
        corrector_of(model()).observe(low[:2], [0, 0, 1])
