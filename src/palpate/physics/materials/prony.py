"""A Prony series: how a stress relaxes at a constant strain, what its springs store and its dashpots lose.

The share of the instantaneous modulus that is left at time t is g(t) = γ_∞ + Σ γ_i exp(−t/τ_i), with γ_∞ + Σ γ_i = 1.
Under a sinusoidal strain of angular frequency ω it has the storage and loss shares (Ferry 1980, Viscoelastic Properties
of Polymers, 3rd ed., ch. 3)

    g'(ω) = γ_∞ + Σ γ_i ω²τ_i²/(1 + ω²τ_i²)        g''(ω) = Σ γ_i ωτ_i/(1 + ω²τ_i²)

A term is a spring and a dashpot in series (Maxwell). Its spring is taken as linear, with the base law's initial
moduli: at an overstress H it stores dev H : dev H/(4G) + (tr H)²/(18K), and the dashpot's power is twice that over τ.
Over a step of x = Δ/τ in which the term's share of the instantaneous stress grows evenly by J, the loss integrates to

    q(J, J) 2 g(x) + q(H, J) 2 (1 − e⁻ˣ)²/x + q(H, H) (1 − e⁻²ˣ),     g = (x − 2(1 − e⁻ˣ) + ½(1 − e⁻²ˣ))/x²,

with q the stored energy as a bilinear form and H the overstress at the beginning. All of it is exact for linear laws.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from palpate import checks
from palpate.errors import UsageError
from palpate.physics.materials.tensors import Scalar, Tensor, deviator, exp, inner, is_symbolic, trace, where

__all__ = ["PronySeries", "dashpot_loss", "mean_decay", "spring_energy"]


@dataclass(frozen=True)
class PronySeries:
    """Shares and relaxation times.

    Attributes
    ----------
    terms : tuple of (float, float)
        (γ_i, τ_i): share of the instantaneous modulus that relaxes, in (0, 1], and relaxation time in s, positive.

    Raises
    ------
    UsageError
        For a share or time that is not positive, or shares that sum to more than 1.
    """

    terms: tuple[tuple[float, float], ...]

    def __post_init__(self) -> None:
        object.__setattr__(self, "terms", tuple(_pair(term) for term in self.terms))
        for share, time in self.terms:
            checks.positive("A Prony share", share, "")
            checks.positive("A relaxation time", time, "s")
        if math.fsum(self.shares) > 1 + 1e-12:
            raise UsageError(
                f"The Prony shares sum to {math.fsum(self.shares):g}.",
                why="They are shares of the instantaneous modulus; above 1 the equilibrium modulus is negative.",
                fix="Divide each modulus by the instantaneous one, G_∞ + ΣG_i: PronySeries.of_moduli does it.",
            )

    @classmethod
    def of_moduli(cls, equilibrium: float, branches: Sequence[tuple[float, float]]) -> PronySeries:
        """Series of an equilibrium modulus (Pa) and of branches (modulus in Pa, relaxation time in s)."""
        whole = equilibrium + math.fsum(modulus for modulus, _ in branches)
        return cls(tuple((modulus / whole, time) for modulus, time in branches))

    @property
    def shares(self) -> tuple[float, ...]:
        """γ_i, pure numbers."""
        return tuple(share for share, _ in self.terms)

    @property
    def times(self) -> tuple[float, ...]:
        """τ_i in s."""
        return tuple(time for _, time in self.terms)

    @property
    def equilibrium(self) -> float:
        """γ_∞, the share that never relaxes."""
        return max(0.0, 1 - math.fsum(self.shares))

    def __str__(self) -> str:
        return "relaxes by " + " and ".join(f"{share:.4g} in {time:.4g} s" for share, time in self.terms)

    def relaxation(self, time: Any) -> Any:
        """g(t) for times in s of any shape."""
        time = np.asarray(time, dtype=float)
        return self.equilibrium + sum(share * np.exp(-time / tau) for share, tau in self.terms)

    def storage(self, frequency: Any) -> Any:
        """g'(ω) for angular frequencies in rad/s of any shape."""
        ratio = [np.square(np.asarray(frequency, dtype=float) * tau) for tau in self.times]
        return self.equilibrium + sum(g * r / (1 + r) for g, r in zip(self.shares, ratio, strict=True))

    def loss(self, frequency: Any) -> Any:
        """g''(ω) for angular frequencies in rad/s of any shape."""
        ratio = [np.asarray(frequency, dtype=float) * tau for tau in self.times]
        return sum(
            (g * r / (1 + r * r) for g, r in zip(self.shares, ratio, strict=True)), 0 * np.asarray(frequency)
        )

    def decay(self, dt: Any) -> tuple[Any, ...]:
        """e_i = exp(−Δ/τ_i): what is left of an overstress after a step of Δ seconds.

        `dt` is a number, None for an instant, infinity for ever, or a parameter of NGSolve.
        """
        return tuple(exp(-ratio) for ratio in self._ratios(dt))

    def gain(self, dt: Any) -> tuple[Any, ...]:
        """a_i = (1 − exp(−Δ/τ_i))/(Δ/τ_i): what is left of a stress that grew evenly over the step."""
        return tuple(mean_decay(ratio) for ratio in self._ratios(dt))

    def _ratios(self, dt: Any) -> list[Any]:
        return [(0.0 if dt is None else dt) / tau for tau in self.times]


def mean_decay(ratio: Any) -> Any:
    """(1 − exp(−x))/x, which is 1 at x = 0 and 0 at infinity, for a number or a parameter of NGSolve."""
    if not is_symbolic(ratio):
        return -math.expm1(-ratio) / ratio if ratio > 0 else 1.0
    # below 0.01 the difference would lose digits and five terms of the series are exact
    series = 1 - ratio / 2 * (1 - ratio / 3 * (1 - ratio / 4 * (1 - ratio / 5)))
    safe = where(ratio - 0.01, ratio, 1.0)
    return where(ratio - 0.01, (1 - exp(-safe)) / safe, series)


def _pair(term: Any) -> tuple[float, float]:
    if isinstance(term, Sequence) and not isinstance(term, str) and len(term) == 2:
        return term[0], term[1]
    raise UsageError(
        f"A Prony term is {term!r}.",
        why="It must be a pair: the share that relaxes and its relaxation time in s.",
        fix="Pass a tuple of pairs, for example terms=((0.39, 700.0),).",
    )


def spring_energy(overstress: Tensor, shear: float, bulk: float) -> Scalar:
    """Energy in J/m³ of a spring of moduli G and K (Pa) at an overstress (..., 3, 3) in Pa.

    A bulk modulus of 0 is a law without volumetric stress: then the trace, which large strain brings, counts nothing.
    """
    return _form(overstress, overstress, shear, bulk)


def dashpot_loss(overstress: Tensor, growth: Tensor, ratio: float, shear: float, bulk: float) -> Scalar:
    """Return the heat in J/m³ of one term over a step, whose length over the relaxation time is `ratio`.

    `overstress` and `growth` (..., 3, 3) are H at the beginning of the step and J, the growth of the term's share of
    the instantaneous stress, in Pa; `shear` and `bulk` are the spring's moduli in Pa.
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
