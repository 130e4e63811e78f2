"""The posterior of a refined network: against the dense joint one, and against the filter's own covariance."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from laws.beams import INPUT, exact, stiffening
from palpate.errors import UsageError
from palpate.learning import Observation, Settings, initial, observe, posterior, refine, step
from palpate.network import Scaling
from palpate.rbf.filter.prediction import value
from palpate.rbf.forms import unit_form
from palpate.rbf.freezing import freeze_refined
from palpate.rbf.refinement.posterior import Posterior
from palpate.rbf.regressors import Regressors
from palpate.units import Quantity, Range

LINE = Regressors(unit_form("axis-aligned", 1))


def small(name, radial, tail="affine", *, m=3, N=30):
    """A network refined a little on random data of two inputs."""
    rng = np.random.default_rng(7)
    r = Regressors(unit_form(name, 2), radial, tail)
    X, Y = rng.uniform(-1, 1, (N, 2)), rng.normal(size=(N, m))
    start = np.array([r.form.unit(x, 0.8, seed=i) for i, x in enumerate(X[:3])])
    start += rng.normal(0, 0.1, start.shape)  # round units have no defined rotation
    return refine(X, Y, start, r, iterations=3), X, Y, rng


def frozen(found, inputs=2):
    """As a network whose physical quantities are the scaled ones."""
    m = found.coefficients.shape[1]
    scaling = Scaling(np.zeros(inputs), np.ones(inputs), np.zeros(m), np.ones(m))
    ranges = tuple(Range(f"x{i}", -1.0, 1.0, "N") for i in range(inputs))
    return freeze_refined(found, ranges, tuple(Quantity(f"y{j}", "m") for j in range(m)), scaling)


def rows_by_all(found, X, slopes=False):
    """∂f_j/∂(C output by output, θ) at X: (N, m, d), or (N n, m, d) of the slopes."""
    r, theta, W = found.regressors, found.theta, found.weights
    if slopes:
        tail, phi, D = r.tail_slopes(len(X)), *r.slopes_by_theta(X, theta)
        n = X.shape[1]
        F = np.concatenate([tail, phi], axis=2).reshape(len(X) * n, -1)
        D = D.reshape(len(X) * n, *theta.shape)
    else:
        phi, D = r.by_theta(X, theta)
        F = np.hstack([r.tail_rows(X), phi])
    m, c = W.shape[1], F.shape[1]
    H = np.zeros((len(F), m, m * c + theta.size))
    for j in range(m):
        H[:, j, j * c : (j + 1) * c] = F
        H[:, j, m * c :] = (D * W[:, j][:, None]).reshape(len(F), -1)
    return H


@pytest.mark.parametrize("slopes", [False, True])
@pytest.mark.parametrize("tail", ["affine", "none"])
@pytest.mark.parametrize(
    ("name", "radial"),
    [
        ("isotropic", "gaussian"),
        ("axis-aligned", "inverse-multiquadric"),
        ("rotated", "gaussian"),
        ("rank-1", "matern-5/2"),
    ],
)
def test_predictive_variance_is_that_of_the_dense_joint_posterior(name, radial, tail, slopes):
    found, X, _, rng = small(name, radial, tail)
    m, c = found.coefficients.shape[1], len(found.coefficients)
    noise, ridge = np.array([0.1, 0.3, 0.02]), rng.uniform(0.01, 0.1, c)
    prior, weights = rng.uniform(0.5, 2.0, found.theta.shape[1]), rng.uniform(0.2, 2.0, len(X))
    share = rng.uniform(0.1, 1.0, len(X)) if slopes else None
    posterior_ = Posterior.of(
        found, X, noise=noise, prior=prior, ridge=ridge, weights=weights, slope_weight=share
    )

    H = rows_by_all(found, X) * np.sqrt(weights)[:, None, None]
    if slopes:
        H = np.vstack(
            [H, rows_by_all(found, X, slopes=True) * np.repeat(np.sqrt(weights * share), 2)[:, None, None]]
        )
    precision = np.diag(np.r_[(ridge[None] / noise[:, None]).ravel(), np.tile(1 / prior, len(found.theta))])
    precision += np.einsum("ija,ijb,j->ab", H, H, 1 / noise)
    P = np.linalg.inv(precision)
    np.testing.assert_allclose(posterior_.shapes, P[m * c :, m * c :], rtol=1e-7, atol=1e-10)

    unseen = rng.uniform(-1, 1, (40, 2))
    h = rows_by_all(found, unseen)
    variance = noise + np.einsum("ija,ab,ijb->ij", h, P, h)
    deviation = posterior_.uncertainty(frozen(found)).deviation(unseen)
    np.testing.assert_allclose(deviation**2, variance, rtol=1e-8)


def test_many_outputs_and_few_take_two_ways_to_one_variance():
    found, X, _, rng = small("rotated", "gaussian", m=2)
    wide = replace(found, coefficients=np.repeat(found.coefficients, 4, axis=1))
    noise = np.array([0.1, 0.2])
    few = Posterior.of(found, X, noise=noise)
    # the same posterior: four copies of each output, each with four times the noise, say what one says
    many = Posterior.of(wide, X, noise=4 * np.repeat(noise, 4))
    np.testing.assert_allclose(few.shapes, many.shapes, rtol=1e-6, atol=1e-10)
    unseen = rng.uniform(-1, 1, (70, 2))
    a = few.uncertainty(frozen(found)).deviation(unseen) ** 2 - noise
    b = many.uncertainty(frozen(wide)).deviation(unseen) ** 2 - 4 * np.repeat(noise, 4)
    row = np.hstack([np.ones((70, 1)), unseen, found.regressors.phi(unseen, found.theta)])
    linear = np.einsum("ni,ij,nj->n", row, few.coefficients, row)[:, None]
    np.testing.assert_allclose(
        (a - noise * linear).repeat(4, axis=1), b - 4 * np.repeat(noise, 4) * linear, atol=1e-8
    )


def test_structured_posterior_is_small():
    """h = 100, n = 3, m = 60: the dense joint covariance would take 350 MB."""
    rng = np.random.default_rng(0)
    r = Regressors(unit_form("axis-aligned", 3), "inverse-multiquadric")
    X, Y = rng.uniform(-1, 1, (500, 3)), rng.normal(size=(500, 60))
    found = refine(X, Y, np.array([r.form.unit(x, 0.8) for x in X[:100]]), r, iterations=1)
    p = Posterior.of(found, X, Y)
    numbers = sum(a.size for a in (p.noise, p.coefficients, p.shapes, p.chain, p.through))
    assert numbers * 8 < 6e6
    kept = p.uncertainty(frozen(found, 3)).attached().extras
    assert sum(a.nbytes for a in kept.values()) < 6e6


def test_noise_is_found_from_the_residuals():
    rng = np.random.default_rng(0)
    X = rng.uniform(-1, 1, (4000, 1))
    Y = np.hstack([np.sin(2 * X), np.cos(2 * X)]) + rng.normal(0, [0.1, 0.02], (4000, 2))
    found = refine(X, Y, np.array([[-0.5, 0.0], [0.5, 0.0]]), LINE)
    np.testing.assert_allclose(np.sqrt(Posterior.of(found, X, Y).noise), [0.1, 0.02], rtol=0.05)
    with pytest.raises(UsageError, match="noise"):
        Posterior.of(found, X)


@pytest.mark.parametrize("update", ["full", "decoupled", "shared"])
@pytest.mark.parametrize("sloped", [False, True])
@pytest.mark.parametrize("m", [1, 2])
def test_posterior_of_a_linear_model_is_the_filters_own_covariance(update, sloped, m):
    """Values and slopes, each sample and each slope with a weight of its own."""
    rng = np.random.default_rng(3)
    X, w, share = rng.uniform(-1, 1, (30, 1)), rng.uniform(0.2, 3.0, 30), rng.uniform(0.1, 2.0, 30)
    Y = np.hstack([2 * X + 1, 1 - X])[:, :m] + 0.01 * rng.normal(size=(30, m))
    slopes = np.broadcast_to(np.array([[2.0], [-1.0]])[:m], (30, m, 1))
    more = {"slopes": slopes, "slope_weight": share} if sloped else {}
    found = refine(X, Y, np.zeros((0, 2)), LINE, weights=w, **more)
    # the shared rule takes no slopes; without units the full rule's covariance of one output is what it shares
    rule = "full" if sloped and update == "shared" else update
    state = initial(1, m, exact(noise=1e-2, update=rule))
    for i in range(30):
        seen = Observation(X[i], Y[i], w[i], slopes[i] if sloped else None, share[i])
        state, _ = observe(state, seen, exact(noise=1e-2, update=rule))
    settings = exact(noise=1e-2, update=update)
    own = posterior(found, X, settings, weights=w, slope_weight=share if sloped else None).covariance.matrix
    np.testing.assert_allclose(own, state.covariance.matrix[: len(own), : len(own)], rtol=1e-8)


@pytest.mark.parametrize("update", ["full", "decoupled", "winner", "shared"])
def test_slopes_make_every_kind_of_posterior_surer(update):
    """Six values leave a curved network's shapes open; six slopes close them."""
    X = np.linspace(-1, 1, 6)[:, None]
    found = refine(
        X, np.hstack([np.exp(-4 * X**2), X**2]), np.array([[0.1, -0.5], [0.6, 0.0]]), LINE, iterations=3
    )
    settings = Settings(update=update, noise=1e-2)
    values, both = (posterior(found, X, settings, slope_weight=s).covariance.matrix for s in (None, 1.0))
    gained = np.linalg.eigvalsh(values - both)
    assert gained.min() > -1e-12
    assert np.trace(both) < 0.8 * np.trace(values)
    none = posterior(found, X, settings, slope_weight=0.0).covariance.matrix
    np.testing.assert_allclose(none, values, rtol=1e-12)


@pytest.mark.parametrize("update", ["full", "shared"])
def test_what_the_data_leave_open_is_no_failure(update):
    """Units that coincide, and a prior that says nothing: singular to working precision."""
    X = np.linspace(-1, 1, 8)[:, None]
    found = refine(X, np.sin(X), np.tile([[0.0, 0.0]], (3, 1)), LINE, iterations=0)
    settings = Settings(update=update, noise=1e-14, prior=1e12, width_prior=1e12, tail_prior=1e12)
    P = posterior(replace(found, rms=0.0), X, settings).covariance.matrix
    assert np.isfinite(P).all()
    assert (np.diag(P) > 0).all()


@pytest.mark.parametrize(
    "bad",
    [
        {"noise": np.array([0.1, -0.1])},
        {"noise": np.array([0.1, 0.0])},
        {"noise": np.array([0.1])},
        {"prior": 0.0},
        {"prior": np.nan},
        {"ridge": -1.0},
        {"Y": np.zeros(30)},
        {"Y": np.zeros((30, 3))},
        {"Y": np.zeros((29, 2))},
        {"Y": np.full((30, 2), np.nan)},
        {"weights": np.ones(29)},
        {"slope_weight": -1.0},
    ],
)
def test_what_makes_no_gaussian_is_refused(bad):
    found, X, Y, _ = small("rotated", "gaussian", m=2)
    with pytest.raises(UsageError) as caught:
        Posterior.of(found, X, **({"Y": Y} | bad))
    assert caught.value.fix


def test_decoupled_posterior_inverts_the_diagonal_blocks():
    x, _, found = refined_line()
    full, blocks = (Settings(update=u, noise=1e-6) for u in ("full", "decoupled"))
    information = np.linalg.inv(posterior(found, x, full).covariance.matrix)
    state = posterior(found, x, blocks)
    for k in range(3):
        rows = state.block(k)
        np.testing.assert_allclose(
            state.covariance.units[k], np.linalg.inv(information[rows, rows]), rtol=1e-5, atol=1e-12
        )


def test_shared_posterior_is_the_structured_one():
    x, _, found = refined_line()
    settings = Settings(update="shared", noise=1e-6)
    state = posterior(found, x, settings)
    r = max(1e-6, found.rms**2)
    p = Posterior.of(found, x, noise=np.full(3, r), ridge=r, prior=1.0)
    np.testing.assert_allclose(state.covariance.shapes, p.shapes, rtol=1e-8)
    np.testing.assert_allclose(state.covariance.regressors, r * p.coefficients, rtol=1e-8)


def refined_line():
    X, Y = stiffening(26)
    s = Scaling.of(INPUT, Y)
    x, y = s.scale_inputs(X), s.scale_outputs(Y)
    return x, y, refine(x, y, np.column_stack([np.linspace(-1, 1, 3), np.full(3, np.log(0.8))]), LINE)


@pytest.mark.grid
@pytest.mark.parametrize("update", ["full", "decoupled", "winner", "shared"])
def test_learning_goes_on_from_the_posterior_without_harm(update):
    x, _, found = refined_line()
    settings = Settings(units_max=3, noise=max(found.rms**2, 1e-12), update=update)
    state = posterior(found, x, settings)
    s = Scaling.of(INPUT, stiffening(26)[1])
    unseen, answers = stiffening(211)
    u, v = s.scale_inputs(unseen), s.scale_outputs(answers)
    before = np.sqrt(((value(state, u, settings) - v) ** 2).mean())
    assert before == pytest.approx(np.sqrt(((found.predict(u) - v) ** 2).mean()), rel=1e-9)
    for i in np.random.default_rng(0).permutation(len(u)):
        state, _ = step(state, u[i], v[i], settings)
    after = np.sqrt(((value(state, u, settings) - v) ** 2).mean())
    assert after < 1.5 * before


def test_settings_of_another_form_are_refused():
    x, _, found = refined_line()
    with pytest.raises(UsageError, match="inverse-multiquadric"):
        posterior(replace(found, regressors=replace(LINE, radial="inverse-multiquadric")), x, Settings())
