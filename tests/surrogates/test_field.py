"""A field under a touch: its formula, nothing without contact, its errors parted, its file."""

from __future__ import annotations

import copy
import dataclasses
import math

import numpy as np
import pytest
from field_made import field, grid
from touch_made import DEEPEST, PROBE, RADIUS, SOFT, around_points, ball, inside_points, touch_energy

from palpate.errors import UsageError
from palpate.learning.correction.corrected_surrogate import raise_surface
from palpate.learning.loading import load
from palpate.network import Archive
from palpate.network.codec import decode, encode
from palpate.runtime.touchable import touchable
from palpate.surrogates import FieldSurrogate, Surrogate
from palpate.surrogates.fields import DepthAmplitude, LocalMode, Variation
from palpate.surrogates.fields.depth_amplitude import AMPLITUDES
from palpate.surrogates.fields.local_mode import products


def by_formula(F: FieldSurrogate, x: np.ndarray) -> np.ndarray:
    """y₀ + f (Σ b φ + g₀ n + g₁ t/L) inside the trained region, with SciPy's splines."""
    from scipy.interpolate import BSpline

    d, n, _ = (a[0] for a in F.surface.at(x[None, :3]))
    s = F.radius - d
    p, a = {"linear": 1.0, "hertz": 1.5, "square": 2.0, "series": 2.0}[F.amplitude.name], F.amplitude.length
    f = (s / F.amplitude.deepest) ** p * math.sqrt((1 + F.amplitude.deepest / a) / (1 + s / a))
    shown = np.tensordot(F.network.predict(x[None])[0], F.modes, 1)
    if F.local_mode is not None:
        _, r, q = F.local_mode.table.shape
        offset = F.points - (x[:3] - d * n)
        rho = np.linalg.norm(offset, axis=1)
        near = np.flatnonzero(F.touched & (rho < F.local_mode.reach))
        in_depth = BSpline(np.arange(-3.0, q + 1), np.moveaxis(F.local_mode.table, 2, 0), 3)
        profile = in_depth(s / F.amplitude.deepest * (q - 3))  # (parts, r)
        g = BSpline(np.arange(-3.0, r + 1), profile.T, 3)(rho[near] / F.local_mode.reach * (r - 3))
        if F.rest.shape[1] == 1:
            shown[near, 0] += g[:, 0]
        else:
            across = offset[near] - (offset[near] @ n)[:, None] * n
            shown[near] += g[:, :1] * n + g[:, 1:] * across / F.local_mode.reach
        if F.local_mode.variation is not None:
            shown[near] += varied(
                F.local_mode.variation,
                x,
                x[:3] - d * n,
                s / F.amplitude.deepest,
                offset[near] / F.local_mode.reach,
            )
    return F.rest + f * shown


def varied(own: Variation, x: np.ndarray, foot: np.ndarray, share: float, offset: np.ndarray) -> np.ndarray:
    """What the variation adds (nodes, components) at offsets over L, with SciPy's splines and NumPy's Chebyshev."""
    from numpy.polynomial.chebyshev import chebvander
    from scipy.interpolate import BSpline

    q, _, r, _, _ = own.table.shape
    told = (np.r_[own.axes @ foot, x[3:]] - own.scales[0]) / own.scales[1]
    T = chebvander(np.clip(told, -1.0, 1.0), own.powers.max())
    P = np.array([np.prod([T[v, k] for v, k in enumerate(p)]) for p in own.powers])
    profile = np.einsum("m,mihc->ihc", P, BSpline(np.arange(-3.0, q + 1), own.table, 3)(share * (q - 3)))
    rho = np.linalg.norm(offset, axis=1)
    at = BSpline(np.arange(-3.0, r + 1), profile, 3)(rho * (r - 3))  # (nodes, 4, components)
    return np.einsum("nh,nhc->nc", np.column_stack([np.ones(len(rho)), offset]), at)


@pytest.mark.parametrize("amplitude", AMPLITUDES)
@pytest.mark.parametrize("components", [1, 3])
def test_the_field_is_its_formula(amplitude, components):
    F = field(
        components=components,
        amplitude=DepthAmplitude(amplitude, DEEPEST, 1e-3 if amplitude == "series" else math.inf),
    )
    X = inside_points(20)
    expected = np.array([by_formula(F, x) for x in X])
    assert F.touched.sum() == len(F.points) - 1
    np.testing.assert_allclose(F.values(X), expected, rtol=0, atol=1e-13 * np.abs(expected).max())


def test_on_a_curved_surface_the_dimple_follows_its_normal():
    F = field(curved=True)
    X = np.array([[0.006, -0.004, 0.0055], [0.0, 0.008, 0.004]])
    assert (F.depth(X) > 0).all()
    expected = np.array([by_formula(F, x) for x in X])
    np.testing.assert_allclose(F.values(X), expected, rtol=0, atol=1e-13 * np.abs(expected).max())


def test_the_dimple_of_a_family_varies_with_its_parameters_and_the_place_as_far_as_they_were_trained():
    F = field(extra=(SOFT,))
    X = inside_points(20, (SOFT,))
    expected = np.array([by_formula(F, x) for x in X])
    np.testing.assert_allclose(F.values(X), expected, rtol=0, atol=1e-13 * np.abs(expected).max())
    told = F.local_mode.variation.variables(X[:, :3], X[:, 3:])
    assert (np.abs(told) == 1.0).any()
    assert (np.abs(told[:, 2]) < 1.0).any()


def linear(shapes: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Fields (k, nodes, components) that are linear over the face, of numbers (k, 3, components)."""
    return np.einsum("nj,kjc->knc", np.column_stack([np.ones(len(points)), 10.0 * points[:, :2]]), shapes)


def test_at_other_nodes_the_dimple_is_its_formula_and_the_rest_is_carried():
    """Rest and modes that are linear over the face are carried as they are."""
    (points, triangles), rng = grid(), np.random.default_rng(3)
    shapes = rng.normal(0.0, 1e-3, (6, 3, 3))
    rest, *modes = linear(shapes, points)
    F = dataclasses.replace(field(), rest=rest, modes=np.array(modes))
    X = inside_points(20)
    np.testing.assert_array_equal(F.values_at(X, points, triangles), F.values(X))
    inner = (np.abs(points) < 0.045).all(axis=1)
    moved = points + inner[:, None] * rng.uniform(-0.003, 0.003, points.shape) * (1.0, 1.0, 0.0)
    rest, *modes = linear(shapes, moved)
    truth = dataclasses.replace(F, points=moved, rest=rest, modes=np.array(modes))
    expected, found = np.array([by_formula(truth, x) for x in X]), F.values_at(X, moved, triangles)
    face = moved[:, 2] == 0.0
    np.testing.assert_allclose(found[:, face], expected[:, face], rtol=0, atol=1e-7 * np.abs(expected).max())


@pytest.mark.parametrize("components", [1, 3])
def test_without_contact_the_field_is_that_at_rest_to_the_last_bit(components):
    F = field(components=components)
    X = around_points(200)
    away = X[F.depth(X) <= 0]
    assert len(away) > 20
    assert (F.values(away) == F.rest).all()
    ev = F.evaluator()
    assert not ev(away[0])
    assert (ev.field() == F.rest.astype(np.float32)).all()


def test_with_rest_zero_nothing_moves_without_contact_and_little_at_first_touch():
    F = field(rest=np.zeros((226, 3)))
    above = np.array([[0.001, 0.002, RADIUS + h] for h in (1e-9, 1e-3)])
    assert not F.values(above).any()
    # f of "series" begins with s²: a depth ten times less moves a hundred times less
    first, second = (np.abs(F.values(np.array([[0.001, 0.002, RADIUS - s]]))).max() for s in (1e-6, 1e-7))
    assert second / first == pytest.approx(0.01, rel=2e-3)  # 1 + s/a, and what is linear in s of b


def test_beyond_the_trained_depth_the_field_goes_on_in_proportion():
    amplitude = DepthAmplitude("square", DEEPEST)
    s = DEEPEST * np.array([-1.0, 0.0, 0.5, 1.0, 2.0, 3.0])
    np.testing.assert_allclose(amplitude.at(s), [0, 0, 0.25, 1, 2, 3], rtol=1e-15)
    F = field()
    far = np.array([[0.0, 0.0, -0.2], [0.3, 0.2, 0.0], [0.0, 0.0, RADIUS - 10 * DEEPEST]])
    assert np.isfinite(F.values(far)).all()


def test_a_radius_may_be_an_input():
    F = field(extra=(SOFT, PROBE), radius_input=4, radius=math.nan)
    X = inside_points(30, (SOFT, PROBE))
    np.testing.assert_allclose(F.depth(X), X[:, 4] - F.surface.at(X[:, :3])[0], atol=1e-15)
    one = X[F.depth(X) > 0][:1]
    alone = dataclasses.replace(F, radius_input=None, radius=float(one[0, 4]))
    np.testing.assert_array_equal(alone.values(one), F.values(one))


def test_single_precision_costs_seven_digits_and_no_more():
    F = field()
    ev, double = F.evaluator(), F.evaluator(precision="double")
    for x in inside_points(20):
        ev(x)
        double(x)
        size = np.abs(F.modes).max(axis=(1, 2)) @ np.abs(double.coefficients) + np.abs(F.rest).max()
        # 2 + k roundings of 2⁻²⁴ on each side of k + 1 products, and the local mode's
        assert np.abs(ev.field() - double.field()).max() <= 2 * (len(F.modes) + 4) * 2.0**-24 * size
        np.testing.assert_array_equal(double.values, F.values(x[None])[0])
        np.testing.assert_array_equal(double.coefficients, F.coefficients(x[None])[0])


@pytest.mark.full
def test_an_input_that_is_not_finite_gives_no_number():
    ev = field(local_mode=False).evaluator()
    assert not ev([0.0, np.nan, 0.005])
    assert np.isnan(ev.field()).all()


def test_errors_are_parted_at_right_angles():
    F, rng = field(), np.random.default_rng(1)
    X = inside_points(12)
    answered = F.values(X)
    a = rng.normal(0.0, 1e-3, (12, len(F.modes)))
    within = np.tensordot(a, F.modes, 1)
    outside = rng.normal(0.0, 1e-3, answered.shape)
    outside -= np.tensordot(np.einsum("njc,kjc,j->nk", outside, F.modes, F.mass), F.modes, 1)
    found = F.errors(X, answered + within + outside)
    np.testing.assert_allclose(found.learning, np.linalg.norm(within, axis=2), atol=1e-15)
    np.testing.assert_allclose(found.truncation, np.linalg.norm(outside, axis=2), atol=1e-15)
    np.testing.assert_allclose(found.rms("learning"), np.linalg.norm(a, axis=1), rtol=1e-12)
    squares = found.rms("truncation") ** 2 + found.rms("learning") ** 2
    np.testing.assert_allclose(found.rms() ** 2, squares, rtol=1e-12)
    assert found.as_dict()["total"] == {"mean": found.mean(), "max": found.max()}
    assert str(found).endswith("mm")
    assert f"{1e3 * found.mean():.3g} / {1e3 * found.max():.3g}" in str(found)


def test_the_splines_are_the_textbook_ones():
    from scipy.interpolate import BSpline

    t = np.random.default_rng(0).uniform(0, 1, 50)
    P = products(t, 1 - t, (9, 5))
    r = BSpline.design_matrix(6 * t, np.arange(-3.0, 10), 3).toarray()
    q = BSpline.design_matrix(2 * (1 - t), np.arange(-3.0, 6), 3).toarray()
    np.testing.assert_allclose(P, r[:, :, None] * q[:, None], atol=1e-15)


@pytest.mark.parametrize(
    "more",
    [
        {},
        {"components": 1, "local_mode": False},
        {"extra": (SOFT, PROBE), "radius_input": 4, "radius": math.nan},
    ],
    ids=["vector", "scalar", "family"],
)
def test_the_file_gives_the_same_bits_back(more):
    F = field(**more, meta={"solves": 7})
    again = decode(FieldSurrogate, encode(F, kind="field"))
    X = around_points(50, more.get("extra", ()))
    np.testing.assert_array_equal(again.values(X), F.values(X))
    assert str(again) == str(F)
    assert again.meta == {"solves": 7}


def test_a_body_keeps_energy_and_fields_in_one_file_with_one_surface(tmp_path):
    S = touch_energy()
    F = {"displacement": field(), "von Mises stress": field(components=1, seed=2)}
    again = Surrogate.load(Surrogate(S, F).save(tmp_path / "b.palpate"))
    X = around_points(50)
    np.testing.assert_array_equal(again.energy.force(X), S.force(X))
    for name, one in F.items():
        np.testing.assert_array_equal(again.fields[name].values(X), one.values(X))
        assert again.fields[name].surface is again.energy.baseline.surface


def test_a_body_with_a_corrected_energy_is_drawn_on_its_surface(tmp_path):
    S, F = touch_energy(), {"displacement": field()}
    moved = raise_surface(S.baseline.surface, 1e-4, RADIUS)
    meta = {"correction": {"counts": {"learnt": 40, "outlier": 2}}}
    energy = dataclasses.replace(S, baseline=dataclasses.replace(S.baseline, touched=moved))
    body = Surrogate(S, F).with_energy(energy, meta)
    X = around_points(50)
    np.testing.assert_allclose(body.fields["displacement"].depth(X), S.depth(X) + 1e-4, atol=1e-12)
    assert "corrected by 40 measured touches" in str(body)
    first = str(body).splitlines()[0]  # for users: what is done with it, before its network
    assert "pressed by a ball of radius" in first
    assert "units" not in first
    assert touchable(body, "block").name.endswith("corrected by 40 touches")
    again = load(body.save(tmp_path / "b.palpate"))
    np.testing.assert_array_equal(again.energy.force(X), body.energy.force(X))


@pytest.mark.parametrize("what", ["energy", "force", "stiffness", "inside"])
def test_inputs_that_are_no_numbers_are_refused(what):
    X = around_points(5)
    X[3, 1] = np.nan
    with pytest.raises(UsageError, match="Row 3 of 5 inputs is not finite"):
        getattr(touch_energy(), what)(X)
    with pytest.raises(UsageError, match="are numbers"):
        getattr(touch_energy(), what)("above")
    with pytest.raises(UsageError, match="one row for a single place"):
        getattr(touch_energy(), what)(X[0])
    with pytest.raises(UsageError, match="Row 3 of 5"):
        field().values(X)


def test_fields_of_another_body_are_refused():
    with pytest.raises(UsageError, match="not of the body"):
        Surrogate(touch_energy(), {"u": field(curved=True)})
    with pytest.raises(UsageError, match="not of the body"):
        Surrogate(touch_energy(surface=ball()), {"u": field()})
    with pytest.raises(UsageError, match="different inputs"):
        Surrogate(touch_energy(), {"u": field(extra=(SOFT,))})


@pytest.mark.parametrize(
    ("part", "value"),
    [
        ("amplitude.name", "cube"),
        ("local_mode.reach", -1.0),
        ("radius", True),
        ("meta", []),
        ("name", 3),
        ("modes", np.float32),
        ("mass", np.float32),
        ("triangles", np.float32),
        ("local_mode.table", 1),
        ("local_mode.variation.table", np.float32),
        ("local_mode.variation.powers", np.float32),
        ("mass", -1),
        ("modes", -1),
    ],
)
def test_a_file_with_parts_that_do_not_fit_is_refused(part, value):
    archive = encode(field(), kind="field")
    meta, arrays = copy.deepcopy(dict(archive.meta)), dict(archive.arrays)
    if isinstance(value, type):
        arrays[part] = arrays[part].astype(value)
    elif part in arrays:
        arrays[part] = arrays[part][:value].copy()
    else:
        *inner, last = part.split(".")
        place = meta
        for name in inner:
            place = place[name]
        place[last] = value
    with pytest.raises((KeyError, TypeError, ValueError, UsageError)):
        decode(FieldSurrogate, Archive(archive.networks, arrays, meta, archive.kind))


def test_parts_that_do_not_fit_are_refused():
    F = field()
    for more in (
        {"rest": np.zeros((4, 3))},
        {"mass": 2 * F.mass},
        {"radius": -1.0},
        {"triangles": np.array([[0, 1, 999]])},
        {"radius_input": 2},
        {"modes": F.modes[:-1]},
        {"local_mode": LocalMode(F.local_mode.table[:1], 0.02, 1e-4)},
        {"local_mode": LocalMode(np.ones((2, 9, 5)), 0.02, 1e-4)},  # does not end at its reach
    ):
        with pytest.raises(UsageError, match="field surrogate"):
            dataclasses.replace(F, **more)
    with pytest.raises(UsageError, match="grow"):
        DepthAmplitude("cube", 0.01)
    with pytest.raises(UsageError, match="length"):
        DepthAmplitude("square", 0.01, 1e-3)
    with pytest.raises(UsageError, match="local mode"):
        LocalMode(np.full((2, 9, 5), np.nan), 0.02, 1e-4)
    with pytest.raises(UsageError, match="within"):
        LocalMode(np.zeros((2, 9, 5)), 0.02, 0.0)
    own = F.local_mode.variation
    for more in ({"table": own.table[:, :-1]}, {"scales": -own.scales}, {"axes": own.axes[:, :2]}):
        with pytest.raises(UsageError, match="how a local mode varies"):
            dataclasses.replace(own, **more)
    scalar = dataclasses.replace(own, table=own.table[..., :1])
    with pytest.raises(UsageError, match="another local mode"):
        dataclasses.replace(F.local_mode, variation=scalar)
    with pytest.raises(UsageError, match="other inputs"):
        dataclasses.replace(field(extra=(SOFT,)), local_mode=F.local_mode)
    with pytest.raises(UsageError, match="shape"):
        F.values(np.zeros((3, 2)))
    with pytest.raises(UsageError, match="answered"):
        F.evaluator()(np.zeros(2))
    assert len(grid()[0]) == len(F.points)
