"""Sums of powers of the principal stretches, without eigenvectors and smooth wherever stretches coincide.

The eigenvalues of C are its mean m plus the roots d of d³ − J₂ d − J₃ = 0, with the invariants J₂, J₃ of its deviator.
Eigenvalues themselves have no derivative where two coincide (every uniaxial state) and the sum Σ f(m + d) does. Three
expressions, each accurate to rounding in its range and all equal where they meet:

* a deviator small beside m (near F = I): the binomial series, whose power sums Σ dᵏ follow from J₂ and J₃ by Newton's
  identities;
* else the root that stands farthest from the others is a simple one, d₁ = ± 2 √(J₂/3) g(w), where g is the root of
  4g³ − 3g = w, w = |J₃|/2 (3/J₂)^(3/2) (Viète), smooth on 0 ≤ w ≤ 1 though the arc cosine that usually gives it is not;
* and the other two, p ± q, enter by q² alone: as a series where q is small beside p, by the root of q² where it isn't.

Intermediate values are used many times: an NGSolve expression of these sums must be compiled before it is evaluated.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from palpate.physics.materials.tensors import (
    Scalar,
    Tensor,
    determinant,
    deviator,
    exp,
    inner,
    log,
    sqrt,
    trace,
    where,
)

__all__ = ["stretch_sums"]

_SMALL_DEVIATOR = 0.05**2  # J₂/m²: eleven powers leave 1e-10 of the second derivative
_SMALL_GAP = 0.06**2  # q²/p²: six terms leave as little
_TERMS = 11  # highest power of the binomial series for small deviators
_PAIRS = 6  # even powers of q/p in the series for a pair of close eigenvalues
# cos(acos(w)/3) on 0 ≤ w ≤ 1 to 5e-6, before two Newton steps that square that error each
_START = (0.86602985, 0.16642902, -0.04600526, 0.01764236, -0.00409941)


def stretch_sums(C: Tensor, exponents: Sequence[float]) -> list[Scalar]:
    """Return Σ λᵢ^a over the three principal stretches, for each real exponent a; λᵢ² are the eigenvalues of C.

    C = FᵀF (..., 3, 3) is symmetric and positive definite.
    """
    m, D = trace(C) / 3, deviator(C)
    J2, J3 = inner(D, D) / 2 / (m * m), determinant(D) / (m * m * m)  # of the deviator of C/m
    small = _SMALL_DEVIATOR - J2
    apart = _roots(where(small, 0.03, J2), where(small, 0.0, J3))  # any regular values where the series holds
    powers = _power_sums(where(small, J2, 0.0), where(small, J3, 0.0))
    size = log(m)
    return [
        exp(a / 2 * size) * where(small, _series(a / 2, powers), _sum_of_roots(a / 2, apart))
        for a in exponents
    ]


def _power_sums(J2: Scalar, J3: Scalar) -> list[Scalar]:
    """Return Σ dᵏ for k = 2 … of the roots of d³ − J₂ d − J₃ = 0."""
    sums = [3.0, 0.0, 2 * J2]
    for k in range(3, _TERMS + 1):
        sums.append(J2 * sums[k - 2] + J3 * sums[k - 3])
    return sums[2:]


def _series(s: float, sums: list[Scalar]) -> Scalar:
    """Return Σ (1 + d)^s by the binomial series."""
    total: Any = 3.0
    for k, value in enumerate(sums, start=2):
        total = total + _binomial(s, k) * value
    return total


def _roots(J2: Scalar, J3: Scalar) -> tuple[Scalar, ...]:
    """Return the eigenvalues of C/m in the form that `_sum_of_roots` takes."""
    r = sqrt(J2 / 3)
    side = where(J3, 1.0, -1.0)
    w = side * J3 / (2 * r * r * r)
    g: Any = _START[-1]
    for coefficient in _START[-2::-1]:
        g = g * w + coefficient
    for _ in range(2):
        g = (8 * g * g * g + w) / (12 * g * g - 3)
    d = 2 * side * r * g
    p = 1 - d / 2
    z = (J2 - 0.75 * d * d) / (p * p)
    close = _SMALL_GAP - z
    q = sqrt(where(close, 0.25, z))
    return log(1 + d), log(p), log(1 + q), log(1 - q), z, close


def _sum_of_roots(s: float, roots: tuple[Scalar, ...]) -> Scalar:
    """Σ x^s over the lone eigenvalue and the pair p(1 ± q), from their logarithms and z = q², small where close > 0."""
    lone, p, above, below, z, close = roots
    series: Any = 0.0
    for k in range(_PAIRS, -1, -1):
        series = series * z + 2 * _binomial(s, 2 * k)
    pair = where(close, series, exp(s * above) + exp(s * below))
    return exp(s * lone) + exp(s * p) * pair


def _binomial(s: float, k: int) -> float:
    value = 1.0
    for i in range(k):
        value *= (s - i) / (i + 1)
    return value
