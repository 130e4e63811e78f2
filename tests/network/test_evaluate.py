"""Every form, radial function and output map: against the formula, its complex step, and each other."""

from __future__ import annotations

import tracemalloc
from dataclasses import replace

import numpy as np
import pytest

from palpate.errors import UsageError
from palpate.network.radial import HEAD, RADIAL_FUNCTIONS, Q, constants, radial_into
from palpate.network.radial import radial as reference

from .networks import FORMS, any_network, formula, points

every_form = pytest.mark.parametrize("form", FORMS)
every_radial = pytest.mark.parametrize("radial", RADIAL_FUNCTIONS)
with_and_without_basis = pytest.mark.parametrize("modes", [None, 3])


@pytest.mark.grid
@every_form
@every_radial
@with_and_without_basis
@pytest.mark.parametrize(("n", "m"), [(1, 1), (3, 5), (4, 19)])
def test_value_is_the_formula(form, radial, modes, n, m):
    network = any_network(n, m, 13, form=form, radial=radial, modes=modes)
    X = points(network, 20)
    wanted = formula(network, X)
    np.testing.assert_allclose(network.predict(X), wanted, rtol=0, atol=1e-13 * np.abs(wanted).max())


@pytest.mark.grid
@every_form
@every_radial
@with_and_without_basis
@pytest.mark.parametrize(("n", "m"), [(1, 1), (3, 5), (2, 19)])
def test_jacobian_is_the_complex_step(form, radial, modes, n, m):
    network = any_network(n, m, 9, form=form, radial=radial, modes=modes)
    x = points(network, 1)[0]
    step = 1e-30j * np.eye(n)
    wanted = np.stack([formula(network, (x + d)[None])[0].imag / 1e-30 for d in step], axis=1)
    np.testing.assert_allclose(network.jacobian(x), wanted, rtol=0, atol=1e-12 * np.abs(wanted).max())


@every_form
@every_radial
@with_and_without_basis
def test_hessian_is_the_derivative_of_the_jacobian(form, radial, modes):
    network = any_network(3, 1, 9, form=form, radial=radial, modes=modes)
    x = points(network, 1)[0]
    d = 1e-3
    # sixth-order central differences
    taps = ((1, 45.0), (2, -9.0), (3, 1.0))
    columns = [
        sum(c * (network.jacobian(x + k * d * e)[0] - network.jacobian(x - k * d * e)[0]) for k, c in taps)
        / (60 * d)
        for e in np.eye(3)
    ]
    H = network.hessian(x)
    np.testing.assert_allclose(H, np.array(columns), rtol=0, atol=1e-9 * np.abs(H).max())
    np.testing.assert_allclose(H, H.T, rtol=1e-12, atol=1e-13)


@every_form
@every_radial
@with_and_without_basis
def test_one_point_and_a_batch_and_the_value_beside_its_jacobian_give_the_same_bits(form, radial, modes):
    network = any_network(3, 5, 11, form=form, radial=radial, modes=modes)
    X = points(network, 15)
    Y = network.predict(X)
    single, both = network.evaluator(), network.evaluator(jacobian=True)
    for x, y in zip(X, Y, strict=True):
        np.testing.assert_array_equal(single(x), y)
        np.testing.assert_array_equal(both(x), y)
        np.testing.assert_array_equal(both.jacobian, network.jacobian(x))


@every_radial
@with_and_without_basis
@pytest.mark.parametrize("m", [2, 19])
def test_a_unit_of_zero_weight_changes_no_bit_wherever_it_stands(radial, modes, m):
    network = any_network(3, m, 10, form="rotated", radial=radial, modes=modes)
    X = points(network, 10)
    for place in (0, 4, 10):
        more = replace(
            network,
            factors=np.insert(network.factors, place, np.eye(3), axis=0),
            shifts=np.insert(network.shifts, place, 0.3, axis=0),
            weights=np.insert(network.weights, place, 0.0, axis=1),
        )
        np.testing.assert_array_equal(more.predict(X), network.predict(X))
        np.testing.assert_array_equal(more.jacobian(X[0]), network.jacobian(X[0]))


def test_a_rotated_factor_that_is_diagonal_is_the_axis_aligned_one():
    aligned = any_network(3, 2, 8)
    tilted = replace(
        aligned,
        factors=np.concatenate([aligned.factors, np.tri(3)[None]]),
        shifts=np.vstack([aligned.shifts, np.zeros(3)]),
        weights=np.hstack([aligned.weights, np.zeros((2, 1))]),
    )
    assert (aligned.form, tilted.form) == ("axis-aligned", "rotated")
    X = points(aligned, 10)
    np.testing.assert_array_equal(tilted.predict(X), aligned.predict(X))


@every_form
def test_a_form_is_told_from_the_factors(form):
    assert any_network(3, 2, 5, form=form).form == form


def _compiled_radial(name, q, dtype):
    work = np.zeros((HEAD, q.size), dtype)
    work[Q], phi = q, np.zeros(q.size, dtype)
    steps = work.view(np.int64 if dtype == np.float64 else np.int32)
    radial_into(RADIAL_FUNCTIONS.index(name), work, steps, phi, constants(dtype), 1)
    return phi, work[3].copy(), work[4].copy()


@every_radial
@pytest.mark.parametrize(("dtype", "ulp"), [(np.float64, 2.3e-16), (np.float32, 1.2e-7)])
def test_compiled_radial_functions_are_good_to_a_few_last_places(radial, dtype, ulp):
    q = np.concatenate([[0.0], np.geomspace(1e-12, 60, 4001)]).astype(dtype)
    for found, wanted in zip(
        _compiled_radial(radial, q, dtype), reference(radial, q.astype(float)), strict=True
    ):
        # √(5q) is off by half a unit in its last place, which e^−s makes s of them
        np.testing.assert_allclose(found, wanted, rtol=(4 + (18 if radial == "matern-5/2" else 0)) * ulp)


@every_radial
def test_far_away_a_unit_is_silent_and_not_a_number_stays_visible(radial):
    with np.errstate(over="ignore"):
        phi, _, _ = _compiled_radial(radial, np.array([1e4, 1e30, 1e300, np.inf, np.nan]), np.float64)
    assert (phi[:4] <= 0.011).all()
    assert (phi[:4] >= 0).all()
    assert np.isnan(phi[4])


@every_radial
def test_derivatives_by_distance_are_those_of_the_function(radial):
    q, d = np.linspace(0.1, 5, 50), 1e-3
    g = [reference(radial, q + k * d) for k in (-2, -1, 1, 2)]
    for order in (0, 1):
        slope = (g[0][order] - 8 * g[1][order] + 8 * g[2][order] - g[3][order]) / (12 * d)
        np.testing.assert_allclose(reference(radial, q)[order + 1], slope, atol=1e-9)


@every_form
@every_radial
def test_single_precision_is_off_by_what_is_measured_and_by_little(form, radial):
    network = any_network(3, 30, 20, form=form, radial=radial, modes=4)
    X = points(network, 50)
    error = network.precision_error(X)
    evaluator = network.evaluator(precision="single", jacobian=True)
    Y = network.predict(X)
    found = np.array([evaluator(x).copy() for x in X])
    assert found.dtype == np.float32
    np.testing.assert_array_equal(np.abs(found - Y).max(axis=0), error)
    assert 0 < error.max() < 1e-4 * np.abs(Y).max()
    np.testing.assert_allclose(evaluator.jacobian, network.jacobian(X[-1]), atol=1e-3)


def test_single_precision_tells_the_points_of_a_narrow_range_apart():
    network = any_network(1, 1, 5)
    moved = replace(network.scaling, input_centre=np.array([1e6]), input_half=np.array([1e-3]))
    far = replace(network, scaling=moved)
    X = 1e6 + np.linspace(-1e-3, 1e-3, 9)[:, None]
    assert far.precision_error(X)[0] < 1e-5


@every_radial
def test_a_query_allocates_nothing(radial):
    network = any_network(4, 40, 30, form="rotated", radial=radial, modes=5)
    evaluator, x = network.evaluator(jacobian=True), points(network, 1)[0]
    for _ in range(10):
        evaluator(x)
    peaks = []
    for _ in range(
        5
    ):  # a thread that another library keeps allocates now and then: what a query takes it takes always
        tracemalloc.start()
        try:
            before = tracemalloc.get_traced_memory()[0]
            tracemalloc.reset_peak()
            for _ in range(100):
                evaluator(x)
            peaks.append(tracemalloc.get_traced_memory()[1] - before)
        finally:
            tracemalloc.stop()
    assert min(peaks) < 1000  # objects of the call itself; an array of 40 outputs with its header has more


def test_evaluator_takes_lists_and_integers_and_refuses_other_sizes():
    network = any_network(2, 3, 4)
    evaluator = network.evaluator()
    np.testing.assert_array_equal(evaluator([1, 2]), network.predict([[1.0, 2.0]])[0])
    for wrong in (np.zeros(3), np.zeros((1, 2)), np.zeros(0), 1.0):
        with pytest.raises(UsageError, match="can't be evaluated"):
            evaluator(wrong)
    with pytest.raises(UsageError, match="jacobian=True"):
        _ = evaluator.jacobian


def test_derivatives_refuse_what_they_can_not_answer():
    network = any_network(2, 3, 4)
    with pytest.raises(UsageError, match="one output"):
        network.hessian(np.zeros(2))
    for call in (network.jacobian, network.select([0]).hessian):
        with pytest.raises(UsageError, match="can't be evaluated"):
            call(np.zeros(3))
    with pytest.raises(UsageError, match="precision"):
        network.evaluator(precision="half")
    with pytest.raises(UsageError, match="radial function"):
        any_network(2, 3, 4, radial="cubic")


@with_and_without_basis
def test_selected_outputs_are_those_of_the_whole(modes):
    network = any_network(2, 8, 6, modes=modes)
    X = points(network, 7)
    for rows in (slice(2, 4), [0], slice(1, 7)):
        np.testing.assert_allclose(network.select(rows).predict(X), network.predict(X)[:, rows], rtol=1e-12)
        assert network.select(rows).outputs == tuple(np.array(network.outputs, dtype=object)[rows])


def test_a_network_is_a_value():
    weights = np.ones((1, 2))
    network = any_network(2, 1, 2)
    copy = replace(network, weights=weights)
    weights[:] = 7.0
    assert (copy.weights == 1.0).all()
    with pytest.raises(ValueError, match="read-only"):
        network.weights[0, 0] = 3.0
