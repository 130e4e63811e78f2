"""The energy of a touch, whatever was learnt: exact zeros, one energy, its continuation, its trust."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from benchmarks.plain_query import PlainQuery
from touch_made import (
    BOX,
    DEEPEST,
    PROBE,
    RADIUS,
    SOFT,
    around_points,
    ball,
    differences,
    inside_points,
    network,
    plane,
    touch_energy,
    undisturbed,
)

from allocated import kept_by
from palpate.errors import UsageError
from palpate.network import TrainedRegion
from palpate.surrogates import ContactBaseline, ContactLaw, Continuation, LearntEnergy, Surrogate
from palpate.surrogates import energy as energy_module

FAMILY = {"extra": (SOFT, PROBE), "radius_at": 4}
LAWS = [ContactLaw("square"), ContactLaw("hertz"), ContactLaw("pad"), ContactLaw("series", 1e-3)]
NORMAL = np.array([0.0, 0.0, 1.0])


def relative(found, wanted, axes):
    return np.linalg.norm(found - wanted, axis=axes) / np.linalg.norm(wanted, axis=axes)


@pytest.mark.parametrize("law", LAWS, ids=[law.name for law in LAWS])
def test_without_contact_everything_is_exactly_zero_everywhere(law):
    S = touch_energy(law=law)
    X = around_points(2000) + 0.03 * NORMAL
    X[0] = [0.0, 0.0, 1e6]
    apart = S.depth(X) <= 0
    assert apart.sum() > 1500
    X = X[apart]
    assert not S.energy(X).any()
    assert not S.force(X).any()
    assert not S.stiffness(X).any()
    assert not S.deviation(X).any()
    assert not S.force_covariance(X).any()
    assert S.inside(X).all()


@pytest.mark.parametrize("law", LAWS, ids=[law.name for law in LAWS])
def test_first_touch_begins_with_no_force_and_grows_as_the_law_does(law):
    S = touch_energy(law=law, units=0)
    depth = np.array([1e-9, 1e-8])
    X = np.column_stack([np.zeros((2, 2)), RADIUS - depth])
    s = S.depth(X)  # as rounding leaves it
    F = np.linalg.norm(S.force(X), axis=1)
    power = {"square": 1.0, "hertz": 1.5}.get(law.name, 2.0)
    # the factor's slope and the crossing change it by s/a and s ℓ', some 1e-5 at these depths
    assert np.log(F[1] / F[0]) / np.log(s[1] / s[0]) == pytest.approx(power, abs=1e-4)
    deeper = S.force(np.array([[0.0, 0.0, RADIUS - 1e-3]]))
    assert F[0] < 1e-5 * np.linalg.norm(deeper)
    assert np.isfinite(S.stiffness(X)).all()


@pytest.mark.grid
@pytest.mark.parametrize("surface", [plane, ball], ids=["plane", "ball"])
@pytest.mark.parametrize("more", [{}, FAMILY], ids=["3", "5"])
@pytest.mark.parametrize("points", [inside_points, around_points], ids=["inside", "around"])
def test_force_and_stiffness_are_derivatives_of_the_energy(surface, more, points):
    S, h = touch_energy(surface=surface(), **more), 2e-5
    X = undisturbed(S, points(1500, more.get("extra", ())), 3 * h)
    assert len(X) > 30
    assert S.inside(X).any()
    steps = np.full(3, h)
    F, K = S.force(X), S.stiffness(X)
    # sixth order: 1e-16 U/h of rounding beside F ≥ 2 U/s, and (h/s)⁶ < 60⁻⁶ times the law's powers
    assert relative(-differences(S.energy, X, steps), F, 1).max() < 1e-9
    assert relative(differences(S.force, X, steps), K, (1, 2)).max() < 1e-9
    np.testing.assert_array_equal(K, K.transpose(0, 2, 1))


@pytest.mark.grid
@pytest.mark.parametrize("law", LAWS, ids=[law.name for law in LAWS])
@pytest.mark.parametrize("surface", [plane, ball], ids=["plane", "ball"])
def test_inside_it_is_what_the_formulas_say_in_plain_numpy(law, surface):
    S = touch_energy(law=law, surface=surface())
    plain = PlainQuery(S)
    X = inside_points(200)
    X = X[S.depth(X) > 1e-6]
    U, F, K, near = (np.array(part) for part in zip(*(plain(x) for x in X), strict=True))
    np.testing.assert_allclose(S.energy(X), U, rtol=1e-12)
    assert relative(S.force(X), F, 1).max() < 1e-12
    assert relative(S.stiffness(X), K, (1, 2)).max() < 1e-11
    np.testing.assert_array_equal(S.inside(X), near)
    np.testing.assert_allclose(S.deviation(X), [plain.trust(x) for x in X], rtol=1e-11)


def test_force_is_minus_the_gradient_to_rounding_by_a_complex_step():
    """Of the formula over a plane, where complex places need no spline."""
    S = touch_energy()
    X = inside_points(100)
    X = X[S.depth(X) > 1e-4]
    net, s = S.network, S.network.scaling

    def energy(x):
        xi = (x - s.input_centre) / s.input_half
        v = net.factors @ xi - net.shifts
        phi = np.exp(-(v * v).sum(axis=1))
        ell = s.output_centre[0] + net.tail[0, 0] + net.tail[0, 1:] @ xi + net.weights[0] @ phi
        depth = RADIUS - x[2]
        return depth**3 / np.sqrt(1 + depth / S.baseline.law.length) * np.exp(ell)

    F = np.array([[-energy(x + 1e-30j * np.eye(3)[i]).imag / 1e-30 for i in range(3)] for x in X])
    assert relative(S.force(X), F, 1).max() < 1e-12


def loops():
    """Closed paths (t in [0, 2π)) in metres: inside; out of the ranges and back; lifting off; both."""
    return {
        "inside": (0.008, 0.003, 0.004, 0.003),
        "beside": (0.035, 0.010, 0.004, 0.002),
        "deeper": (0.010, 0.004, 0.000, 0.007),
        "lifts off": (0.012, 0.008, 0.009, 0.006),
        "everything": (0.040, 0.030, 0.004, 0.012),
    }


def stroke(shape, panels: int = 6000):
    """Centres (N, 3) and weighted tangents (N, 3) of a loop by Gauss–Legendre panels."""
    a, b, middle, c = shape
    t, w = np.polynomial.legendre.leggauss(6)
    edges = np.linspace(0.0, 2 * np.pi, panels + 1)
    half = np.pi / panels
    t = (edges[:-1, None] + half * (1 + t)).ravel()
    w = np.tile(half * w, panels)
    # a figure that does not retrace itself
    place = np.column_stack([a * np.sin(t), b * np.sin(2 * t + 0.7), middle + c * np.cos(t + 0.4)])
    along = np.column_stack([a * np.cos(t), 2 * b * np.cos(2 * t + 0.7), -c * np.sin(t + 0.4)])
    return place, along * w[:, None]


@pytest.mark.grid
@pytest.mark.parametrize("surface", [plane, ball], ids=["plane", "ball"])
@pytest.mark.parametrize("name", loops())
def test_no_closed_path_yields_work(surface, name):
    S = touch_energy(surface=surface())
    place, tangent = stroke(loops()[name])
    power = (S.force(place) * tangent).sum(axis=1)
    exchanged = np.abs(power).sum() / 2  # given and taken back along the stroke
    assert exchanged > 1e-5
    assert abs(power.sum()) < 1e-9 * exchanged
    s, inside = S.depth(place), S.inside(place)
    if surface is plane:
        assert (~inside & (s > 0)).any() == (
            name in {"beside", "deeper", "everything"}
        ) or name == "lifts off"
        assert (s < 0).any() == (name in {"lifts off", "everything"})


def test_inside_its_ranges_nothing_of_the_continuation_is_felt():
    S = touch_energy()
    wide = dataclasses.replace(S, continuation=Continuation(10 * S.continuation.widths))
    X = inside_points(300)
    np.testing.assert_array_equal(S.force(X), wide.force(X))
    np.testing.assert_array_equal(S.stiffness(X), wide.stiffness(X))


@pytest.mark.parametrize("law", LAWS, ids=[law.name for law in LAWS])
@pytest.mark.parametrize("surface", [plane, ball], ids=["plane", "ball"])
def test_pressing_deeper_than_trained_meets_more_force_but_no_more_than_the_law_gives(law, surface):
    S = touch_energy(law=law, surface=surface(), units=0)
    depth = np.linspace(0.9, 1.7, 400) * DEEPEST  # to 2 cm, before the ball's middle
    X = np.column_stack([np.zeros((400, 2)), RADIUS - depth])
    push, stiff = S.force(X)[:, 2], -S.stiffness(X)[:, 2, 2]
    assert (np.diff(push) > 0).all()
    assert (stiff > 0).all()
    # far beyond, ℓ is constant along the depth: U, F and stiffness are the law's, times one κ
    s = S.depth(X)[-1:]
    far = S.energy(X)[-1:] / law.energy(s)[0]
    going = S.continuation
    slope = -0.3 / 0.006  # ℓ' by c_z of the tail
    bound = np.exp(10.0 + slope * (RADIUS - going.deepest - going.depth_width - 0.004))
    assert far[0] <= bound
    # within what the saturation has left of its slope at 1.7 depths: 4 e^{−2·2.8} w of ℓ'
    assert push[-1] == pytest.approx(float(far[0] * law.energy(s)[1][0]), rel=0.02)


def test_beside_the_ranges_the_factor_ends_within_its_width():
    S = touch_energy()
    x = np.linspace(0.02, 0.045, 200)  # still over the plane
    X = np.column_stack([x, np.zeros(200), np.full(200, 0.004)])
    kappa = S.energy(X) / S.baseline.law.energy(S.depth(X))[0]
    # ℓ where the saturation ends: the network's own there
    end = S.network.predict(np.array([[0.02 + S.continuation.widths[0], 0.0, 0.004]]))[0, 0]
    assert kappa[-1] == pytest.approx(np.exp(end), rel=1e-6)  # tanh has 2 e^{−2·8.3} left
    assert not S.inside(X[1:]).any()


def test_a_radius_that_is_an_input_acts_like_one_that_is_fixed():
    S = touch_energy(**FAMILY)
    baseline = dataclasses.replace(S.baseline, radius_at=None, probe_radius=0.009)
    fixed = dataclasses.replace(S, baseline=baseline)
    X = inside_points(200, FAMILY["extra"])
    X[:, 4] = 0.009
    np.testing.assert_array_equal(S.force(X), fixed.force(X))
    larger = X.copy()
    larger[:, 4] += 0.001
    np.testing.assert_allclose(S.depth(larger) - S.depth(X), 0.001, rtol=1e-12)


def test_inside_means_in_all_ranges_no_deeper_and_near_the_data():
    S = touch_energy(extra=(SOFT,))
    near = S.network.scaling.input_centre + S.network.scaling.input_half * S.region.points
    contact = S.depth(near) > 0
    assert S.inside(near)[contact].all()
    for column, value in ((0, 0.021), (1, -0.021), (2, -0.003), (3, 3e3), (3, 13e3)):
        beyond = near[contact][:20].copy()
        beyond[:, column] = value
        assert not S.inside(beyond).any()
    alone = dataclasses.replace(S, region=TrainedRegion(np.zeros((1, 4)), 0.3))
    X = inside_points(500, (SOFT,))
    xi = S.network.scaling.scale_inputs(X)
    expected = (np.linalg.norm(xi, axis=1) <= 0.3) | (S.depth(X) <= 0)
    np.testing.assert_array_equal(alone.inside(X), expected)
    shallow = dataclasses.replace(S, continuation=Continuation.of(S.inputs, deepest=0.004), region=None)
    np.testing.assert_array_equal(shallow.inside(X), S.depth(X) <= 0.004)


@pytest.mark.parametrize("without", [0, 2, None])
def test_deviation_is_how_much_the_force_moves_with_the_weights(without):
    """Each column of the root moves tail and weights; the force's own change is differenced.

    The last units, or all of them, may have no covariance, as those of a mean's further networks.
    """
    S = touch_energy(extra=(SOFT,))
    root = S.root.copy()
    root[len(root) - (S.network.units if without is None else without) :] = 0.0
    S = dataclasses.replace(S, root=root)
    X = inside_points(60, (SOFT,))
    X = X[S.depth(X) > 1e-4]
    F, covariance, net, h = S.force(X), np.zeros((len(X), 3, 3)), S.network, 1e-3
    for column in S.root.T:
        moved = []
        for sign in (h, -h):
            tail = net.tail + sign * column[: net.tail.size]
            weights = net.weights + sign * column[net.tail.size :]
            shifted = dataclasses.replace(net, tail=tail, weights=weights)
            moved.append(dataclasses.replace(S, network=shifted).force(X))
        slope = (moved[0] - moved[1]) / (2 * h)
        covariance += slope[:, :, None] * slope[:, None, :]
    np.testing.assert_allclose(S.force_covariance(X), covariance, rtol=1e-6, atol=1e-6 * covariance.max())
    expected = np.sqrt(np.trace(covariance, axis1=1, axis2=2)) / np.linalg.norm(F, axis=1)
    np.testing.assert_allclose(S.deviation(X), expected, rtol=1e-6)
    evaluator = S.evaluator()
    np.testing.assert_array_equal([evaluator.trust(x[:3], x[3:]) for x in X], S.deviation(X))


@pytest.mark.parametrize("more", [{}, FAMILY], ids=["3", "5"])
def test_the_evaluator_gives_the_same_bits_as_the_batch(more):
    S = touch_energy(**more)
    evaluator, X = S.evaluator(), around_points(200, more.get("extra", ()))
    U, F, K, inside, s = S.energy(X), S.force(X), S.stiffness(X), S.inside(X), S.depth(X)
    trust = S.deviation(X)
    for i, x in enumerate(X):
        evaluator(x[:3], x[3:])
        assert (evaluator.energy, evaluator.depth, evaluator.inside) == (U[i], s[i], inside[i])
        np.testing.assert_array_equal(evaluator.force, F[i])
        np.testing.assert_array_equal(evaluator.stiffness, K[i])
        assert evaluator.trust(x[:3], x[3:]) == trust[i]


def test_many_answers_are_shared_by_threads_and_the_same_bits(monkeypatch):
    S = touch_energy()
    X = around_points(20_001)  # so many that threads meet
    monkeypatch.setattr(energy_module, "available_cores", lambda: 1)
    alone = S.energy(X), S.force(X), S.stiffness(X), S.inside(X)
    monkeypatch.setattr(energy_module, "available_cores", lambda: 3)
    parts, one = [], LearntEnergy._fill

    def fill(self, X, answers, inside):
        parts.append(len(X))
        one(self, X, answers, inside)

    monkeypatch.setattr(LearntEnergy, "_fill", fill)
    for found, before in zip((S.energy(X), S.force(X), S.stiffness(X), S.inside(X)), alone, strict=True):
        np.testing.assert_array_equal(found, before)
    assert parts == 12 * [6667]


def test_nothing_is_allocated_by_a_call():
    evaluator, position, none = touch_energy().evaluator(), np.array([0.001, 0.002, 0.003]), np.zeros(0)
    assert kept_by(lambda: (evaluator(position, none), evaluator.trust(position, none))) < 500


def test_plain_sequences_are_as_good_as_arrays():
    evaluator = touch_energy(**FAMILY).evaluator()
    evaluator([0, 0, 0.004], (8000, 0.01))
    force = evaluator.force.copy()
    evaluator(np.array([0, 0, 0.004]), np.array([8000, 0.01]))
    np.testing.assert_array_equal(evaluator.force, force)


@pytest.mark.parametrize("x", [[np.nan, 0, 0.004, 8e3], [0, 0, np.inf, 8e3], [0, 0, 0.004, np.nan]])
def test_not_a_number_is_not_hidden(x):
    S = touch_energy(extra=(SOFT,))
    evaluator = S.evaluator()
    trust = evaluator.trust(np.array(x[:3], float), np.array(x[3:], float))
    assert np.isnan(evaluator.force).all()
    assert np.isnan(evaluator.stiffness).all()
    assert np.isnan(trust)
    assert not evaluator.inside


def test_without_a_posterior_the_trust_is_unknown():
    S = touch_energy(root=None)
    with pytest.raises(UsageError, match="deviation"):
        S.deviation(inside_points(3))
    with pytest.raises(UsageError, match="deviation"):
        S.force_covariance(inside_points(3))
    evaluator = S.evaluator()
    assert np.isnan(evaluator.trust(np.array([0.0, 0.0, 0.004])))
    assert evaluator.trust(np.array([0.0, 0.0, 0.04])) == 0.0


def test_it_says_what_it_is_in_plain_words():
    meta = {"solves": 33, "samples": 264, "force_error": {"median": 0.0035, "p95": 0.013}}
    text = str(Surrogate(touch_energy(extra=(SOFT,)), meta=meta))
    for word in (
        "c_x -0.02 … 0.02 m",
        "modulus 4000 … 12000 Pa",
        "radius 10 mm",
        "a = 1 mm",
        "40 rotated units",
    ):
        assert word in text
    assert "33 solves (264 samples by symmetry)" in text
    assert "0.35 % median, 1.3 % p95" in text
    assert "whose radius is an input" in str(touch_energy(**FAMILY))


@pytest.mark.parametrize(
    ("more", "word"),
    [
        ({"region": TrainedRegion(np.zeros((1, 4)), 1.0)}, "region"),
        ({"continuation": Continuation(np.ones(4))}, "continuation"),
        ({"root": np.zeros((5, 2))}, "posterior"),
        ({"network": network([*BOX, SOFT]).select([0]), "root": None}, "region"),
    ],
)
def test_parts_that_do_not_fit_are_refused(more, word):
    S = touch_energy()
    with pytest.raises(UsageError, match=word):
        dataclasses.replace(S, **more)


@pytest.mark.parametrize(
    ("more", "word"),
    [({"probe_radius": np.nan}, "radius"), ({"probe_radius": 0.05}, "begins"), ({"radius_at": 3}, "input 3")],
)
def test_a_probe_that_does_not_fit_is_refused(more, word):
    S = touch_energy()
    with pytest.raises(UsageError, match=word):
        dataclasses.replace(S, baseline=dataclasses.replace(S.baseline, **more))


def test_inputs_of_another_shape_are_refused():
    S = touch_energy()
    with pytest.raises(UsageError, match=r"c_x \(m\), c_y \(m\), c_z"):
        S.force(np.zeros((2, 4)))
    with pytest.raises(UsageError, match=r"\(3,\)"):
        S.evaluator()(np.zeros(2))
    with pytest.raises(UsageError, match=r"\(3,\)"):
        S.evaluator()(np.zeros(3), np.zeros(1))


def test_defaults_make_a_surrogate_without_region_or_depth():
    S = LearntEnergy(network(BOX), ContactBaseline(ContactLaw("pad"), plane(), RADIUS))
    X = inside_points(50)
    assert S.inside(X).all()
    assert (S.energy(X)[S.depth(X) > 0] > 0).all()
