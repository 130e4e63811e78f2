"""A body pressed at one place after another, without allocation: what the loop calls."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from palpate.surrogates import SurrogateEvaluator
from palpate.surrogates.plastic import DentMemory
from palpate.surrogates.relaxation import Memory

__all__ = ["PressedEvaluator"]

# slope of d: 1 for a distance, measured 1.0004 at most where five bodies are pressed; behind flat ones it is 6 at s = 0
_STEEP = 1.2

_jit = njit(cache=True, nogil=True, error_model="numpy")


class PressedEvaluator:
    """Answers a probe's centre; nothing is allocated.

    Farther inside than the distance to the touched surface is known, and where it turns back behind the body, the body
    lets go: no force, until the probe has been in the air. An energy can't end there without pulling the hand in;
    ending so loses energy and makes none. A probe that comes from behind meets nothing until it was in front.

    Attributes
    ----------
    force : (3,)
        On the probe, N.
    contact : (3,)
        The probe's centre, m.
    loads : (0,)
        None: the body is held by nothing but the probe.
    inside : bool
        Within the trained region.
    mirrored : bool
        Never.
    let_go : bool
        Whether the body has let go of a probe that is still in it.
    depth : float
        Of the rigid probe in the surface at rest, m; negative without contact, zero for a probe that was let go.
    stiffness : float
        Along the force, −F·(∂F/∂c)F/‖F‖², N/m, of the elastic answer; zero without contact.
    elapsed : float
        Since the call before, s, to be set ahead of each call where the body has a memory.
    away : (3,)
        Where a probe is that nobody holds, m.
    prints : (n,)
        Amplitude of the print at each place that keeps one, √J; empty for a body that keeps none.

    Parameters
    ----------
    elastic : SurrogateEvaluator
    memory : Memory or DentMemory, optional
    away : (3,)
        See above.
    normal : (3,)
        Outer normal of the surface where it is usually touched.
    inner : float
        How far inside the surface the probe's centre may go, m.
    radius : float
        Of the probe, m, unless it is among the further inputs.
    radius_input : int, optional
        Which of the further inputs it is.
    """

    def __init__(
        self,
        elastic: SurrogateEvaluator,
        memory: Memory | DentMemory | None,
        away: np.ndarray,
        normal: np.ndarray,
        inner: float,
        radius: float,
        radius_input: int | None = None,
    ) -> None:
        self._elastic, self._memory = elastic, memory
        self._yielding = memory if isinstance(memory, DentMemory) else None
        self.prints = np.zeros(0) if self._yielding is None else self._yielding.now
        self.force = elastic.force if memory is None else memory.force
        self._slope = np.zeros(3)
        self.contact, self.loads, self.away = np.zeros(3), np.zeros(0), away
        self._normal = normal
        self._inner, self._radius, self._radius_input = inner, radius, radius_input
        self.inside, self.mirrored, self.let_go = True, False, False
        self.depth, self.stiffness, self.elapsed = -math.inf, 0.0, 0.0
        _along(elastic.force, elastic.stiffness)  # compile now, not in the loop
        _behind(elastic.outward, normal)

    def place(self, position: np.ndarray, *, holding: bool, believed: bool) -> None:
        """Keep a probe that nobody holds `away`: a way back to the centre could lead through the body."""
        del believed  # what can't be believed isn't answered
        if not holding:
            position[:] = self.away

    @property
    def grew(self) -> bool:
        """Whether the last call made a print grow."""
        return self._yielding is not None and self._yielding.lost_in_step > 0.0

    def __call__(self, position: np.ndarray, parameters: np.ndarray) -> None:
        """Renew the attributes for a probe at `position` (3,), m, and the further inputs (p,)."""
        elastic, memory = self._elastic, self._memory
        elastic(position, parameters)
        self.contact[:] = position
        self._judge(elastic.depth, parameters)
        energy = elastic.energy
        if self.let_go:
            energy = 0.0
            elastic.force[:] = 0.0
        self.inside = elastic.inside and not self.let_go
        self.depth = 0.0 if self.let_go else elastic.depth
        self.stiffness = _along(elastic.force, elastic.stiffness)
        if memory is None:
            return
        np.negative(elastic.force, out=self._slope)
        if not memory.step(position, energy, self._slope, self.elapsed):
            self.force[:] = math.nan  # the loop makes a fault of it

    def _judge(self, depth: float, parameters: np.ndarray) -> None:
        """Let go, or hold again."""
        own = self._radius_input
        radius = self._radius if own is None else parameters[own]
        if depth <= 0.0:
            self.let_go = False
        elif depth > self._inner + radius or _behind(self._elastic.outward, self._normal):
            self.let_go = True


@_jit
def _along(force, stiffness) -> float:  # type: ignore[no-untyped-def]  # noqa: ANN001
    size, total = 0.0, 0.0
    for i in range(3):
        size += force[i] * force[i]
        for j in range(3):
            total -= force[i] * stiffness[i, j] * force[j]
    return total / size if size > 0.0 else 0.0


@_jit
def _behind(slope, normal) -> bool:  # type: ignore[no-untyped-def]  # noqa: ANN001
    """Whether d climbs towards the back, and faster than a distance does."""
    square, out = 0.0, 0.0
    for i in range(3):
        square += slope[i] * slope[i]
        out += slope[i] * normal[i]
    return out < 0.0 and square > _STEEP * _STEEP
