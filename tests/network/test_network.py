"""Evaluation: compiled against plain NumPy, Jacobian against complex step, scaling."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from models import linear_network
from palpate.errors import UsageError
from palpate.network import Network, Scaling
from palpate.units import Quantity, Range

from .networks import any_network


def random_network(n: int, m: int, h: int, seed: int = 0) -> Network:
    rng = np.random.default_rng(seed)
    low = rng.normal(size=n)
    inputs = [Range(f"x{i}", float(a), float(a) + 2.0, "N") for i, a in enumerate(low)]
    scaling = Scaling(low + 1.0, np.ones(n), rng.normal(size=m), rng.uniform(0.5, 2, m))
    return Network.axis_aligned(
        inputs,
        [Quantity(f"y{i}", "m") for i in range(m)],
        centres=rng.uniform(-1, 1, (h, n)),
        widths=rng.uniform(0.3, 2, (h, n)),
        weights=rng.normal(size=(m, h)),
        tail=rng.normal(size=(m, 1 + n)),
        scaling=scaling,
    )


def plain(network: Network, X: np.ndarray) -> np.ndarray:
    """The formula of the docstring, in NumPy; takes complex inputs."""
    s = network.scaling
    xi = (X - s.input_centre) / s.input_half
    v = np.einsum("krn,Nn->Nkr", network.factors, xi) - network.shifts
    phi = np.exp(-(v * v).sum(axis=2))
    eta = np.hstack([np.ones((len(X), 1)), xi]) @ network.tail.T + phi @ network.weights.T
    return s.output_centre + s.output_scale * eta


@pytest.mark.parametrize(("n", "m", "h"), [(1, 5, 6), (3, 4, 10), (2, 1, 0), (6, 60, 100)])
def test_compiled_evaluation_equals_the_formula(n, m, h):
    network = random_network(n, m, h)
    X = np.random.default_rng(1).normal(size=(20, n))
    np.testing.assert_allclose(network.predict(X), plain(network, X), rtol=1e-11, atol=1e-11)


@pytest.mark.parametrize(("n", "m", "h"), [(1, 5, 6), (3, 4, 10)])
def test_evaluator_equals_predict_to_the_bit(n, m, h):
    network = random_network(n, m, h)
    X = np.random.default_rng(2).normal(size=(20, n))
    evaluator = network.evaluator()
    np.testing.assert_array_equal(np.array([evaluator(x).copy() for x in X]), network.predict(X))


def test_jacobian_equals_complex_step():
    network = random_network(3, 4, 8)
    x = np.array([0.3, -0.1, 0.5])
    columns = [plain(network, (x + 1e-30j * np.eye(3)[i])[None])[0].imag / 1e-30 for i in range(3)]
    np.testing.assert_allclose(network.jacobian(x), np.array(columns).T, rtol=1e-10, atol=1e-13)


def test_axis_aligned_factors_give_centres_and_widths_back():
    network = random_network(2, 1, 5)
    rng = np.random.default_rng(0)
    rng.normal(size=2), rng.normal(size=1), rng.uniform(0.5, 2, 1)
    np.testing.assert_allclose(network.centres, rng.uniform(-1, 1, (5, 2)), rtol=1e-12)


def test_scaling_puts_the_declared_range_on_minus_one_to_one():
    s = Scaling.of([Range("x", 2.0, 6.0, "N")], np.array([[1.0], [3.0], [8.0]]))
    np.testing.assert_allclose(s.scale_inputs(np.array([[2.0], [4.0], [6.0]])), [[-1], [0], [1]])
    np.testing.assert_allclose(s.scale_outputs(np.array([[4.0], [8.0]])), [[0], [1]])


def test_constant_outputs_scale_by_one():
    s = Scaling.of([Range("x", 0.0, 1.0)], np.full((4, 2), 3.0))
    np.testing.assert_array_equal(s.output_scale, 1.0)


def test_wrong_number_of_columns_is_refused():
    with pytest.raises(UsageError, match="takes 3 inputs"):
        random_network(3, 2, 4).predict(np.zeros((5, 2)))


def test_parts_that_do_not_fit_are_refused():
    good = linear_network([Range("x", 0, 1)], [Quantity("y")], np.zeros((1, 2)))
    with pytest.raises(UsageError, match="tail"):
        Network(
            good.inputs, good.outputs, good.factors, good.shifts, good.weights, np.zeros((1, 3)), good.scaling
        )


def test_printing_says_what_it_is():
    assert str(random_network(2, 5, 6)).endswith("5 outputs, 6 units (axis-aligned, gaussian)")
    text = str(any_network(3, 50, 7, form="rank 1", radial="matern-5/2", modes=4))
    assert text.endswith("50 outputs through 4 modes, 7 units (rank 1, matern-5/2)")


@pytest.mark.parametrize("value", [np.nan, np.inf])
@pytest.mark.parametrize("part", ["factors", "shifts", "weights", "tail", "basis"])
def test_numbers_that_are_none_make_no_network(part, value):
    network = any_network(2, 5, 3, modes=2)
    bad = np.array(getattr(network, part))
    bad.flat[-1] = value
    with pytest.raises(UsageError, match=f"its {part}") as caught:
        replace(network, **{part: bad})
    assert caught.value.why
    assert caught.value.fix


@pytest.mark.parametrize("value", [np.nan, 0.0, -1.0])
@pytest.mark.parametrize("part", ["input_half", "output_scale"])
def test_scales_of_nothing_make_no_network(part, value):
    network = any_network(2, 3, 3)
    bad = np.array(getattr(network.scaling, part))
    bad[-1] = value
    with pytest.raises(UsageError, match=r"finite|positive"):
        replace(network, scaling=replace(network.scaling, **{part: bad}))


@pytest.mark.parametrize(
    "widths", [np.zeros((4, 2)), -np.ones((4, 2)), np.full((4, 2), np.nan), np.ones((4, 1))]
)
def test_widths_of_nothing_make_no_gaussians(widths):
    network = any_network(2, 3, 4)
    with pytest.raises(UsageError, match="widths"):
        Network.axis_aligned(
            *(network.inputs, network.outputs),
            centres=np.zeros((4, 2)),
            widths=widths,
            weights=network.weights,
            tail=network.tail,
            scaling=network.scaling,
        )


@pytest.mark.parametrize("modes", [None, 2])
def test_outputs_that_there_are_not_are_not_selected(modes):
    network = any_network(2, 4, 3, modes=modes)
    for bad in ([5], [-5], [0, 4]):
        with pytest.raises(UsageError, match="There are no outputs"):
            network.select(bad)
    for none in ([], slice(9, 12)):
        with pytest.raises(UsageError, match="No output"):
            network.select(none)
    X = np.zeros((1, 2))
    np.testing.assert_allclose(network.select([-1]).predict(X), network.predict(X)[:, 3:], rtol=1e-12)
