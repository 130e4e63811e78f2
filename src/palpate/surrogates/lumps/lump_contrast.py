"""The energy that a lump adds to a learnt body, learnt from presses without a lump.

Of a press at c whose energy is U and whose body has the strain-energy density W, a lump of share χ and x = ratio − 1
takes

    D = ∫ χ W dV           what it would take if nothing moved
    β = −½ ∂²U/∂x² / D     how much the tissue gives way to it: (½ bᵀK⁻¹b + 0.4 ∫ χ(1 − χ) W dV)/D with b = ∂D/∂u
                           and the tangent K; the second term is of the soft edge, see `lump`
    ΔU ≈ x D/(1 + β x) · exp(k s²),   s = βx/(1 + βx)

x D/(1 + β x) is the [1/1] Padé approximant in x, a lower bound in linear elasticity, as ΔU/x is a Stieltjes function
there (Milton 2002, The Theory of Composites, ch. 27). Its shortfall depends on s alone, and k is fitted to a few
presses with a lump. Learnt are ln(D/U) and ln β over the place of the hand, the offset of the lump from it and ln r:

    ln(D/U) = N(c, p − c, ln r) + 3 ln r − e ln |p − c|

So ΔU is positive for a stiff lump, falls with the distance as |p − c|^−e, and is zero at ratio 1.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from palpate.errors import UsageError
from palpate.format import share
from palpate.surrogates.lumps.gaussian_sum import GaussianSum
from palpate.surrogates.lumps.lump import Lump, require_apart
from palpate.surrogates.lumps.lump_room import LumpRoom

if TYPE_CHECKING:
    from palpate.surrogates.energy import LearntEnergy

__all__ = ["LumpContrast", "closed_form", "contrast_inputs"]


@dataclass(frozen=True, eq=False)
class LumpContrast:
    """The energy that any lump adds to a body's, as a value that its file keeps.

    Attributes
    ----------
    density : GaussianSum
        N of ln(D/U): seven inputs, the hand's place (m), the lump's offset from it (m) and ln(radius/m).
    compliance : GaussianSum
        Of ln β, of the same inputs.
    decay : float
        Exponent e of the distance between hand and lump.
    curvature : float
        Constant k of the closed form.
    room : LumpRoom
        Where lumps may be, and how large.
    meta : mapping
        JSON-able record: solves, lookups, and ``contrast_error`` (a mapping with ``median`` and ``p95``), the error of
        the change of force over that change, where it is above 1 % of the force.

    Raises
    ------
    UsageError
        If they have other than seven inputs.
    """

    density: GaussianSum
    compliance: GaussianSum
    decay: float
    curvature: float
    room: LumpRoom
    meta: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for part in (self.density, self.compliance):
            if part.middle.size != 7:
                raise UsageError(
                    f"A function of {part.middle.size} inputs is none of the energy of a lump.",
                    why="That takes seven: place of the hand, offset of the lump from it, ln radius.",
                    fix="Let `palpate.learn` make it of a sweep of `palpate.LumpProblem`.",
                )

    def __str__(self) -> str:
        error = self.meta.get("contrast_error", {})
        words = (
            f"; contrast error {share(error['median'])} median, {share(error['p95'])} p95" if error else ""
        )
        r = self.room.radius
        return f"lumps ⌀{2e3 * r.low:.3g}–{2e3 * r.high:.3g} mm: {self.density.units} units{words}"

    __repr__ = __str__

    def looked_up(self, lump: Lump, X: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Return ln(D/U) (N,), its slopes by the place (N, 3) in 1/m, ln β (N,) and its slopes, at places X (N, 3)."""
        return self.looked_up_at(
            contrast_inputs(X, np.broadcast_to(lump.place, X.shape), np.full(len(X), lump.radius))
        )

    def looked_up_at(self, Z: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Return the same of inputs Z (N, 7), each of its own lump (see `contrast_inputs`)."""
        value, slopes = self.density.value_and_slopes(Z)
        softness, bends = self.compliance.value_and_slopes(Z)
        offset, squared = Z[:, 3:6], (Z[:, 3:6] ** 2).sum(axis=1)
        value = value + 3.0 * Z[:, 6] - 0.5 * self.decay * np.log(squared)
        # the offset is the lump's place less the hand's
        by_place = slopes[:, :3] - slopes[:, 3:6] + self.decay * offset / squared[:, None]
        return value, by_place, softness, bends[:, :3] - bends[:, 3:6]

    def added(self, lump: Lump, X: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return ΔU/U (N,) of a lump and its slopes by the hand's place (N, 3) in 1/m, at places X (N, 3) in contact.

        Raises
        ------
        UsageError
            If the lump is outside the room for lumps.
        """
        self.room.require(lump)
        value, by_place, softness, bends = self.looked_up(lump, X)
        return closed_form(np.exp(value), by_place, np.exp(softness), bends, lump.ratio - 1.0, self.curvature)

    def answer(
        self, energy: LearntEnergy, lumps: Sequence[Lump], X: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return energy (N,) in J and force (N, 3) in N of a body with lumps, at places X (N, 3) of the hand.

        Raises
        ------
        UsageError
            If a lump leaves its room or the skin, or two meet.
        """
        self.require(lumps)
        U, force, _ = energy.response(X)
        touching = U > 0
        total, slopes = np.zeros(len(X)), np.zeros((len(X), 3))
        for lump in lumps:
            value, slope = self.added(lump, X[touching])
            total[touching] += value
            slopes[touching] += slope
        return U * (1.0 + total), force * (1.0 + total)[:, None] - U[:, None] * slopes

    def require(self, lumps: Sequence[Lump]) -> None:
        """Refuse lumps that leave their room or the skin, or meet.

        Raises
        ------
        UsageError
            For the first that does.
        """
        require_apart(tuple(lumps))
        for lump in lumps:
            self.room.require(lump)


def closed_form(
    density: np.ndarray, by_place: np.ndarray, beta: np.ndarray, bends: np.ndarray, x: Any, k: float
) -> tuple[np.ndarray, np.ndarray]:
    """Return ΔU/U (N,) and its slopes (N, 3) from D/U, ∇ln(D/U), β, ∇ln β, x = ratio − 1 and k."""
    s = beta * x / (1.0 + beta * x)
    value = x * density / (1.0 + beta * x) * np.exp(k * s**2)
    # ∂ ln(ΔU)/∂ ln β, as ∂s/∂ ln β = s (1 − s)
    by_beta = -s + 2.0 * k * s**2 * (1.0 - s)
    return value, np.asarray(value)[:, None] * (by_place + by_beta[:, None] * bends)


def contrast_inputs(X: np.ndarray, places: np.ndarray, radii: np.ndarray) -> np.ndarray:
    """Return the inputs (N, 7) of both sums: the hand's places X (N, 3), the lumps' offsets from it, ln radius."""
    return np.column_stack([X, places - X, np.log(radii)])
