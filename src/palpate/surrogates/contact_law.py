"""Contact laws U₀(s): how the energy of a touch begins, before anything is learnt.

A rigid sphere of radius R at depth s presses a flat body through a pad of stiffness k (N/m³). While the body has
not yielded, the pad is pressed by p(r) = s − r²/2R over the circle r² < 2Rs, and

    U = ½ k ∫ p² dA = πkR s³/3                                the body stiff, the pad soft
    U = (8/15) E* √R s^{5/2}                                  the body soft: Hertz 1882; Johnson 1985, eq. 4.23

(Johnson's force is (4/3) E* √R s^{3/2}.) Two springs in series: at small depth the pad is the softer one, at large
depth the body. s³/(1 + s/a)^½ has both as its limits, and they cross where

    (πkR/3) √a = (8/15) E* √R,        a = (8 E*/(5πk))²/R

All have the form  U₀ = f s^p (1 + s/a)^−½  with a = ∞ for the pure powers. With r = s/(a + s):

    U₀'  = U₀ (p − r/2)/s         U₀'' = U₀ (p(p − 1) − p r + ¾ r²)/s²

so that no quotient is left at s = 0. Prefactors other than ½ of ½ s² are left to what is learnt.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from palpate.errors import UsageError
from palpate.kernels import for_rows, kernel, part

__all__ = ["ContactLaw", "choices", "crossing_length", "law_at"]


# twice the power p, and the factor f
_POWERS = {"square": (4.0, 0.5), "hertz": (5.0, 1.0), "pad": (6.0, 1.0), "series": (6.0, 1.0)}
_WORDS = {
    "square": "½ s²",
    "hertz": "s^{5/2}, an elastic half-space",
    "pad": "s³, a soft pad",
    "series": "s³/(1 + s/a)^½, a pad on an elastic half-space",
}


def choices() -> tuple[str, ...]:
    """Names of the laws: ½ s², s^{5/2}, s³, and s³/(1 + s/a)^½."""
    return tuple(_POWERS)


def crossing_length(plane_modulus: float, pad: float, radius: float) -> float:
    """Return the depth a (m) at which pad and half-space are equally soft: (8 E*/(5πk))²/R.

    The plane modulus E* = E/(1 − ν²) is in Pa, the pad's k in N/m³, the radius R in m; all are positive.
    """
    if not all(math.isfinite(v) and v > 0 for v in (plane_modulus, pad, radius)):
        raise UsageError(
            f"E* = {plane_modulus} Pa, k = {pad} N/m³ and R = {radius} m have no crossing length.",
            fix="Give positive numbers in SI units.",
        )
    return float((8.0 * plane_modulus / (5.0 * math.pi * pad)) ** 2 / radius)


@dataclass(frozen=True)
class ContactLaw:
    """One contact law.

    Attributes
    ----------
    name : {"square", "hertz", "pad", "series"}
        ½ s², s^{5/2}, s³, or s³/(1 + s/a)^½.
    length : float
        a in m, of the law "series" only; infinite for the others.

    Raises
    ------
    UsageError
        If there is no such law, or the length does not go with it.
    """

    name: str = "series"
    length: float = math.inf

    def __post_init__(self) -> None:
        if self.name not in _POWERS:
            raise UsageError(
                f"There is no contact law {self.name!r}.", fix=f"Choose one of {', '.join(choices())}."
            )
        series = self.name == "series"
        if not self.length > 0 or math.isfinite(self.length) != series:
            raise UsageError(
                f"The law {self.name!r} can't have a length of {self.length} m.",
                why="Only 'series' crosses from one power to another, and it does so at a positive length.",
                fix="Give a positive length with 'series' and none with the others.",
            )

    def __str__(self) -> str:
        where = f", a = {1e3 * self.length:.3g} mm" if self.name == "series" else ""
        return f"U₀ = {_WORDS[self.name]}{where}"

    def numbers(self) -> tuple[float, float, float]:
        """(2p, f, a), what `law_at` takes."""
        return (*_POWERS[self.name], self.length)

    def energy(self, s: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """U₀, U₀' and U₀'' at depths s (m) of any shape; all zero where s ≤ 0."""
        s = np.asarray(s, dtype=np.float64)
        out = np.empty((3, s.size))
        for_rows(_laws_into, s.size)(s.ravel(), out, *self.numbers())
        return out[0].reshape(s.shape), out[1].reshape(s.shape), out[2].reshape(s.shape)

    def log(self, s: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """λ = ln U₀, λ' and λ'' at depths s > 0 (m) of any shape.

        Raises
        ------
        UsageError
            If a depth is not positive: there is no contact, and no logarithm.
        """
        s = np.asarray(s, dtype=np.float64)
        if not (s > 0).all():
            raise UsageError(
                "A contact law has no logarithm at depths that are not positive.",
                why="There the energy is exactly zero.",
                fix="Leave out samples without contact: keep those with depth > 0.",
            )
        twice, factor, a = self.numbers()
        p, r = twice / 2.0, s / (a + s)
        value = p * np.log(s) + math.log(factor) - 0.5 * np.log1p(s / a)
        return value, (p - 0.5 * r) / s, (0.5 * r * r - p) / (s * s)


@part
def law_at(s, twice, factor, length) -> tuple[float, float, float]:  # type: ignore[no-untyped-def]  # noqa: ANN001
    """U₀, U₀' and U₀'' at one depth s (m): zero where s ≤ 0, not-a-number where s is."""
    if s <= 0.0:
        return 0.0, 0.0, 0.0
    g = factor  # f s^{p−2}: what is left of the power after two derivatives
    if twice == 5.0:
        g *= math.sqrt(s)
    elif twice == 6.0:
        g *= s
    p, r = 0.5 * twice, s / (length + s)
    g /= math.sqrt(1.0 + s / length)
    return g * s * s, g * s * (p - 0.5 * r), g * (p * (p - 1.0) - p * r + 0.75 * r * r)


@kernel
def _laws_into(s, out, twice, factor, length) -> None:  # type: ignore[no-untyped-def]  # noqa: ANN001
    """`law_at` for depths s (N,) into out (3, N)."""
    for i in range(s.size):
        out[0, i], out[1, i], out[2, i] = law_at(s[i], twice, factor, length)
