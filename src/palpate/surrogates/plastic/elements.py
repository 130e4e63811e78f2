"""What a body remembers of how far it was moved: springs in parallel that slip or relax.

Let h be the stretch of a held body (`held_body`): a coordinate in which its elastic energy is ½ K h². The stiffness K
is shared out among elements in parallel, each a spring of the elongation e_i with a slider or a dashpot in series:

    force of all        f = Σ k_i e_i                       energy stored   V = Σ ½ k_i e_i²
    a spring            ė_i = ḣ
    a slider            ė_i = ḣ − ṗ_i,  |e_i| ≤ y_i + c_i α_i,  α̇_i = |ṗ_i|, and ṗ_i e_i ≥ 0
    a dashpot           ė_i = ḣ − e_i/τ_i

Sliders are the model of Prandtl 1928 and Iwan 1966 with isotropic hardening c_i; dashpots that of Maxwell, in parallel
a Prony series. Whatever the numbers, as long as k_i, y_i, c_i, τ_i are not negative,

    work of the hand = change of V + lost        lost = Σ ∫ k_i (y_i + c_i α_i) |ṗ_i| + k_i e_i²/τ_i dt ≥ 0

so nothing can be had back that was not put in; where nothing slips or relaxes the force is the gradient of V at kept
memory, and a closed path takes nothing.

**A step** in which h changes evenly is integrated exactly: a slider's elongation is the return mapping of the end
point (Wilkins 1964), as its path has one direction, and a dashpot's is e^{−x} e + (1 − e^{−x})/x Δh with x = Δt/τ
(Taylor, Pister & Goudreau 1970). So any length of step is stable.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from palpate.checks import own_arrays
from palpate.errors import UsageError

__all__ = ["Elements"]


@dataclass(frozen=True, eq=False)
class Elements:
    """Springs in parallel, some with a slider, some with a dashpot.

    Attributes
    ----------
    stiffness : (n,)
        k_i, N/m, positive.
    limit : (n,)
        y_i, the elongation at which it first slips, m; infinite for springs and dashpots.
    rise : (n,)
        c_i, by how much the limit grows for each metre of slip; a pure number.
    time : (n,)
        τ_i, s; infinite for springs and sliders.

    Raises
    ------
    UsageError
        If a number has no meaning, or an element both slips and relaxes.
    """

    stiffness: np.ndarray
    limit: np.ndarray
    rise: np.ndarray
    time: np.ndarray

    def __post_init__(self) -> None:
        own_arrays(self, "stiffness", "limit", "rise", "time")
        n = self.stiffness.shape
        shaped = len(n) == 1 and n[0] > 0 and self.limit.shape == self.rise.shape == self.time.shape == n
        sound = shaped and bool(
            (np.isfinite(self.stiffness) & (self.stiffness > 0)).all()
            and (np.isfinite(self.rise) & (self.rise >= 0)).all()
            and (self.limit > 0).all()
            and (self.time > 0).all()
            and (np.isinf(self.limit) | np.isinf(self.time)).all()
        )
        if not sound:
            raise UsageError(
                f"These are no elements: stiffness {self.stiffness}, limit {self.limit}, rise {self.rise}, "
                f"time {self.time}.",
                why="Each needs a positive stiffness, and a positive limit or a positive time or neither.",
                fix="Use infinity for a limit or a time that an element hasn't.",
            )

    @classmethod
    def sliders(cls, stiffness: np.ndarray, limit: np.ndarray, rise: np.ndarray) -> Elements:
        """Springs that slip; those of infinite limit don't."""
        return cls(stiffness, limit, rise, np.full(len(np.atleast_1d(stiffness)), math.inf))

    @classmethod
    def dashpots(cls, stiffness: np.ndarray, time: np.ndarray) -> Elements:
        """Springs that relax; those of infinite time don't."""
        n = len(np.atleast_1d(stiffness))
        return cls(stiffness, np.full(n, math.inf), np.zeros(n), time)

    def __len__(self) -> int:
        return len(self.stiffness)

    def __str__(self) -> str:
        slip, relax = int(np.isfinite(self.limit).sum()), int(np.isfinite(self.time).sum())
        kinds = [f"{slip} that slip" if slip else "", f"{relax} that relax" if relax else ""]
        return f"{len(self)} springs of {self.total:.4g} N/m in all, " + (
            " and ".join(kind for kind in kinds if kind) or "none with a memory"
        )

    @property
    def total(self) -> float:
        """K = Σ k_i in N/m: the virgin body's stiffness against the stretch."""
        return float(self.stiffness.sum())

    @property
    def first_slip(self) -> float:
        """Stretch in m of a virgin body at which something slips."""
        return float(self.limit.min())

    def compiled(self) -> tuple[np.ndarray, ...]:
        """(k, y, c, τ), as the kernels take them."""
        return self.stiffness, self.limit, self.rise, self.time

    def elongations(self, stretch: np.ndarray, times: np.ndarray | None = None) -> np.ndarray:
        """e (N, n) in m along a history h (N,) in m that starts from rest; times (N,) in s if something relaxes.

        Between two samples h changes evenly.

        Raises
        ------
        UsageError
            If something relaxes and the times don't fit.
        """
        from palpate.surrogates.plastic.element_kernels import follow

        stretch = np.ascontiguousarray(stretch, dtype=np.float64)
        if times is None:
            times = np.zeros(len(stretch))
            if np.isfinite(self.time).any():
                raise UsageError(
                    "Elements that relax need the times of a history.", fix="Pass times (N,) in s."
                )
        steps = np.diff(np.asarray(times, dtype=np.float64), prepend=0.0)
        if steps.shape != stretch.shape or not (steps >= 0).all():
            raise UsageError(
                f"Times of shape {np.shape(times)} don't fit a history of shape {stretch.shape}.",
                fix="Give one time in s for each sample, ascending from 0.",
            )
        return np.asarray(follow(stretch, steps, *self.compiled()))
