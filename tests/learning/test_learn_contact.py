"""The energy of a pressed body from solves of one whose energy is known."""

from __future__ import annotations

import numpy as np
import pytest

from palpate.errors import UsageError
from palpate.learning.energy import learn_energy
from palpate.learning.energy.energy_images import images_of
from palpate.learning.energy.energy_problem import EnergyProblem
from palpate.learning.energy.energy_samples import EnergySamples
from palpate.learning.energy.energy_search import best_mean, score
from palpate.learning.energy.trust import trust_of
from palpate.learning.search import Candidate, Search
from palpate.learning.starts import random_units
from palpate.rbf.refinement.rows import Rows
from palpate.rbf.regressors import pairs
from palpate.surrogates import ContactBaseline, ContactLaw, Solves, TouchedSurface
from palpate.units import Range

SIDE, RADIUS, LAW = 0.04, 0.01, ContactLaw("series", 1e-3)
INPUTS = (Range("x", 0.0, SIDE, "m"), Range("y", 0.0, SIDE, "m"), Range("z", 0.004, 0.010, "m"))
MIDDLE = np.array([SIDE / 2, SIDE / 2, 0.0])
STEP = 1e-30
SQUARE = [
    np.diag([a, b, 1.0]) @ turn
    for a in (1, -1)
    for b in (1, -1)
    for turn in (np.eye(3), np.eye(3)[[1, 0, 2]])
]


@pytest.fixture(scope="module")
def surface():
    """A plane that goes on well beyond where it is touched."""
    points = SIDE * np.array([[-1, -1, 0], [2, -1, 0], [2, 2, 0], [-1, 2, 0]], float)
    return TouchedSurface.of(points, np.array([[0, 1, 2], [0, 2, 3]]), radius=RADIUS)


def contact(surface, *, resolved=0.0, radius=RADIUS, **more):
    return ContactBaseline(LAW, surface, radius, resolved=resolved, **more)


def solves(X, U, F, K, *, inputs=INPUTS, **more):
    return Solves(X, U, F, K, tuple(inputs), **{k: np.array(v, float) for k, v in more.items()})


def factor(c):
    """ℓ, symmetric as a square is, softer towards the edges and stiffer with depth; for complex c too."""
    x, y, z = ((c - MIDDLE) / (SIDE / 2)).T
    return 9.0 - 0.3 * (x**2 + y**2) - 0.2 * x**2 * y**2 - 0.5 * z + 0.1 * z * (x**2 + y**2)


def energy(c):
    s = RADIUS - c[:, 2]
    return s**3 / np.sqrt(1 + s / LAW.length) * np.exp(factor(c))


def touches(count, seed=0):
    """Positions over the face, their energies, forces by complex step, stiffnesses by its central difference."""
    rng = np.random.default_rng(seed)
    X = np.array([0.0, 0.0, 0.004]) + rng.random((count, 3)) * [SIDE, SIDE, 0.0055]

    def force(c):
        return np.stack([-energy(c + 1j * STEP * e).imag / STEP for e in np.eye(3)], axis=1)

    h = 1e-7
    K = np.stack([(force(X + h * e) - force(X - h * e)) / (2 * h) for e in np.eye(3)], axis=2)
    return X, energy(X), force(X), K


def test_values_slopes_and_curvatures_are_those_of_the_factor(surface):
    X, U, F, K = touches(20)
    samples = EnergySamples.of(solves(X, U, F, K), contact(surface))
    value, slopes, curvatures = samples.targets(contact(surface))
    half = np.array([SIDE / 2, SIDE / 2, 0.003])
    np.testing.assert_allclose(value[:, 0], factor(X), atol=1e-9)
    i, j = pairs(3)
    h = 1e-6
    for a in range(3):
        e = np.eye(3)[a]
        by_step = factor(X + 1j * STEP * e).imag / STEP * half[a]
        np.testing.assert_allclose(slopes[:, 0, a], by_step, atol=1e-7)
        for b in range(a, 3):
            up, down = (factor(X + d * np.eye(3)[b] + 1j * STEP * e).imag / STEP for d in (h, -h))
            at = int(np.flatnonzero((i == a) & (j == b))[0])
            np.testing.assert_allclose(
                curvatures[:, 0, at], (up - down) / (2 * h) * half[a] * half[b], atol=2e-3
            )


def test_natural_weights_make_errors_relative(surface):
    """An error of ℓ's slope times U over ‖F‖ is the force's; of its curvature, U over ‖K‖ the stiffness's."""
    X, U, F, K = touches(10)
    samples = EnergySamples.of(solves(X, U, F, K), contact(surface))
    rows = samples.rows(contact(surface), curvature_share=1.0)
    half = np.array([SIDE / 2, SIDE / 2, 0.003])
    np.testing.assert_allclose(
        np.sqrt(rows["slope_weight"]) * half, (U / np.linalg.norm(F, axis=1))[:, None] * np.ones(3), rtol=1e-9
    )
    i, j = pairs(3)
    scale = np.sqrt(rows["curvature_weight"]) * half[i] * half[j]
    np.testing.assert_allclose(scale, (U / np.linalg.norm(K, axis=(1, 2)))[:, None] * np.ones(6), rtol=1e-7)


def test_unknown_stiffnesses_and_solves_without_contact_leave_no_rows(surface):
    X, U, F, K = touches(10)
    K[3] = np.nan
    X[5, 2], U[5], F[5] = 0.0101, 0.0, 0.0
    samples = EnergySamples.of(solves(X, U, F, K), contact(surface))
    problem = EnergyProblem(samples.scaled, samples.rows(contact(surface)), None)
    known = dict(problem.rows)
    rows = Rows.of(problem.regressors("rotated", "gaussian"), problem.X, known.pop("Y"), **known)
    assert len(samples) == 9
    assert len(rows.targets) == 9 * 4 + 8 * 6


@pytest.mark.full
def test_the_leave_one_solve_out_error_is_that_of_fits_without_each_solve(surface):
    X, U, F, K = touches(8)
    samples = EnergySamples.of(solves(X, U, F, K), contact(surface))
    problem = EnergyProblem(
        samples.scaled,
        samples.rows(contact(surface, resolved=1e-3)),
        images_of(solves(X, U, F, K, symmetry=SQUARE, about=MIDDLE), contact(surface)),
    )
    of = problem.regressors("rotated", "gaussian")
    none = np.zeros((0, of.form.size))
    found = problem.missed(problem.refined(none, of, iterations=0, seconds=1.0)).mean
    known = dict(problem.rows)
    rows = Rows.of(of, problem.X, known.pop("Y"), **known)
    A, b, total = rows.matrix(none), rows.targets, 0.0
    for i in range(8):
        out = rows.samples == i
        C = np.linalg.lstsq(A[~out], b[~out], rcond=None)[0]
        total += rows.scale[i] * np.linalg.norm(b[out] - A[out] @ C)
    assert found == pytest.approx(total / rows.total, rel=1e-6)


@pytest.mark.full
def test_the_posterior_covers_nine_tenths_of_what_is_missed_when_left_out(surface):
    """With covariances of fits without each fold, and the share that so few solves ask for (Vovk et al. 2005)."""
    X, U, F, K = touches(24)
    samples = EnergySamples.of(solves(X, U, F, K), contact(surface))
    problem = EnergyProblem(samples.scaled, samples.rows(contact(surface, resolved=1e-3)), None)
    of = problem.regressors("rotated", "gaussian")
    theta = np.array([of.form.unit(samples.scaled[i], 0.8) for i in range(3)])
    tried = problem.evaluate(Candidate(of, theta, "test"), 2)
    network = tried.network
    found = best_mean(problem, [score(problem, tried)], 1)
    trust, left = trust_of(found, samples), found.left_out
    rows, A = left.rows, left.rows.matrix(network.theta)
    penalty = np.diag(np.r_[np.zeros(of.tail_size), np.full(3, problem.ridge * rows.total)])
    fold, missed = left.together[rows.samples], left.errors @ rows.modes
    by_force, half = np.linalg.norm(F, axis=1), np.array([SIDE / 2, SIDE / 2, 0.003])
    scale = trust.root @ trust.root.T @ (A.T @ A + penalty)  # the variance, times the identity
    np.testing.assert_allclose(scale, scale[0, 0] * np.eye(len(scale)), rtol=1e-5, atol=1e-5 * scale[0, 0])
    held = 0
    for i in range(24):
        M = np.linalg.inv(A[fold != left.together[i]].T @ A[fold != left.together[i]] + penalty)
        at = np.r_[i, 24 + 3 * i + np.arange(3)]
        to_l = 1.0 / np.r_[rows.scale[i], rows.slope_scale[i]]  # unweighted, by scaled inputs
        errors, spread = missed[at, 0] * to_l, A[at] * to_l[:, None]
        to_force = np.column_stack([F[i], np.diag(-U[i] / half)]) / by_force[i]  # δF = F δℓ − U ∇δℓ
        error = np.linalg.norm(to_force @ errors)
        size = np.sqrt(scale[0, 0] * np.trace(to_force @ spread @ M @ spread.T @ to_force.T))
        assert trust.errors[i] == pytest.approx(error, rel=1e-6)
        held += error <= 1.645 * size * (1 + 1e-9)
    assert held == np.ceil(0.9 * 25 / 24 * 23)  # the quantile lies between this one and the next


@pytest.mark.full
def test_no_unit_is_narrower_than_what_a_probe_can_feel(surface):
    X, U, F, K = touches(12)
    samples = EnergySamples.of(solves(X, U, F, K), contact(surface))
    half = np.array([SIDE / 2, SIDE / 2, 0.003])
    finest = contact(surface).finest(INPUTS) / half
    np.testing.assert_allclose(finest * half, RADIUS / 40)
    problem = EnergyProblem(
        samples.scaled, samples.rows(contact(surface, resolved=1e-3)), None, finest=finest
    )
    of = problem.regressors("rotated", "inverse-multiquadric")
    # a Gaussian exp(−|Aξ|²) of width w falls over w: too sharp in one direction, or of less than R/5 in all
    ways = np.array([[40, 40, 1.02], [40, 40, 0.98], [8.2, 8.2, 8.2], [7.8, 7.8, 7.8]]) * finest
    theta = of.form.of(samples.scaled[[3, 3, 3, 3]], ways)
    start = problem.refined(theta, of, iterations=0, seconds=1.0)
    assert problem.narrow_units(start).tolist() == [False, True, False, True]
    # a ridge of a millimetre has no end along it
    ridge = problem.regressors("rank-1", "inverse-multiquadric")
    across = np.array([[0.0, 0.0, 1 / (w * finest[2])] for w in (4.0, 0.9)])
    of_rank_1 = np.column_stack([across, across @ samples.scaled[3]])
    start = problem.refined(of_rank_1, ridge, iterations=0, seconds=1.0)
    assert problem.narrow_units(start).tolist() == [False, True]
    rng, search = np.random.default_rng(0), Search(problem)
    starts = [np.vstack([theta, random_units(of.form, problem.X, 3, rng)]) for _ in range(4)]
    search.try_all([Candidate(of, start, "test") for start in starts], 150)
    assert len(search.tried) == 4
    for one in search.tried:
        factors = of.form.factors(one.network.theta)[0]
        sharpness = np.linalg.svd(factors * finest)[1]
        assert sharpness[:, 0].max() <= 1.0
        assert sharpness[:, -1].max() <= 1 / 8


@pytest.fixture(scope="module")
def learnt(surface):
    return learn_energy(
        solves(*touches(14), symmetry=SQUARE, about=MIDDLE),
        contact(surface, resolved=None),
        choose=False,
        units_max=32,
        target=0.0,
        effort=0.25,
        form="rotated",
        radial="inverse-multiquadric",
    )


@pytest.mark.full
def test_a_smooth_body_is_learnt_from_a_few_solves(learnt):
    X, U, F, K = touches(200, seed=1)
    s = learnt[0]
    size = np.linalg.norm(F, axis=1)
    assert np.quantile(np.linalg.norm(s.force(X) - F, axis=1) / size, 0.95) < 0.01
    assert np.quantile(np.abs(s.energy(X) / U - 1), 0.95) < 0.01
    # a stiffness is twice differentiated: its error is that of the force over a unit's width
    bend = np.linalg.norm(s.stiffness(X) - K, axis=(1, 2)) / np.linalg.norm(K, axis=(1, 2))
    assert np.quantile(bend, 0.95) < 0.04


@pytest.mark.full
def test_what_is_learnt_has_the_symmetry_exactly(learnt):
    X = touches(20, seed=2)[0]
    s = learnt[0]
    for M in SQUARE:
        image = (X - MIDDLE) @ M.T + MIDDLE
        np.testing.assert_allclose(s.energy(image), s.energy(X), rtol=1e-10)
        np.testing.assert_allclose(s.force(image), s.force(X) @ M.T, rtol=1e-8, atol=1e-10)
        np.testing.assert_allclose(s.deviation(image), s.deviation(X), rtol=1e-6)


def test_the_record_tells_what_was_tried(learnt):
    _, history = learnt
    assert {t.start for t in history.trials} >= {"kind", "random"}
    assert history.loo <= min(t.error for t in history.trials)
    assert history.meta["solves"] == 14
    assert history.meta["samples"] == 8 * 14


@pytest.mark.parametrize("deepest", [None, 0.004, 0.006, 0.012])
def test_deeper_than_the_solves_is_not_trained_though_in_the_ranges(surface, deepest):
    """On a curved body the ranges hold depths that nobody solved; here they simply go on."""
    X, U, F, K = touches(40, seed=3)
    inputs = (*INPUTS[:2], Range("z", -0.002, 0.010, "m"))
    known = {"choose": False, "units_max": 0, "effort": 0.1, "deepest": deepest}
    s = learn_energy(solves(X, U, F, K, inputs=inputs), contact(surface, resolved=None), **known)[0]
    own = RADIUS - X[:, 2].min()
    assert 0.0054 < own < 0.006
    ends = {None: np.inf, 0.006: 0.006}.get(deepest, own)  # the others were not reached, or gone beyond
    assert s.continuation.deepest == pytest.approx(ends, rel=1e-9)
    deeper = X[np.argmin(X[:, 2])] - [0.0, 0.0, 0.0006]
    assert s.inside(deeper[None])[0] == (deepest is None)


def test_what_makes_no_sense_is_refused(surface):
    X, U, F, K = touches(6)
    baseline = contact(surface)
    with pytest.raises(UsageError, match="no isometry"):
        learn_energy(solves(X, U, F, K, symmetry=[np.eye(3), 2 * np.eye(3)]), baseline)
    with pytest.raises(UsageError, match="not a symmetry"):
        learn_energy(solves(X, U, F, K, symmetry=SQUARE[:3], about=MIDDLE), baseline)
    with pytest.raises(UsageError, match="has contact"):
        learn_energy(solves(X + np.array([0, 0, 0.02]), 0 * U, F, K), baseline)
    with pytest.raises(UsageError, match="stored no energy"):
        learn_energy(solves(X, np.where(np.arange(6) == 2, 0.0, U), F, K), baseline)
    with pytest.raises(UsageError, match="option seconds"):
        learn_energy(solves(X, U, F, K), baseline, seconds=0.0)
    with pytest.raises(UsageError, match="option networks"):
        learn_energy(solves(X, U, F, K), baseline, networks=0)


def test_a_press_that_ends_before_an_elements_flat_face_is_one_without_contact(surface):
    """Elements h leave gaps of up to h²/8R, a quarter of `resolved`; deeper, a press without energy is a mistake."""
    X, U, F, K = touches(6)
    baseline = ContactBaseline(LAW, surface, RADIUS, resolved=1.6e-3)
    for s, is_gap in ((3.5e-4, True), (4.5e-4, False)):
        X[2, 2], U[2] = RADIUS - s, 0.0
        if is_gap:
            assert list(EnergySamples.of(solves(X, U, F, K), baseline).numbers) == [0, 1, 3, 4, 5]
        else:
            with pytest.raises(UsageError, match="stored no energy"):
                EnergySamples.of(solves(X, U, F, K), baseline)


MODULUS = Range("E", 5e3, 20e3, "Pa")


def family(count, seed):
    """Touches of bodies whose energy goes with E^0.8, softer ones more so at depth; −∂U by all four inputs."""
    X, U, F, _ = touches(count, seed)
    E = np.random.default_rng(seed + 100).uniform(5e3, 20e3, count)
    z = (X[:, 2] - MIDDLE[2]) / (SIDE / 2)
    power = 0.8 + 0.1 * z
    times = (E / 1e4) ** power
    # ∂ times/∂z, and by E
    F = F * times[:, None] - np.outer(U * times * np.log(E / 1e4) * 0.1 / (SIDE / 2), [0, 0, 1])
    return np.c_[X, E], U * times, np.c_[F, -U * times * power / E]


def test_what_is_known_of_a_property_is_a_slope_of_the_factor(surface):
    X, U, response = family(12, 3)
    response[5, 3] = np.nan
    inputs = (*INPUTS, MODULUS)
    samples = EnergySamples.of(solves(X, U, response, None, inputs=inputs), contact(surface))
    rows = samples.rows(contact(surface))
    z = (X[:, 2] - MIDDLE[2]) / (SIDE / 2)
    by_scaled = (0.8 + 0.1 * z) / X[:, 3] * 7.5e3
    known = np.arange(12) != 5
    np.testing.assert_allclose(rows["slopes"][known, 0, 3], by_scaled[known], rtol=1e-9)
    np.testing.assert_array_equal(rows["slope_weight"][:, 3] > 0, known)
    problem = EnergyProblem(samples.scaled, rows, None)
    arrays = dict(rows)
    all_rows = Rows.of(problem.regressors("rotated", "gaussian"), problem.X, arrays.pop("Y"), **arrays)
    assert len(all_rows.targets) == 12 * 4 + 11


def sized(count, seed):
    """Touches by spheres of 8 to 10 mm whose energy at one depth goes with the root of the radius, as Hertz's does."""
    X, _, _, K = touches(count, seed)
    R = np.random.default_rng(seed + 200).uniform(0.008, 0.010, count)

    def energy_of(c, r):
        s = r - c[:, 2]
        return s**3 / np.sqrt(1 + s / LAW.length) * np.sqrt(r / RADIUS) * np.exp(factor(c))

    X[:, 2] += R - RADIUS
    F = [-energy_of(X + 1j * STEP * e, R).imag / STEP for e in np.eye(3)]
    by_radius = energy_of(X, R + 1j * STEP).imag / STEP
    return np.c_[X, R], energy_of(X, R), np.stack([*F, -by_radius], axis=1), np.full_like(K, np.nan)


@pytest.mark.full
def test_the_probes_radius_may_be_an_input(surface):
    X, U, response, K = sized(80, 5)
    inputs = (*INPUTS[:2], Range("z", 0.002, 0.010, "m"), Range("R", 0.008, 0.010, "m"))
    baseline = contact(surface, radius=0.009, radius_at=3, resolved=None)
    samples = EnergySamples.of(solves(X, U, response, None, inputs=inputs), baseline)
    np.testing.assert_allclose(samples.depth, X[:, 3] - X[:, 2], atol=1e-9)
    # ∂ℓ/∂R = 1/2R: the depth's part of ∂U/∂R is the law's
    slopes = samples.targets(baseline)[1][:, 0, 3]
    np.testing.assert_allclose(slopes, 0.5 / X[:, 3] * 1e-3, rtol=1e-6)
    given = np.where(np.arange(4) < 3, response, np.nan)  # as finite elements tell it
    kind = {"choose": False, "form": "axis-aligned", "radial": "gaussian"}
    s, _ = learn_energy(solves(X, U, given, K, inputs=inputs), baseline, **kind, units_max=12, effort=0.15)
    assert s.baseline.radius_input == 3
    X, U, response, _ = sized(100, 6)
    size = np.linalg.norm(response[:, :3], axis=1)
    assert np.quantile(np.linalg.norm(s.force(X) - response[:, :3], axis=1) / size, 0.95) < 0.02
