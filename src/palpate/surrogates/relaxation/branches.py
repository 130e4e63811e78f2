"""How a body forgets: shares and times of the branches in parallel to its elastic answer.

A held probe feels its force fall to the share g(t) = γ_∞ + Σ γ_i exp(−t/τ_i), with γ_∞ + Σ γ_i = 1. The shares are
those of the *force on the probe*: what doesn't relax, a pad or the volumetric stiffness, makes them smaller than the
material's own.

**A pad in series** doesn't relax and takes the larger share of the compliance the lighter the touch. With U_a the
elastic energy at which pad and body give way alike, the body's share of the compliance is

    β² = 1/(1 + (U_a/U)^(1/6))

because a pad's energy grows with the cube of the depth and a Hertzian body's with its power 5/2: the ratio of their
stiffnesses goes with the root of the depth, that is with U^(1/6). Shares and times are then those of the body behind
the pad, and the share left of a held force is

    g(t) = (1 − u) (1 − u (1 − β²)/6)        u = b (Σγ_i − γᵀ exp(A t) 1)        b = β²/(1 − (1 − β²) Σγ_i)

with A = T⁻¹ ((1 − β²) 1 γᵀ − I), T = diag(τ_i), where the second factor comes from β growing with the depth.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from palpate.errors import UsageError

__all__ = ["Branches"]


@dataclass(frozen=True)
class Branches:
    """Shares of the instantaneous answer that relax, and their times.

    Attributes
    ----------
    terms : tuple of (float, float)
        (γ_i, τ_i): share, in (0, 1), and relaxation time in s, positive. The shares sum to less than 1.
    pad : float
        U_a in J; 0 for a body without a pad, or with shares that were seen through it.

    Raises
    ------
    UsageError
        For a share or a time that isn't positive and finite, shares that leave nothing, or a negative pad.
    """

    terms: tuple[tuple[float, float], ...]
    pad: float = 0.0

    def __post_init__(self) -> None:
        object.__setattr__(self, "terms", tuple(_pair(term) for term in self.terms))
        if not self.equilibrium > 0:
            raise UsageError(
                f"The shares of the branches sum to {math.fsum(self.shares):g}.",
                why="They are shares of the instantaneous force; a body that holds a probe up keeps some for ever.",
                fix="Give shares that sum to less than 1.",
            )
        if not 0 <= self.pad < math.inf:
            raise UsageError(
                f"A pad's energy can't be {self.pad} J.", fix="Give 0, or a positive energy in J."
            )

    def __str__(self) -> str:
        if not self.terms:
            return "does not relax"
        return "relaxes by " + " and ".join(f"{share:.4g} in {time:.4g} s" for share, time in self.terms)

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
        return 1.0 - math.fsum(self.shares)

    def body_share(self, energy: Any) -> np.ndarray:
        """β², the body's share of the compliance, at elastic energies in J of any shape; 1 without a pad."""
        energy = np.asarray(energy, dtype=float)
        if self.pad == 0:
            return np.ones_like(energy)
        ratio = np.power(energy / self.pad, 1 / 6)
        return np.asarray(ratio / (1 + ratio))

    def relaxation(self, time: Any, energy: float | None = None) -> np.ndarray:
        """g(t), the share of a held force that is left, for times in s of any shape.

        Parameters
        ----------
        time : array_like
            Since a sudden press, s.
        energy : float, optional
            Elastic energy at the held position, J, on which g depends if there is a pad. By default the limit of
            deep presses.
        """
        time = np.asarray(time, dtype=float)
        if not self.terms:
            return np.ones_like(time)
        body = 1.0 if energy is None else float(self.body_share(energy))
        rates, amplitudes = self._modes(body)
        fallen = (1.0 - np.exp(-np.multiply.outer(time, rates))) @ amplitudes
        return np.asarray((1.0 - fallen) * (1.0 - fallen * (1.0 - body) / 6.0))

    def _modes(self, body: float) -> tuple[np.ndarray, np.ndarray]:
        """Rates (n,) in 1/s and amplitudes (n,) of the exponentials in u, at a share β² of the body."""
        shares, times, _ = self.compiled()
        # A is similar to a symmetric matrix by diag(√(γ τ))
        root = np.sqrt(shares / times)
        rates, vectors = np.linalg.eigh(np.diag(1 / times) - (1 - body) * np.outer(root, root))
        felt = body / (1 - (1 - body) * shares.sum())
        return rates, felt * (root @ vectors) * (np.sqrt(shares * times) @ vectors)

    def compiled(self) -> tuple[np.ndarray, np.ndarray, float]:
        """γ (n,), τ (n,) in s, and √(2U_a) in √J, as the kernels take them."""
        return np.array(self.shares), np.array(self.times), math.sqrt(2 * self.pad)


def _pair(term: Any) -> tuple[float, float]:
    if not (isinstance(term, Sequence) and not isinstance(term, str) and len(term) == 2):
        raise UsageError(
            f"A branch is {term!r}.",
            why="It must be a pair: the share that relaxes and its relaxation time in s.",
            fix="Pass a tuple of pairs, for example terms=((0.3, 0.1), (0.2, 2.0)).",
        )
    share, time = float(term[0]), float(term[1])
    if not (share > 0 and 0 < time < math.inf):
        raise UsageError(
            f"A branch has the share {share:g} and the time {time:g} s.",
            fix="Both must be positive; leave a branch without a share out.",
        )
    return share, time
