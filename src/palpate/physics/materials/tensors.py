"""Tensor functions that read a finite element's coefficient function and a NumPy array alike.

A law is written once with these functions. In NumPy a scalar has shape (...) and a second-order tensor (..., 3, 3),
real or complex; in NGSolve both are coefficient functions. Python's ``+``, ``-``, ``*``, ``/`` work between scalars,
and ``+``, ``-`` between tensors; everything else has its function here, because the two worlds write it differently.

Derivatives: NGSolve differentiates the expression itself; in NumPy `gradient` takes a complex step (Squire & Trapp
1998, SIAM Review 40, 110-112), exact to rounding. A law must therefore stay analytic: no ``abs``, no ``max``, no
comparison of tensor values in Python; `where` and `positive_part` choose between branches by the real part.

NGSolve expressions that use an intermediate value several times are trees until they are compiled: compile the whole
energy (``energy.Compile()``), not a part of it, since a compiled part inside a variation loses its derivative.
`compile_values` compiles expressions that are read and no longer differentiated.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping, Sequence
from typing import Any, TypeAlias

import numpy as np

__all__ = [
    "Scalar",
    "Tensor",
    "cofactor",
    "compile_values",
    "constant",
    "determinant",
    "deviator",
    "dot",
    "exp",
    "gradient",
    "identity",
    "inner",
    "inverse",
    "is_symbolic",
    "isochoric_first",
    "isochoric_second",
    "log",
    "matmul",
    "outer",
    "positive_part",
    "power",
    "scale",
    "second_gradient",
    "sqrt",
    "sym",
    "trace",
    "transform",
    "transpose",
    "where",
]

Scalar: TypeAlias = Any
"""A number, a NumPy array of shape (...), or a scalar coefficient function."""

Tensor: TypeAlias = Any
"""A NumPy array of shape (..., 3, 3), or a 3 × 3 coefficient function."""

_DIFFERENCE = 5e-4  # of second derivatives: remainder and rounding are both near 1e-12
_STEP = 1e-40  # of the complex step: its square vanishes beside 1 in double precision


def is_symbolic(*values: Any) -> bool:
    """Return whether any of the values is a coefficient function of NGSolve."""
    ngsolve = sys.modules.get("ngsolve")  # nothing can be one of its objects before it is imported
    return ngsolve is not None and any(isinstance(v, ngsolve.CoefficientFunction) for v in values)


def identity(like: Tensor) -> Tensor:
    """Return the unit tensor, of the kind of `like`."""
    if is_symbolic(like):
        import ngsolve

        return ngsolve.Id(3)
    return np.eye(3)


def constant(values: Sequence[Any] | np.ndarray, like: Any) -> Any:
    """Return a constant vector (3,) or tensor (3, 3), of the kind of `like`."""
    array = np.asarray(values, dtype=float)
    if is_symbolic(like):
        import ngsolve

        return ngsolve.CF(tuple(array.ravel().tolist()), dims=array.shape)
    return array


def trace(a: Tensor) -> Scalar:
    """Return the sum A₁₁ + A₂₂ + A₃₃."""
    return a[0, 0] + a[1, 1] + a[2, 2] if is_symbolic(a) else a[..., 0, 0] + a[..., 1, 1] + a[..., 2, 2]


def transpose(a: Tensor) -> Tensor:
    """Return Aᵀ."""
    return a.trans if is_symbolic(a) else np.swapaxes(a, -1, -2)


def matmul(a: Tensor, b: Tensor) -> Tensor:
    """Return the product A B."""
    return a * b if is_symbolic(a, b) else a @ b


def transform(a: Tensor, v: Any) -> Any:
    """Return the vector A v; v has shape (..., 3)."""
    return a * v if is_symbolic(a, v) else np.einsum("...ij,...j->...i", a, v)


def dot(v: Any, w: Any) -> Scalar:
    """Return v · w of two vectors (..., 3)."""
    if is_symbolic(v, w):
        import ngsolve

        return ngsolve.InnerProduct(v, w)
    return np.einsum("...i,...i->...", v, w)


def outer(v: Any, w: Any) -> Tensor:
    """Return v ⊗ w of two vectors (..., 3)."""
    if is_symbolic(v, w):
        import ngsolve

        return ngsolve.OuterProduct(v, w)
    return np.einsum("...i,...j->...ij", v, w)


def inner(a: Tensor, b: Tensor) -> Scalar:
    """Return the full contraction A : B = Σ A_ij B_ij."""
    if is_symbolic(a, b):
        import ngsolve

        return ngsolve.InnerProduct(a, b)
    return np.einsum("...ij,...ij->...", a, b)


def scale(factor: Scalar, a: Tensor) -> Tensor:
    """Return the tensor factor · A, where the factor has one value per tensor."""
    return factor * a if is_symbolic(factor, a) else np.asarray(factor)[..., None, None] * a


def sym(a: Tensor) -> Tensor:
    """Return the symmetric part ½(A + Aᵀ)."""
    return 0.5 * (a + transpose(a))


def deviator(a: Tensor) -> Tensor:
    """Return A − ⅓ tr(A) I."""
    return a - scale(trace(a) / 3, identity(a))


def determinant(a: Tensor) -> Scalar:
    """Return the determinant of A."""
    if is_symbolic(a):
        import ngsolve

        return ngsolve.Det(a)
    # written out: a factorisation would lose the complex step
    return np.einsum("...j,...j->...", a[..., 0, :], cofactor(a)[..., 0, :])


def cofactor(a: Tensor) -> Tensor:
    """Return the cofactor det(A) A⁻ᵀ, also of a singular A."""
    if is_symbolic(a):
        import ngsolve

        return ngsolve.Cof(a)
    rows = [np.cross(a[..., (i + 1) % 3, :], a[..., (i + 2) % 3, :]) for i in range(3)]
    return np.stack(rows, axis=-2)


def inverse(a: Tensor) -> Tensor:
    """Return A⁻¹."""
    if is_symbolic(a):
        import ngsolve

        return ngsolve.Inv(a)
    return scale(1 / determinant(a), transpose(cofactor(a)))


def isochoric_first(F: Tensor) -> Scalar:
    """Return Ī₁ = J^(−2/3) tr FᵀF."""
    return power(determinant(F), -2 / 3) * inner(F, F)


def isochoric_second(F: Tensor) -> Scalar:
    """Return Ī₂ = J^(−4/3) I₂, with I₂ = cof F : cof F."""
    H = cofactor(F)
    return power(determinant(F), -4 / 3) * inner(H, H)


def log(x: Scalar) -> Scalar:
    """Return the natural logarithm; NaN where a real x is negative."""
    return _function("log", x)


def exp(x: Scalar) -> Scalar:
    """Return the exponential."""
    return _function("exp", x)


def sqrt(x: Scalar) -> Scalar:
    """Return the square root; NaN where a real x is negative."""
    return _function("sqrt", x)


def power(x: Scalar, exponent: float) -> Scalar:
    """Return x raised to a constant power, for x > 0."""
    if is_symbolic(x):
        return x**exponent
    with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
        return np.asarray(x) ** exponent


def where(condition: Scalar, positive: Scalar, otherwise: Scalar) -> Scalar:
    """Return `positive` where condition > 0, else `otherwise`; a complex condition counts by its real part."""
    if is_symbolic(condition, positive, otherwise):
        import ngsolve

        return ngsolve.IfPos(condition, positive, otherwise)
    return np.where(np.real(condition) > 0, positive, otherwise)


def positive_part(x: Scalar) -> Scalar:
    """Return ⟨x⟩: x where it is positive, else 0."""
    return where(x, x, 0.0)


def gradient(function: Callable[[Tensor], Scalar], at: Tensor) -> Tensor:
    """Return ∂function/∂A at `at`, a tensor (..., 3, 3) of the derivatives with respect to A_ij.

    The function takes a tensor to a scalar and is written with the functions of this module.
    """
    if is_symbolic(at):
        variable = at.MakeVariable()
        return function(variable).Diff(variable)
    at = np.asarray(at, dtype=float)
    # the nine steps ride on one more leading axis: one call of the function
    stepped = at + 1j * _STEP * np.eye(9).reshape(9, *(1,) * (at.ndim - 2), 3, 3)
    slopes = np.imag(np.broadcast_to(function(stepped), stepped.shape[:-2])) / _STEP
    return np.moveaxis(slopes, 0, -1).reshape(at.shape)


def second_gradient(function: Callable[[Tensor], Scalar], at: np.ndarray) -> np.ndarray:
    """∂²function/∂A∂A at NumPy tensors, (..., 3, 3, 3, 3): fourth-order differences of the complex-step gradient.

    The remainder is about 1e-11 of the function's curvature where it is smooth on the scale of 1e-3.
    """
    at = np.asarray(at, dtype=float)
    directions = np.eye(9).reshape(9, *(1,) * (at.ndim - 2), 3, 3)
    total = np.zeros((9, *at.shape))
    for steps, weight in ((1, 8 / 12), (2, -1 / 12)):
        move = steps * _DIFFERENCE * directions
        total += weight / _DIFFERENCE * (gradient(function, at + move) - gradient(function, at - move))
    return np.moveaxis(total, 0, -1).reshape(*at.shape, 3, 3)


def _function(name: str, x: Scalar) -> Scalar:
    if is_symbolic(x):
        import ngsolve

        return getattr(ngsolve, name)(x)
    with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
        return getattr(np, name)(x)


def compile_values(values: Mapping[str, Any]) -> dict[str, Any]:
    """Return the values with NGSolve's expressions compiled, so that shared parts are evaluated once.

    A return mapping uses each Newton step's answer three times: uncompiled, its cost triples with every step.
    """
    return {name: value.Compile() if is_symbolic(value) else value for name, value in values.items()}
