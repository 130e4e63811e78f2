"""Energy that the springs of a Prony series store, and what its dashpots turn into heat.

A term is a spring and a dashpot in series (Maxwell). Its spring is taken as linear, with the base law's initial
moduli: at an overstress H it stores dev H : dev H/(4G) + (tr H)²/(18K), and the dashpot's power is twice that over τ.
Over a step of x = Δ/τ in which the term's share of the instantaneous stress grows evenly by J, the loss integrates to

    q(J, J) 2 g(x) + q(H, J) 2 (1 − e⁻ˣ)²/x + q(H, H) (1 − e⁻²ˣ),     g = (x − 2(1 − e⁻ˣ) + ½(1 − e⁻²ˣ))/x²,

with q the stored energy as a bilinear form and H the overstress at the beginning. All of it is exact for linear laws.
"""

from __future__ import annotations

import math

import numpy as np

from palpate.physics.materials.tensors import Scalar, Tensor, deviator, inner, trace

__all__ = ["dashpot_loss", "spring_energy"]


def spring_energy(overstress: Tensor, shear: float, bulk: float) -> Scalar:
    """Energy in J/m³ of a spring of moduli G and K (Pa) at an overstress (..., 3, 3) in Pa.

    A bulk modulus of 0 is a law without volumetric stress: then the trace, which large strain brings, counts nothing.
    """
    return _form(overstress, overstress, shear, bulk)


def dashpot_loss(overstress: Tensor, growth: Tensor, ratio: float, shear: float, bulk: float) -> Scalar:
    """Heat in J/m³ of one term over a step.

    Parameters
    ----------
    overstress, growth : (..., 3, 3)
        H at the beginning of the step and J, the growth of the term's share of the instantaneous stress, in Pa.
    ratio : float
        Step over relaxation time.
    shear, bulk : float
        The spring's moduli in Pa.
    """
    decay = -math.expm1(-ratio)
    own = _form(overstress, overstress, shear, bulk) * -math.expm1(-2 * ratio)
    if ratio == 0:
        return own
    cross = _form(overstress, growth, shear, bulk) * 2 * decay**2 / ratio
    return own + cross + _form(growth, growth, shear, bulk) * 2 * _ramp(ratio)


def _form(a: Tensor, b: Tensor, shear: float, bulk: float) -> Scalar:
    shape = inner(deviator(a), deviator(b)) / (4 * shear)
    return shape + trace(a) * trace(b) / (18 * bulk) if bulk > 0 else shape


def _ramp(x: float) -> float:
    """g(x), which is x/3 for small x and 1/x for large x."""
    if x > 0.1:
        return (1 + (2 * math.expm1(-x) - 0.5 * math.expm1(-2 * x)) / x) / x
    # the difference loses digits: its power series, ordered by n from 3
    orders = np.arange(3, 14)
    signs = np.where(orders % 2, 1.0, -1.0)
    factorials = np.array([math.factorial(n) for n in orders], dtype=float)
    return float(np.sum(signs * (2.0 ** (orders - 1) - 2) * x ** (orders - 2.0) / factorials))
