"""Dents: a body that yields where it is pressed, and keeps the print.

An elastic energy U(c) at the probe's centre, learnt or solved, asks the amplitude q = √(2U). The dent has an amplitude
p, and the body answers as an elastic one of another size from where the dent ends,

    V = ½ κ(p) (q − p)₊²        F = −∂V/∂c

so the force vanishes at q = p, which is the residual depth, and comes back on the way by which it went. The dent
grows where q would pass Q(p): pressing goes along the virgin curve q = Q(p). Both Q and κ are tables over p, with Q(0)
the first yield, Q rising and κ(0) = 1. κ ≠ 1 says by how much stiffer the wider print makes the contact.

**Places.** Dents p_j stand at points x_j of the touched surface, and the probe meets their mean

    p(c) = Σ w_j(c) p_j        w_j ∝ exp(−|c − x_j|²/2w²),  Σ w_j = 1

A dent left behind stays; a probe beside it meets a part of it, and is drawn along the slope of p. Growth shares
itself out by the same weights, ṗ_j = λ w_j.

**Passive.** V ≥ 0; at kept dents F is the gradient of V, so a closed path that nothing yields on takes nothing. Growth
lowers V: dV = (∂V/∂p) Σ w_j dp_j, with Σ w_j dp_j = Σ w_j² dλ ≥ 0 and −∂V/∂p = κ (q − p) − ½ κ′ (q − p)² > 0, which
`Dents` demands of its tables wherever q ≤ Q(p). A step moves the probe at once at kept dents, and lets the dents grow
at a kept probe, to Q(p) = q in closed form, so it is stable at any length; what V loses then is booked as lost.
That is of first order in the step, while the forces of a straight press don't depend on the step at all.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from palpate.checks import own_arrays
from palpate.errors import UsageError
from palpate.format import share
from palpate.surrogates.plastic.dent_kernels import step_into

__all__ = ["DentMemory", "Dents"]


@dataclass(frozen=True, eq=False)
class Dents:
    """How a body yields under a probe, and where.

    Attributes
    ----------
    dent : (m,)
        p at the knots in √J, ascending from 0; between them the tables are straight, beyond the last they go on along
        the last piece.
    reach : (m,)
        Q there in √J: amplitude at which the dent is that large. Rising, above `dent`.
    stiffening : (m,)
        κ there, 1 at the first; beyond the last knot it stays.
    points : (n, 3)
        Places in m.
    width : float
        w in m.

    Raises
    ------
    UsageError
        If the tables are not such, or would let a growing dent give energy back.
    """

    dent: np.ndarray
    reach: np.ndarray
    stiffening: np.ndarray
    points: np.ndarray
    width: float

    def __post_init__(self) -> None:
        own_arrays(self, "dent", "reach", "stiffening", "points")
        p, Q, k = self.dent, self.reach, self.stiffening
        shaped = p.ndim == 1 and len(p) > 1 and Q.shape == k.shape == p.shape
        placed = (
            self.points.ndim == 2 and self.points.shape[1] == 3 and len(self.points) > 0 and self.width > 0
        )
        sound = shaped and placed and all(np.isfinite(a).all() for a in (p, Q, k, self.points))
        sound = (
            sound and p[0] == 0 and bool((np.diff(p) > 0).all() and (np.diff(Q) > 0).all() and (p < Q).all())
        )
        if not (sound and k[0] == 1 and (k > 0).all()):
            raise UsageError(
                f"These are no tables of a dent: p {p}, Q {Q}, κ {k}, at {self.points.shape}, width {self.width}.",
                why="p rises from 0, Q rises above it, κ is positive and 1 at first; places are (n, 3).",
                fix="Learn them by `palpate.learning.plastic.learn_dents`.",
            )
        slopes = np.diff(k) / np.diff(p)
        # −∂V/∂p = (q − p) [κ − ½ κ′ (q − p)] is least where κ is least and q − p largest
        widest = np.maximum((Q - p)[:-1], (Q - p)[1:])
        if not (np.minimum(k[:-1], k[1:]) > 0.5 * slopes * widest).all():
            raise UsageError(
                "A dent that grows would give energy back.",
                why=f"κ rises too fast: {k} over {p}.",
                fix="Take fewer knots, or a κ that rises by less.",
            )

    def __str__(self) -> str:
        return (
            f"yields from {self.reach[0]:.3g} √J on, dents to {self.dent[-1]:.3g} √J at {len(self.points)} places, "
            f"stiffer by {share(self.stiffening[-1] - 1)}"
        )

    @classmethod
    def single(cls, dent: np.ndarray, reach: np.ndarray, stiffening: np.ndarray) -> Dents:
        """One dent that travels with the probe: for a body pressed at one place."""
        return cls(dent, reach, stiffening, np.zeros((1, 3)), 1.0)

    def memory(self) -> DentMemory:
        """The state of a virgin body."""
        return DentMemory(self)

    def shares(self, C: np.ndarray) -> np.ndarray:
        """w_j (N, n) of probes' centres C (N, 3), m: p(c) = Σ w_j p_j."""
        square = ((C[:, None] - self.points) ** 2).sum(axis=2)
        weights = np.exp((square.min(axis=1, keepdims=True) - square) / (2.0 * self.width**2))
        return np.asarray(weights / weights.sum(axis=1, keepdims=True))

    def compiled(self) -> tuple[np.ndarray, ...]:
        """(p, Q, κ, points, width), as the kernels take them."""
        return self.dent, self.reach, self.stiffening, self.points, np.array([self.width])


class DentMemory:
    """The state of a body that keeps dents; `step` allocates nothing.

    Attributes
    ----------
    force : (3,)
        On the probe, N; overwritten by each step.
    now : (n,)
        p_j in √J, read-only; overwritten by each step.

    Parameters
    ----------
    dents : Dents
    """

    def __init__(self, dents: Dents) -> None:
        n = len(dents.points)
        self.dents, self.force = dents, np.zeros(3)
        self._ledger = np.zeros(4)
        self._depths = np.zeros(n)
        self.now = self._depths.view()
        self.now.flags.writeable = False
        self._work = (np.zeros(n), np.zeros(3), np.zeros(3))
        self._constants = dents.compiled()
        self.step(np.zeros(3), 0.0, np.zeros(3))  # compile now, not in the loop
        self.reset()

    def __repr__(self) -> str:
        return f"DentMemory: {self.dents}; deepest {self.depths.max():.3g} √J, force {self.force} N"

    @property
    def depths(self) -> np.ndarray:
        """p_j (n,) in √J, a copy; setting it goes back to that print, the probe outside."""
        return np.array(self._depths)

    @depths.setter
    def depths(self, depths: np.ndarray) -> None:
        if np.shape(depths) != self._depths.shape or not (np.asarray(depths) >= 0).all():
            raise UsageError(
                f"Depths of shape {np.shape(depths)} are no print of this body.",
                fix=f"Give {self._depths.size} numbers that are not negative.",
            )
        self._depths[:] = depths
        self._ledger[0] = 0.0  # the probe is outside
        self.force[:] = 0.0

    @property
    def stored(self) -> float:
        """V in J: the most that the body can give back."""
        return float(self._ledger[0])

    @property
    def lost(self) -> float:
        """Energy that dents have taken since the start, J."""
        return float(self._ledger[1])

    @property
    def work(self) -> float:
        """Work of the hand since the start, J: `stored` + `lost`."""
        return float(self._ledger[2])

    @property
    def lost_in_step(self) -> float:
        """Energy that dents took in the last step, J; never negative."""
        return float(self._ledger[3])

    def reset(self) -> None:
        """Back to the virgin body, the probe outside."""
        for array in (self._depths, self._ledger, self.force):
            array[...] = 0.0

    def step(self, position: np.ndarray, energy: float, slope: np.ndarray, dt: float = 0.0) -> bool:
        """Move the probe to a position and renew `force`.

        Parameters
        ----------
        position : (3,) float64
            Centre c of the probe, m.
        energy : float
            U there, J; 0 without contact.
        slope : (3,) float64
            ∇U there, minus the elastic force, N.
        dt : float
            Of no meaning here: yielding knows no time. It has its place in the signature of memories that do.

        Returns
        -------
        bool
            False if a number is not finite or U is negative: the force is zero then and nothing has changed.
        """
        del dt
        return bool(
            step_into(
                position, energy, slope, self.force, self._ledger, self._depths, self._work, self._constants
            )
        )
