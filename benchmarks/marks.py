"""Queries of networks of 100 units, and the ratios that are claimed of them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from benchmarks.plain import PlainNetwork
from palpate.network import Network, Scaling
from palpate.network.radial import RadialFunction
from palpate.units import Quantity, Range

__all__ = ["NUMPY", "OURS", "Contenders", "Mark", "marks"]

OURS, NUMPY = "palpate", "NumPy"
SINGLE, VALUE = "palpate, single precision", "palpate, value alone"

Contenders = Mapping[str, Callable[[], Any]]


@dataclass(frozen=True)
class Mark:
    """A query with the ratio that is claimed of it: `measured` over `rival`, at most `bound`."""

    query: str
    contenders: Contenders
    bound: float
    measured: str = OURS
    rival: str = NUMPY

    @property
    def claim(self) -> str:
        """What is claimed, in words."""
        return f"{self.query}, {'palpate' if self.measured == OURS else self.measured} over {self.rival}"


def marks() -> list[Mark]:
    """Queries of 100 units of each form; what they cost does not depend on the units' values."""
    found = [
        Mark(f"100 {form} {radial} units, 6 → 60", _sized(Size(6, 60, form, radial)), 0.5)
        for form, radial in (
            ("axis-aligned", "gaussian"),
            ("rotated", "gaussian"),
            ("rank 1", "gaussian"),
            ("rotated", "inverse-multiquadric"),
            ("rank 1", "matern-5/2"),
        )
    ]
    modes = _sized(Size(6, 3000, "axis-aligned", "gaussian", 25))
    found.append(Mark("100 axis-aligned gaussian units, 6 → 3000 through 25 modes", modes, 0.8))
    for form in ("axis-aligned", "rotated"):
        pair = _value_and_jacobian(Size(3, 3, form, "gaussian"))
        found.append(Mark(f"value and Jacobian, 100 {form} units, 3 → 3", pair, 2.0, rival=VALUE))
    return found


@dataclass(frozen=True)
class Size:
    """Inputs, outputs, form, radial function and modes of a network of 100 units."""

    n: int
    m: int
    form: str
    radial: RadialFunction
    modes: int | None = None

    def network(self) -> Network:
        """Random units spread over the inputs' ranges."""
        rng = np.random.default_rng(0)
        h, n, m, k = 100, self.n, self.m, self.modes or self.m
        r = 1 if self.form == "rank 1" else n
        factors = rng.normal(size=(h, r, n)) / 2
        if r == n:
            factors = np.tril(factors) + np.eye(n) if self.form == "rotated" else factors * np.eye(n)
        return Network(
            inputs=tuple(Range(f"x{i}", -1.0, 3.0) for i in range(n)),
            outputs=tuple(Quantity(f"y{i}") for i in range(m)),
            factors=factors,
            shifts=rng.normal(size=(h, r)),
            weights=rng.normal(size=(k, h)),
            tail=rng.normal(size=(k, 1 + n)),
            scaling=Scaling(np.ones(n), np.full(n, 2.0), rng.normal(size=m), np.ones(m)),
            radial=self.radial,
            basis=rng.normal(size=(m, k)) if self.modes else None,
        )


def _sized(size: Size) -> Contenders:
    network = size.network()
    double, single = network.evaluator(), network.evaluator(precision="single")
    plain, x = PlainNetwork(network), np.linspace(-0.5, 2.5, size.n)
    np.testing.assert_allclose(plain(x), double(x), rtol=0, atol=1e-11)
    return {OURS: lambda: double(x), SINGLE: lambda: single(x), NUMPY: lambda: plain(x)}


def _value_and_jacobian(size: Size) -> Contenders:
    network = size.network()
    both, value = network.evaluator(jacobian=True), network.evaluator()
    plain, x = PlainNetwork(network), np.linspace(-0.5, 2.5, size.n)
    both(x)
    np.testing.assert_allclose(plain.value_and_jacobian(x)[1], both.jacobian, rtol=0, atol=1e-11)
    return {OURS: lambda: both(x), VALUE: lambda: value(x), NUMPY: lambda: plain.value_and_jacobian(x)}
