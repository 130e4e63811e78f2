"""Metrics against cases worked out by hand, and properties that they must have whatever the data."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from linear_bodies import COMPLIANCE, plane_data, plane_model, tip_data, tip_model
from palpate.units import Range
from palpate.validation import TouchFunction, TouchSolves, Validation, validate
from palpate.validation.figures.stiffness import curve_slope
from palpate.validation.limits import FORCE_JND
from palpate.validation.worst import outer_part
from pressed import INPUTS, places
from pressed import force as force_of

FULL = 5.0 * COMPLIANCE  # tip deflection at 5 N


def test_outer_part_of_one_and_of_two_inputs() -> None:
    one = np.array([[0.0], [0.49], [0.5], [5.0], [9.5], [9.51], [10.0]])
    assert outer_part(one, [Range("P", 0.0, 10.0)]).tolist() == [True, True, False, False, False, True, True]
    two = np.array([[0.0, 0.0], [0.0, 0.95], [-0.95, 0.0], [0.9, -0.9]])
    square = [Range("a", -1.0, 1.0), Range("b", -1.0, 1.0)]
    assert outer_part(two, square).tolist() == [False, True, True, False]


def test_an_exact_model_has_no_error() -> None:
    v = validate(tip_model(), tip_data())
    assert v.networks.refined.max < 1e-15
    assert v.shape.max < 1e-15
    assert v.force.max is not None
    assert v.force.max < 1e-12
    assert v.stiffness is not None
    assert v.stiffness.p95 < 1e-10
    assert v.passed


@settings(max_examples=25, deadline=None)
@given(shift=st.floats(1e-9, 1.0))
def test_a_network_off_by_a_constant_has_that_error_everywhere(shift: float) -> None:
    found = validate(tip_model(shift=-shift), tip_data()).networks.refined
    for value in (found.rmse, found.max, found.outer, found.rest, *(o.rmse for o in found.per_output)):
        assert value == pytest.approx(shift, rel=1e-6)
    assert found.full_scale == pytest.approx(FULL)
    assert found.relative == pytest.approx(shift / FULL, rel=1e-6)
    assert found.outer_ratio == pytest.approx(1.0, rel=1e-6)


@settings(max_examples=15, deadline=None)
@given(scale=st.floats(1e-3, 1e3))
def test_relative_errors_do_not_depend_on_the_body_s_size(scale: float) -> None:
    one = validate(tip_model(shift=1e-3), tip_data())
    other = validate(tip_model(shift=1e-3 * scale, scale=scale), tip_data(scale=scale))
    for label in ("refined", "filter"):
        a, b = getattr(one.networks, label), getattr(other.networks, label)
        assert b.rmse == pytest.approx(scale * a.rmse, rel=1e-6)
        assert b.relative == pytest.approx(a.relative, rel=1e-6)


def test_ends_of_the_range_are_told_from_the_rest() -> None:
    """The error is slope · ξ; the samples lie at ξ = −1 and 1 (outer), −0.5 and 0.5 (rest)."""
    data = tip_data(np.array([[0.0], [1.25], [3.75], [5.0]]))
    found = validate(tip_model(slope=1e-3), data).networks.filter
    assert found.outer_count == 2
    assert found.outer == pytest.approx(1e-3)
    assert found.rest == pytest.approx(0.5e-3)
    assert found.outer_ratio == pytest.approx(2.0)
    assert found.rmse == pytest.approx(1e-3 * math.sqrt((1 + 0.25) / 2))


def test_without_samples_at_the_ends_there_is_no_ratio() -> None:
    found = validate(tip_model(slope=1e-3), tip_data(np.array([[1.0], [2.5], [4.0]]))).networks.refined
    assert found.outer is None
    assert found.outer_ratio is None


def test_the_worst_case_is_named() -> None:
    found = validate(tip_model(slope=1e-3), tip_data(np.array([[1.25], [2.5], [4.5]]))).networks.refined
    assert found.worst.value == pytest.approx(0.8e-3)
    assert str(found.worst).endswith("under P = 4.5 N")


@pytest.mark.parametrize("factor", [0.99, 0.9])
def test_a_force_too_small_by_a_factor(factor: float) -> None:
    """Above f₀ the relative error is 1 − factor everywhere; up to f₀ it is (1 − factor) F / f₀."""
    loads = np.array([[0.05], [0.15], [0.2], [1.0], [2.0], [4.0]])
    force = validate(tip_model(force=factor), tip_data(loads)).force
    assert force.light == pytest.approx(0.05 * 4.0)
    assert (force.count, force.light_count) == (3, 3)
    for value in (force.median, force.p95, force.max):
        assert value == pytest.approx(1 - factor)
    assert force.p95_jnd == pytest.approx((1 - factor) / FORCE_JND)
    assert force.light_p95 == pytest.approx((1 - factor) * np.quantile([0.25, 0.75, 1.0], 0.95))
    assert force.direction_p95 is None


def test_half_a_newton_is_the_most_that_counts_as_light() -> None:
    heavy = tip_data(np.array([[5.0]]))
    assert validate(tip_model(), heavy).force.light == pytest.approx(0.25)
    sizes = np.array([[0.0, 0.0, -20.0], [0.0, 0.0, -1.0]])
    from palpate.validation.unseen_solves import ForceSamples

    assert ForceSamples(sizes, sizes, sizes, np.ones(2, dtype=bool)).light == 0.5


def turned(matrix: np.ndarray) -> Validation:
    """What is said of a model whose forces are those of the solves times a matrix (3, 3)."""
    X = places()
    model = TouchFunction("turned", INPUTS, lambda X: force_of(X) @ matrix.T)
    return validate(model, TouchSolves(X, force_of(X)))


@pytest.mark.grid
@pytest.mark.parametrize("degrees", [1e-5, 3.0, 90.0, 180.0])
def test_a_turned_force_is_off_by_that_angle(degrees: float) -> None:
    c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    # the solved forces lie in the x–z plane, and so does the turn
    force = turned(np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])).force
    assert force.direction_p95 == pytest.approx(degrees, rel=1e-6)
    assert force.median == pytest.approx(2 * math.sin(math.radians(degrees) / 2), rel=1e-6)


@pytest.mark.full
def test_no_force_at_all_is_as_wrong_as_the_opposite_one() -> None:
    assert turned(np.zeros((3, 3))).force.direction_p95 == pytest.approx(180.0)


def test_stiffness_too_small_by_a_factor() -> None:
    v = validate(tip_model(force=0.9), tip_data())
    assert v.stiffness is not None
    assert v.stiffness.p95 == pytest.approx(0.1, rel=1e-9)
    assert v.stiffness.median == pytest.approx(0.1, rel=1e-9)


def test_slope_of_a_cubic_in_any_order_and_with_near_twins() -> None:
    """A spline without a knot at its second point gives cubics back exactly (de Boor 1978)."""
    x = np.random.default_rng(0).permutation(np.append(np.linspace(0.0, 2.0, 41), [1.0 + 1e-9]))
    found = curve_slope(x, x**3 + x)
    assert found is not None
    rows, slope = found
    assert rows.size == 41
    np.testing.assert_allclose(slope, 3 * x[rows] ** 2 + 1, rtol=1e-9)


def test_a_curve_with_too_few_points_has_no_slope() -> None:
    x = np.linspace(0.0, 1.0, 12)
    assert curve_slope(x, 10 * x + np.sin(30 * x)) is None
    assert curve_slope(x[:5], x[:5]) is None


def test_stiffness_of_scattered_loads_is_left_out_with_a_reason() -> None:
    v = validate(plane_model(), plane_data())
    assert v.stiffness is None
    assert any("Stiffness is not judged" in note for note in v.notes)
    assert "stiffness_p95" not in {c.criterion.key for c in v.checks}


def test_the_gradient_of_an_energy_does_no_work_around_loops() -> None:
    v = validate(plane_model(np.array([[1.0, 0.3], [0.3, 1.2]])), plane_data())
    assert v.loops is not None
    assert v.loops.loops == 100
    assert v.loops.max < 1e-12
    assert v.loops.energy > 0


def test_one_touched_load_needs_no_loops() -> None:
    v = validate(tip_model(), tip_data())
    assert v.loops is None
    assert any("zero by construction" in note for note in v.notes)


def test_the_field_is_judged_by_distance() -> None:
    """The field of a body twice as soft is off by the displacement itself: COMPLIANCE · P · x²."""
    v = validate(tip_model(), tip_data(np.array([[2.0], [4.0]]), scale=2.0))
    assert v.shape.max == pytest.approx(4.0 * COMPLIANCE)
    assert v.shape.mean == pytest.approx(3.0 * COMPLIANCE * np.mean(np.linspace(0, 1, 6) ** 2))
    assert v.shape.largest == pytest.approx(8.0 * COMPLIANCE)
    assert str(v.shape.worst) == "the node at 1 m under P = 4 N"
