"""Two surrogates of one body in one hand, while the second takes the place of the first.

    V = (1 − b) V_old + b V_new        F = −∂V/∂x = (1 − b) F_old + b F_new        b from 0 to 1

Both are answered, each with its own memory; that of the new one begins with what the old one remembers. At a share b
that stays, V is an energy like theirs: a closed path costs nothing, a memory gives nothing back that it was not given,
and no direction is stiffer than the stiffer of the two. Only a change of b does work that no hand has done,

    dW = (V_new − V_old) db

and `Swap` books it.
"""

from __future__ import annotations

import math

import numpy as np

from palpate.kernels import kernel
from palpate.runtime.hand_evaluator import HandEvaluator, stiffness_along

__all__ = ["Blend", "compile_blend"]


class Blend:
    """Answers a hand as `HandEvaluator` does, by an old one and a new one that took over from it; nothing is allocated.

    Its attributes are those of `HandEvaluator`; what can't be mixed is that of the surrogate with the larger share.
    `share` is b, the new surrogate's. `shift` (3,), m, is by how much the place of the new one lies beside that of the
    old: where nobody holds a body that lies elsewhere after a touch, each lies in its own place.
    """

    def __init__(self, old: HandEvaluator, new: HandEvaluator) -> None:
        self._old, self._new, self.share = old, new, 0.0
        self.force, self.tangent, self.torque = np.zeros(3), np.zeros((3, 3)), np.zeros(3)
        self.contact, self.loads = np.zeros(3), np.zeros(len(new.loads))
        self.shift, self._place = np.zeros(3), np.zeros(3)
        self.away, self.indentation = old.away, new.indentation
        self.inside, self.let_go, self.waiting = old.inside, old.let_go, old.waiting
        self.depth, self.stiffness, self.elapsed = old.depth, old.stiffness, 0.0
        self.grew, self.rest_zone = False, new.rest_zone
        self._published = False
        compile_blend()

    @property
    def holds(self) -> bool:
        """True where the hand holds a patch or a node, and doesn't move a free probe."""
        return self._new.holds

    @property
    def remembers(self) -> bool:
        """True for a body with a memory, which each call takes further."""
        return self._new.remembers

    @property
    def stored(self) -> float:
        """Energy, J, that the blend holds at the last call."""
        return (1.0 - self.share) * self._old.stored + self.share * self._new.stored

    @property
    def gain(self) -> float:
        """V_new − V_old at the last call, J."""
        return self._new.stored - self._old.stored

    def place(self, position: np.ndarray, *, holding: bool, believed: bool) -> None:
        """Turn the hand's place (3,), m, into that of the probe or of what it holds; see `HandEvaluator.place`."""
        self._place[:] = position
        self._new.place(self._place, holding=holding, believed=believed)
        self._old.place(position, holding=holding, believed=believed)
        np.subtract(self._place, position, out=self.shift)

    def release(self) -> None:
        """Let go of the hand until it is where the body holds no energy."""
        self._old.release()
        self._new.release()
        self.waiting = True

    def __call__(self, position: np.ndarray, parameters: np.ndarray) -> None:
        """Renew the attributes for a probe or a held place at `position` (3,), m, and the further inputs (p,)."""
        old, new, share = self._old, self._new, self.share
        old.elapsed = new.elapsed = self.elapsed
        old(position, parameters)
        np.add(position, self.shift, out=self._place)
        new(self._place, parameters)
        _mix(share, old.force, new.force, old.tangent, new.tangent, self.force, self.tangent)
        for mixed, first, second in (
            (self.contact, old.contact, new.contact),
            (self.loads, old.loads, new.loads),
            (self.torque, old.torque, new.torque),
        ):
            np.subtract(second, first, out=mixed)
            mixed *= share
            mixed += first
        leading = new if share >= 0.5 else old
        self.inside, self.let_go = leading.inside, leading.let_go
        self.waiting = old.waiting or new.waiting
        known = math.isfinite(old.depth) and math.isfinite(new.depth)
        self.depth = (1.0 - share) * old.depth + share * new.depth if known else new.depth
        self.stiffness = stiffness_along(self.force, self.tangent)
        self.grew = new.grew or (not self._published and len(self.indentation) > 0)
        self._published = True


def compile_blend() -> None:
    """Compile what a blend calls, so that none does so in a tick."""
    _mix(0.0, np.zeros(3), np.zeros(3), np.zeros((3, 3)), np.zeros((3, 3)), np.zeros(3), np.zeros((3, 3)))


@kernel
def _mix(share, old, new, old_tangent, new_tangent, force, tangent) -> None:  # type: ignore[no-untyped-def]  # noqa: ANN001
    """Fill the mean of two forces (3,) and two tangents (3, 3), the second with a share of 0 to 1."""
    for i in range(3):
        force[i] = (1.0 - share) * old[i] + share * new[i]
        for j in range(3):
            tangent[i, j] = (1.0 - share) * old_tangent[i, j] + share * new_tangent[i, j]
