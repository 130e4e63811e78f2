"""Radial functions g(q) of q = ‖A x − b‖², with their first three derivatives by q.

gaussian               exp(−q), the founding form (Platt 1991; papers that write exp(−q/2) have widths √2 smaller)
inverse-multiquadric   (1 + q)^−½ (Hardy 1971): decays slowly, so fewer units reach across the range
matern-5/2             (1 + s + s²/3) e^−s with s = √(5 q) (Stein 1999): twice differentiable at its centre

`radial_into` is compiled and runs along all units of one point at a time. exp(−t) is computed here and not by the
system's library: written along an array it runs several units per instruction, and it gives the same bits
everywhere. t log₂e is rounded to a whole number s, exp(−t) = 2⁻ˢ exp(u) with |u| ≤ ½ ln 2 reduced in two pieces of
ln 2 (Cody & Waite 1980), and exp(u) is its Taylor polynomial of degree 13, whose remainder is 4e-18. Results smaller
than exp(−`LIMIT`) count as that.

Rows of `work`, of which the first h columns are used, with `steps` the same memory as integers:

    Q       squared distance q of each unit
    T, P    scratch of the exponential
    D1, D2  dg/dq and d²g/dq²
    HEAD …  A ξ − b, one row for each of the factor's
"""

from __future__ import annotations

import math
from typing import Any, Literal, get_args

import numpy as np

from palpate.kernels import part

__all__ = [
    "D1",
    "D2",
    "HEAD",
    "RADIAL_FUNCTIONS",
    "Q",
    "RadialFunction",
    "constants",
    "radial",
    "radial_into",
    "third",
]

RadialFunction = Literal["gaussian", "inverse-multiquadric", "matern-5/2"]
RADIAL_FUNCTIONS: tuple[RadialFunction, ...] = get_args(RadialFunction)


def radial(name: RadialFunction, q: Any, exp: Any = np.exp, sqrt: Any = np.sqrt) -> tuple[Any, Any, Any]:
    """g, dg/dq and d²g/dq² at squared distances q ≥ 0 of any shape; all finite at q = 0.

    Arrays, or values of a graph with its own `exp` and `sqrt`.
    """
    if name == "gaussian":
        g = exp(-q)
        return g, -g, g
    if name == "inverse-multiquadric":
        u = 1.0 / (1.0 + q)
        g = sqrt(u)
        return g, -0.5 * g * u, 0.75 * g * u * u
    s = sqrt(5.0 * q)
    e = exp(-s)
    return (1.0 + s + s * s / 3.0) * e, (-5.0 / 6.0) * (1.0 + s) * e, (25.0 / 12.0) * e


def third(name: RadialFunction, q: np.ndarray) -> np.ndarray:
    """d³g/dq³ at squared distances q ≥ 0 of any shape.

    That of matern-5/2 grows like q^−½ towards q = 0, where it counts as zero: in a derivative by place it comes
    with three factors of A x − b, whose product vanishes faster.
    """
    if name == "gaussian":
        return np.asarray(-np.exp(-q))
    if name == "inverse-multiquadric":
        u = 1.0 / (1.0 + q)
        return np.asarray(-1.875 * np.sqrt(u) * u * u * u)
    s = np.sqrt(5.0 * q)
    at_centre = q == 0
    return np.asarray(np.where(at_centre, 0.0, (-125.0 / 24.0) * np.exp(-s) / np.where(at_centre, 1.0, s)))


Q, T, P, D1, D2, HEAD = 0, 1, 2, 3, 4, 5
DEGREE = 13  # degree of the Taylor polynomial of the exponential
_GAUSSIAN, _MULTIQUADRIC = 0, 1  # places in RADIAL_FUNCTIONS


def constants(dtype: type[np.floating]) -> np.ndarray:
    """Numbers that the kernels need in their own precision, so that nothing is promoted to another.

    1/0! … 1/13!; then log₂e, the two pieces of ln 2, the rounding constant and the largest exponent; then the
    Matérn function's 5, 1/3, −5/6 and 25/12.
    """
    bits = np.finfo(dtype).nmant
    # the leading piece has trailing zeros enough for its product with s to be exact
    high = math.ldexp(math.floor(math.ldexp(math.log(2.0), bits - 11)), 11 - bits)
    limit = 700.0 if bits > 23 else 80.0
    low = _LN2_TAIL + (math.log(2.0) - high)
    taylor = [1.0 / math.factorial(k) for k in range(DEGREE + 1)]
    reduction = [1.0 / math.log(2.0), high, low, 1.5 * 2.0**bits, limit]
    return np.array([*taylor, *reduction, 5.0, 1.0 / 3.0, -5.0 / 6.0, 25.0 / 12.0, -0.5, 0.75], dtype=dtype)


_LN2_TAIL = 2.3190468138462996e-17  # ln 2 minus its nearest double


@part
def _exponential(h, work, steps, c) -> None:
    """work[P] = exp(−work[T]) for work[T] ≥ 0; T is lost."""
    c2, c3, c4, c5, c6, c7, c8, c9 = c[2], c[3], c[4], c[5], c[6], c[7], c[8], c[9]
    c10, c11, c12, c13, one = c[10], c[11], c[12], c[13], c[0]
    log2e, high, low, magic, limit = c[14], c[15], c[16], c[17], c[18]
    for k in range(h):
        t = work[T, k]
        t = limit if t > limit else t  # not-a-number stays what it is
        whole = magic - t * log2e
        s = whole - magic
        u = (-t - s * high) - s * low
        p = c12 + u * c13
        p = c11 + u * p
        p = c10 + u * p
        p = c9 + u * p
        p = c8 + u * p
        p = c7 + u * p
        p = c6 + u * p
        p = c5 + u * p
        p = c4 + u * p
        p = c3 + u * p
        p = c2 + u * p
        p = one + u * p
        work[P, k] = one + u * p
        work[T, k] = whole
    shift = 52 if steps.itemsize == 8 else 23
    for k in range(h):
        # the last bits of `whole` are s; added to the exponent they multiply by 2^s
        steps[P, k] += steps[T, k] << shift


@part
def _gaussian(h, work, steps, phi, c, order) -> None:
    for k in range(h):
        work[T, k] = work[Q, k]
    _exponential(h, work, steps, c)
    for k in range(h):
        phi[k] = work[P, k]
    if order > 0:
        for k in range(h):
            work[D1, k] = -work[P, k]
            work[D2, k] = work[P, k]


@part
def _multiquadric(h, work, phi, c, order) -> None:
    one, first, second = c[0], c[23], c[24]
    for k in range(h):
        work[T, k] = one / (one + work[Q, k])
    for k in range(h):
        phi[k] = math.sqrt(work[T, k])
    if order > 0:
        for k in range(h):
            work[D1, k] = first * phi[k] * work[T, k]
            work[D2, k] = second * phi[k] * work[T, k] * work[T, k]


@part
def _matern(h, work, steps, phi, c, order) -> None:
    one, limit, five, third, first, second = c[0], c[18], c[19], c[20], c[21], c[22]
    for k in range(h):
        s = math.sqrt(five * work[Q, k])
        s = limit if s > limit else s
        work[T, k] = s
        work[Q, k] = s
    _exponential(h, work, steps, c)
    for k in range(h):
        s = work[Q, k]
        phi[k] = (one + s + s * s * third) * work[P, k]
    if order > 0:
        for k in range(h):
            work[D1, k] = first * (one + work[Q, k]) * work[P, k]
            work[D2, k] = second * work[P, k]


@part
def radial_into(code, work, steps, phi, c, order) -> None:
    """phi (h,) = g(work[Q]); its derivatives into work[D1] and work[D2] if order > 0; work[Q] is lost."""
    if code == _GAUSSIAN:
        _gaussian(phi.size, work, steps, phi, c, order)
    elif code == _MULTIQUADRIC:
        _multiquadric(phi.size, work, phi, c, order)
    else:
        _matern(phi.size, work, steps, phi, c, order)
