"""The rest of a held body that a memory moves, and what a body answers along a history of places.

A body that stays bent, or creeps back, lies where the amplitude of its energy is the one at which nothing pulls. The
amplitude grows with the place along the one direction that is felt, so Newton's method finds the place.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from palpate.errors import UsageError

if TYPE_CHECKING:
    from palpate.surrogates.energy import LearntEnergy
    from palpate.surrogates.memories import Memory

__all__ = ["Followed", "MovingRest", "follow"]

_NEWTON, _AT_REST = 12, 1e-12  # steps to a moved rest, and the share of its amplitude to which it is found


class MovingRest:
    """The place `lies` (3,) in m along one direction at which nothing pulls; nothing is allocated.

    `elastic` is the evaluator of the body without its memory. The state `memory` has ``release(dt)``, which returns the
    amplitude of the body that nobody holds. `direction` (3,) is the one felt direction, a unit vector.
    """

    def __init__(self, elastic: Any, memory: Any, direction: np.ndarray) -> None:
        self._elastic, self._memory, self._direction = elastic, memory, direction.tolist()
        self.lies = np.zeros(3)

    def release(self, dt: float, parameters: np.ndarray) -> bool:
        """Let go of the body for dt seconds and find its place; False if that can't be answered."""
        elastic, lies = self._elastic, self.lies
        amplitude = self._memory.release(dt)
        a, b, c = self._direction
        for _ in range(_NEWTON):
            elastic(lies, parameters)
            steepness = a * elastic.slope[0] + b * elastic.slope[1] + c * elastic.slope[2]
            missing = amplitude - elastic.amplitude
            if abs(missing) <= _AT_REST * abs(amplitude) or steepness <= 0.0:
                break
            way = missing / steepness
            lies[0] += way * a
            lies[1] += way * b
            lies[2] += way * c
        return math.isfinite(amplitude)


@dataclass(frozen=True, eq=False)
class Followed:
    """The answer of a body along a history of places."""

    force: np.ndarray  # (N, 3), on the hand, N
    stored: np.ndarray  # (N,), energy that can be had back, J
    lost: np.ndarray  # (N,), energy that can't, J
    # (3,), where the body lies once it is let go at the end, m; zero for one that goes back to rest
    rest: np.ndarray


def follow(
    energy: LearntEnergy, memory: Memory | None, X: np.ndarray, times: np.ndarray | None = None
) -> Followed:
    """Lead a body that nothing was done to along a history; see `palpate.surrogates.Surrogate.follow`."""
    directions, k = energy.baseline.directions, len(energy.baseline.directions)
    X = np.asarray(X, dtype=float)
    times = np.zeros(len(X)) if times is None else np.asarray(times, dtype=float)
    steps = np.diff(times, prepend=0.0)
    if X.ndim != 2 or X.shape[1] != len(energy.inputs) or times.shape != (len(X),) or not (steps >= 0).all():
        raise UsageError(
            f"Places {X.shape} at times {times.shape} are no history of this body.",
            why=f"It has the inputs {', '.join(r.name for r in energy.inputs)}, and time ascends from 0.",
            fix="Give places (N, n) and times (N,) in s.",
        )
    elastic, state = energy.evaluator(), None if memory is None else memory.start()
    force, stored, lost = np.zeros((len(X), 3)), np.zeros(len(X)), np.zeros(len(X))
    further = np.ascontiguousarray(X[:, k:])
    for i, (place, dt) in enumerate(zip(X[:, :k] @ directions, steps, strict=True)):
        elastic(place, further[i])
        if state is None:
            force[i], stored[i] = elastic.force, 0.5 * elastic.amplitude**2
        else:
            state.step(place, elastic.amplitude, elastic.slope, float(dt))
            force[i], stored[i], lost[i] = state.force, state.stored, state.lost
    rest = np.zeros(3)
    if memory is not None and memory.moves_rest and len(X):
        moved = MovingRest(elastic, state, directions[0])
        moved.release(0.0, further[-1])
        rest = moved.lies
    return Followed(force, stored, lost, rest)
