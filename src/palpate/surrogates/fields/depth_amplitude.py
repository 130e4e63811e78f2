"""The growth of a field with depth from first touch: f(s), zero without contact and one at the deepest trained depth.

Far from the touched place a field goes with the force, and the force is the slope of the contact law: s² behind a
soft pad, s^{3/2} on an elastic half-space (Johnson 1985, eq. 4.23), s²/(1 + s/a)^½ for both in series (see
`palpate.surrogates.contact_law`). Under the probe the skin follows it: s. All are

    f = (s/s*)^p ((1 + s*/a)/(1 + s/a))^½        with a = ∞ for pure powers

Beyond the deepest trained depth s* the field grows in proportion to depth and no faster: f = s/s*.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from palpate.errors import UsageError
from palpate.kernels import for_rows, kernel, part

__all__ = ["AMPLITUDES", "DepthAmplitude", "amplitude_at"]

_POWERS = {"linear": 1.0, "hertz": 1.5, "square": 2.0, "series": 2.0}
AMPLITUDES = tuple(_POWERS)


@dataclass(frozen=True)
class DepthAmplitude:
    """One such growth.

    Attributes
    ----------
    name : {"linear", "hertz", "square", "series"}
        s, s^{3/2}, s² or s²/(1 + s/a)^½.
    deepest : float
        s*, m.
    length : float
        a in m, of "series" only; infinite for the others.

    Raises
    ------
    UsageError
        If there is no such growth, or a length does not go with it.
    """

    name: str
    deepest: float
    length: float = math.inf

    def __post_init__(self) -> None:
        if self.name not in _POWERS:
            raise UsageError(
                f"A field does not grow by {self.name!r}.", fix=f"Choose one of {', '.join(AMPLITUDES)}."
            )
        series = self.name == "series"
        if not (self.length > 0 and 0 < self.deepest < math.inf) or math.isfinite(self.length) != series:
            raise UsageError(
                f"A field can't grow by {self.name!r} with a length of {self.length} m to a depth of "
                f"{self.deepest} m.",
                why="Only 'series' crosses from one power to another, and it does so at a positive length.",
                fix="Give a positive, finite depth, and a length with 'series' alone.",
            )

    def numbers(self) -> tuple[float, float, float]:
        """(p, s*, a), what `amplitude_at` takes."""
        return _POWERS[self.name], self.deepest, self.length

    def at(self, s: np.ndarray) -> np.ndarray:
        """Values f at depths s (m) of any shape; zero where s ≤ 0."""
        s = np.asarray(s, dtype=np.float64)
        out = np.empty(s.size)
        for_rows(_amplitudes_into, s.size)(s.ravel(), out, *self.numbers())
        return out.reshape(s.shape)


@part
def amplitude_at(s, power, deepest, length) -> float:  # type: ignore[no-untyped-def]  # noqa: ANN001
    """Values f at one depth s (m)."""
    if s <= 0.0:
        return 0.0
    t = s / deepest
    if t >= 1.0:
        return float(t)
    f = t
    if power == 2.0:
        f *= t
    elif power == 1.5:
        f *= math.sqrt(t)
    return float(f * math.sqrt((1.0 + deepest / length) / (1.0 + s / length)))


@kernel
def _amplitudes_into(s, out, power, deepest, length) -> None:  # type: ignore[no-untyped-def]  # noqa: ANN001
    for i in range(s.size):
        out[i] = amplitude_at(s[i], power, deepest, length)
