"""One pass for value, slope and curvature agrees with the three that there were."""

from __future__ import annotations

import numpy as np
import pytest

from palpate.errors import UsageError
from palpate.network import Network, Scaling
from palpate.network.network_kernels import gram, regressors_into, second_order_into
from palpate.network.radial import RADIAL_FUNCTIONS
from palpate.units import Quantity, Range

n = 4


def made(radial="gaussian", units=9, rank=n, pattern="lower", outputs=1) -> Network:
    rng = np.random.default_rng(2)
    factors = rng.normal(size=(units, rank, n))
    if pattern == "lower":
        factors = np.tril(factors)
    elif pattern == "diagonal":
        factors = factors * np.eye(rank, n)
    scaling = Scaling(
        rng.normal(size=n), rng.uniform(0.5, 2, n), np.full(outputs, 3.0), np.full(outputs, 1.7)
    )
    return Network(
        inputs=tuple(Range(f"x{i}", -1.0, 1.0) for i in range(n)),
        outputs=tuple(Quantity(f"y{j}") for j in range(outputs)),
        factors=factors,
        shifts=rng.normal(size=(units, rank)),
        weights=rng.normal(size=(outputs, units)),
        tail=rng.normal(size=(outputs, 1 + n)),
        scaling=scaling,
        radial=radial,
    )


@pytest.mark.parametrize("radial", RADIAL_FUNCTIONS)
@pytest.mark.parametrize(("rank", "pattern"), [(n, "lower"), (n, "diagonal"), (n, "full"), (1, "full")])
@pytest.mark.parametrize("q", [1, 3, n])
def test_it_is_what_value_jacobian_and_hessian_say(radial, rank, pattern, q):
    network = made(radial, rank=rank, pattern=pattern)
    g, H = np.empty(q), np.empty((q, q))
    for x in np.random.default_rng(5).uniform(-1, 1, (10, n)):
        value = second_order_into(x, g, H, gram(network, q), *network.compiled())
        assert value == network.predict(x[None])[0, 0]
        np.testing.assert_allclose(g, network.jacobian(x)[0, :q], rtol=1e-12, atol=1e-13)
        np.testing.assert_allclose(H, network.hessian(x)[:q, :q], rtol=1e-12, atol=1e-12)
        np.testing.assert_array_equal(H, H.T)


def test_without_units_there_is_no_curvature():
    network = made(units=0)
    g, H = np.empty(3), np.full((3, 3), 9.0)
    second_order_into(np.zeros(n), g, H, gram(network, 3), *network.compiled())
    np.testing.assert_array_equal(H, 0.0)
    np.testing.assert_allclose(g, network.jacobian(np.zeros(n))[0, :3], rtol=1e-14)


def test_regressors_times_weights_are_the_network_and_its_slopes():
    network = made()
    x, compiled = np.full(n, 0.3), network.compiled()
    line = regressors_into(x, *compiled)
    rows = compiled[0][line : line + 1 + n]
    row = np.concatenate([network.tail[0], network.weights[0]]) * network.scaling.output_scale[0]
    np.testing.assert_allclose(
        rows[0] @ row + network.scaling.output_centre[0], network.predict(x[None])[0, 0]
    )
    np.testing.assert_allclose(rows[1:] @ row, network.jacobian(x)[0], rtol=1e-12)


@pytest.mark.parametrize(("network", "q"), [(made(outputs=2), 3), (made(), 5), (made(), 0)])
def test_curvature_that_is_not_to_be_had_is_refused(network, q):
    with pytest.raises(UsageError, match=r"[Cc]urvature"):
        gram(network, q)
