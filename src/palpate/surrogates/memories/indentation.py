"""Indentation: a body that yields where it is pressed, and keeps the shape of it.

The elastic energy U = ½ q² at the probe's centre c asks the amplitude q. The indentation has a residual amplitude
p, and the body answers as an elastic one of another size from where the indentation ends,

    V = ½ κ(p) (q − p)₊²        F = −∂V/∂c

so the force vanishes at q = p, which is the residual depth, and comes back on the way by which it went. The indentation
grows where q would pass Q(p): pressing goes along the virgin curve q = Q(p). Both Q and κ are tables over p, with Q(0)
the first yield, Q rising and κ(0) = 1. κ ≠ 1 says by how much stiffer the wider contact is.

**Places.** Amplitudes p_j stand at points x_j of the touched surface, and the probe meets their mean

    p(c) = Σ w_j(c) p_j        w_j ∝ exp(−|c − x_j|²/2w²),  Σ w_j = 1

An indentation left behind stays; a probe beside it meets a part of it, and is drawn along the slope of p. Growth shares
itself out by the same weights, ṗ_j = λ w_j.

**Passive.** V ≥ 0; at kept p_j F is the gradient of V, so a closed path that nothing yields on takes nothing. Growth
lowers V: dV = (∂V/∂p) Σ w_j dp_j, with Σ w_j dp_j = Σ w_j² dλ ≥ 0 and −∂V/∂p = κ (q − p) − ½ κ′ (q − p)² > 0, which
`Indentation` demands of its tables wherever q ≤ Q(p). A step moves the probe at once at kept p_j, and lets them
grow at a kept probe, to Q(p) = q in closed form, so it is stable at any length; what V loses then is booked as lost.
That is of first order in the step, while the forces of a straight press don't depend on the step at all.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from palpate.checks import own_arrays
from palpate.errors import UsageError
from palpate.format import share
from palpate.kernels import kernel, part
from palpate.surrogates.memories.memory import Carry, Memory, MemoryState, register_memory
from palpate.surrogates.memories.patches import Patches, nearest_points

__all__ = ["Indentation", "IndentationState"]


@part
def _weights_into(centre, points, width, weights, mean) -> None:  # type: ignore[no-untyped-def]  # noqa: ANN001
    """w_j of a centre and their mean point; the nearest one's exponent is taken out, so that none underflows."""
    nearest = math.inf
    for j in range(weights.size):
        square = 0.0
        for a in range(3):
            square += (centre[a] - points[j, a]) ** 2
        weights[j] = square
        nearest = min(nearest, square)
    total = 0.0
    for j in range(weights.size):
        weights[j] = math.exp((nearest - weights[j]) / (2.0 * width * width))
        total += weights[j]
    mean[:] = 0.0
    for j in range(weights.size):
        weights[j] /= total
        for a in range(3):
            mean[a] += weights[j] * points[j, a]


@part
def _piece(x, knots):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Index of the piece of a table that x is in; the last one goes on."""
    i = 0
    while i < knots.size - 2 and x >= knots[i + 1]:
        i += 1
    return i


@part
def _stiffening(p, residual, table):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """κ and κ′ at p."""
    if p >= residual[-1]:
        return table[-1], 0.0
    i = _piece(p, residual)
    slope = (table[i + 1] - table[i]) / (residual[i + 1] - residual[i])
    return table[i] + slope * (p - residual[i]), slope


@part
def _virgin_residual(q, residual, reach):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """p on the virgin curve: Q(p) = q; never beyond q itself, also where the last piece goes on."""
    if q <= reach[0]:
        return 0.0
    i = _piece(q, reach)
    p = residual[i] + (residual[i + 1] - residual[i]) * (q - reach[i]) / (reach[i + 1] - reach[i])
    if q > reach[-1]:
        p = min(p, q - (reach[-1] - residual[-1]))  # the elastic part doesn't shrink
    return p


@part
def _stored(q, p, residual, table):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """V, J."""
    over = max(q - p, 0.0)
    return 0.5 * _stiffening(p, residual, table)[0] * over * over


@part
def _met(weights, depths):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """p(c) = Σ w_j p_j."""
    p = 0.0
    for j in range(weights.size):
        p += weights[j] * depths[j]
    return p


@part
def _grow(q, p, weights, depths, residual, reach):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Let the indentation grow until Q(p) = q; return the p that the probe meets."""
    wanted = _virgin_residual(q, residual, reach)
    if wanted <= p:
        return p
    squares = 0.0
    for j in range(weights.size):
        squares += weights[j] * weights[j]
    for j in range(weights.size):
        depths[j] += (wanted - p) * weights[j] / squares
    return wanted


@kernel
def _step_into(centre, q, slope, force, ledger, depths, work, constants) -> bool:  # type: ignore[no-untyped-def]  # noqa: ANN001
    """Take one step; see `IndentationState.step`."""
    weights, mean, along = work
    residual, reach, table, points, width = constants
    force[:] = 0.0
    total = q
    for a in range(3):
        total += centre[a] + slope[a]
    if not math.isfinite(total) or q < 0.0:
        return False
    _weights_into(centre, points, width[0], weights, mean)
    p = _met(weights, depths)
    moved = _stored(q, p, residual, table)
    p = _grow(q, p, weights, depths, residual, reach)
    stored = _stored(q, p, residual, table)
    lost = max(moved - stored, 0.0)
    ledger[2] += stored - ledger[0] + lost
    ledger[0] = stored
    ledger[1] += lost
    ledger[3] = lost
    if q <= p:
        return True
    kappa, kappa_slope = _stiffening(p, residual, table)
    # ∇p = Σ p_j w_j (x_j − x̄)/w²
    along[:] = 0.0
    for j in range(weights.size):
        for a in range(3):
            along[a] += depths[j] * weights[j] * (points[j, a] - mean[a]) / (width[0] * width[0])
    over = q - p
    driving = kappa * over - 0.5 * kappa_slope * over * over
    for a in range(3):
        force[a] = -kappa * over * slope[a] + driving * along[a]
    return True


@register_memory
@dataclass(frozen=True, eq=False)
class Indentation(Memory):
    """The law by which a body yields under a probe, and the places where indentations stay.

    Attributes
    ----------
    residual : (m,)
        p at the knots in √J, ascending from 0; between them the tables are straight, beyond the last they go on along
        the last piece.
    reach : (m,)
        Q there in √J: amplitude at which the residual is that large. Rising, above `residual`.
    stiffening : (m,)
        κ there, a pure number, 1 at the first; beyond the last knot it stays.
    points : (n, 3)
        Places in m.
    width : float
        w in m.

    Raises
    ------
    UsageError
        If the tables are not such, or would let a growing indentation give energy back.
    """

    name: ClassVar[str] = "indentation"
    keeps_indentation: ClassVar[bool] = True

    residual: np.ndarray
    reach: np.ndarray
    stiffening: np.ndarray
    points: np.ndarray
    width: float

    def __post_init__(self) -> None:
        own_arrays(self, "residual", "reach", "stiffening", "points")
        p, Q, k = self.residual, self.reach, self.stiffening
        shaped = p.ndim == 1 and len(p) > 1 and Q.shape == k.shape == p.shape
        at_places = (
            self.points.ndim == 2 and self.points.shape[1] == 3 and len(self.points) > 0 and self.width > 0
        )
        sound = shaped and at_places and all(np.isfinite(a).all() for a in (p, Q, k, self.points))
        sound = (
            sound and p[0] == 0 and bool((np.diff(p) > 0).all() and (np.diff(Q) > 0).all() and (p < Q).all())
        )
        if not (sound and k[0] == 1 and (k > 0).all()):
            raise UsageError(
                f"These are no tables of an indentation: p {p}, Q {Q}, κ {k}, "
                f"at {self.points.shape}, width {self.width}.",
                why="p rises from 0, Q rises above it, κ is positive and 1 at first; places are (n, 3).",
                fix="Learn them by `palpate.learning.plastic.learn_indentation`.",
            )
        slopes = np.diff(k) / np.diff(p)
        # −∂V/∂p = (q − p) [κ − ½ κ′ (q − p)] is least where κ is least and q − p largest
        widest = np.maximum((Q - p)[:-1], (Q - p)[1:])
        if not (np.minimum(k[:-1], k[1:]) > 0.5 * slopes * widest).all():
            raise UsageError(
                "An indentation that grows would give energy back.",
                why=f"κ rises too fast: {k} over {p}.",
                fix="Take fewer knots, or a κ that rises by less.",
            )

    def __str__(self) -> str:
        return (
            f"yields from {self.reach[0]:.3g} √J on, to {self.residual[-1]:.3g} √J at {len(self.points)} places, "
            f"stiffer by {share(self.stiffening[-1] - 1)}"
        )

    @classmethod
    def single(cls, residual: np.ndarray, reach: np.ndarray, stiffening: np.ndarray) -> Indentation:
        """Return one indentation that moves with the probe: for a body pressed at one place."""
        return cls(residual, reach, stiffening, np.zeros((1, 3)), 1.0)

    def c_source(self) -> str:
        """Return the step in C99."""
        return Path(__file__).with_suffix(".c").read_text("utf-8")

    def c_arguments(self) -> tuple[np.ndarray, ...]:
        """Return the arrays of that step."""
        return self.compiled()

    def c_size(self) -> int:
        """Return how many numbers the state of that step has, after the four of the ledger."""
        return 2 * len(self.points)

    def start(self) -> IndentationState:
        """Return the state of a virgin body."""
        return IndentationState(self)

    def carry_from(self, other: Memory) -> Carry:
        """Return how residual amplitudes are taken over, each place from the nearest one of the other's.

        Raises
        ------
        UsageError
            If the other memory is no indentation.
        """
        if not isinstance(other, Indentation):
            return super().carry_from(other)
        nearest = nearest_points(self.points, other.points)

        def carry(old: Any, new: Any) -> None:
            new.depths = old.now[nearest]

        return carry

    def spread(self, patches: Patches, spacing: float) -> Indentation:
        """Return the law with indentations at places of the surface.

        Raises
        ------
        UsageError
            If the width is no size for places that far apart.
        """
        if not 0.3 * spacing <= self.width <= 30 * spacing:
            raise UsageError(
                f"Indentations of width {self.width:g} m do not fit places {spacing:g} m apart.",
                why="Narrower ones would fall between the places, wider ones would be felt everywhere.",
                fix="Give a `width` of about half the radius of contact, ½ √(R s), and a spacing of that size.",
            )
        return replace(self, points=patches.points)

    def shares(self, C: np.ndarray) -> np.ndarray:
        """w_j (N, n) of probes' centres C (N, 3), m: p(c) = Σ w_j p_j."""
        square = ((C[:, None] - self.points) ** 2).sum(axis=2)
        weights = np.exp((square.min(axis=1, keepdims=True) - square) / (2.0 * self.width**2))
        return np.asarray(weights / weights.sum(axis=1, keepdims=True))

    def compiled(self) -> tuple[np.ndarray, ...]:
        """(p, Q, κ, points, width), as the kernels take them."""
        return self.residual, self.reach, self.stiffening, self.points, np.array([self.width])


class IndentationState(MemoryState):
    """The state of a body that keeps indentations; `step` allocates nothing.

    Attributes
    ----------
    now : (n,)
        p_j in √J, read-only; overwritten by each step.
    points : (n, 3)
        Where they are, m.

    Parameters
    ----------
    indentation : Indentation
        Its law.
    """

    def __init__(self, indentation: Indentation) -> None:
        super().__init__()
        n = len(indentation.points)
        self.indentation = indentation
        self.points = indentation.points
        self._depths = np.zeros(n)
        self.now = self._depths.view()
        self.now.flags.writeable = False
        self._work = (np.zeros(n), np.zeros(3), np.zeros(3))
        self._constants = indentation.compiled()
        self.step(np.zeros(3), 0.0, np.zeros(3), 0.0)  # compile now, not in the loop
        self.reset()

    def __repr__(self) -> str:
        return (
            f"IndentationState: {self.indentation}; deepest {self.depths.max():.3g} √J, force {self.force} N"
        )

    @property
    def depths(self) -> np.ndarray:
        """p_j (n,) in √J, a copy; setting it goes back to that state, the probe outside."""
        return np.array(self._depths)

    @depths.setter
    def depths(self, depths: np.ndarray) -> None:
        if np.shape(depths) != self._depths.shape or not (np.asarray(depths) >= 0).all():
            raise UsageError(
                f"Depths of shape {np.shape(depths)} are no indentation of this body.",
                fix=f"Give {self._depths.size} numbers that are not negative.",
            )
        self._depths[:] = depths
        self._ledger[0] = 0.0  # the probe is outside
        self.force[:] = 0.0

    def reset(self) -> None:
        """Back to the virgin body, the probe outside."""
        super().reset()
        self._depths[:] = 0.0

    def step(self, position: np.ndarray, amplitude: float, slope: np.ndarray, dt: float) -> bool:
        """Move the probe to a place and renew `force`; see `MemoryState.step`. Yielding knows no time."""
        del dt
        own = self.force, self._ledger, self._depths, self._work, self._constants
        return bool(_step_into(position, amplitude, slope, *own))
