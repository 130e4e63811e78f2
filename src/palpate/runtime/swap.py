"""A swap: another surrogate of the touched body takes the place of the one in the hand, while the loop ticks.

The two energies are blended (`blending`) with b = 3 τ² − 2 τ³, τ from 0 to 1 in a time of at least 0.1 s, so that the
force changes with no jump: in a tick of T seconds by no more than 3 T/(2 t) of the difference between the two forces.

**What blending adds is booked.** In a tick in which b grows by Δb the body gains ΔW = Δb (V_new − V_old), which no hand
has put in. The ledger counts every gain (`PassivityController.added`), so that its promise becomes

    E ≥ U − K Σ (½ + d/T) |Δx|² − Σ max(ΔW, 0)

and what a hand would get back beyond what it gave, E < 0, is damped as anything else is. The gain itself is bounded: in
a contact it may not exceed the energy that the hand has put in, E; beyond that τ goes on more slowly, so that the body
gains no more than 1 mW, of which no hand feels anything. Where nothing is felt τ goes on freely.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from palpate.errors import UsageError
from palpate.runtime.blending import Blend
from palpate.runtime.hand_evaluator import HandEvaluator
from palpate.runtime.realtime import SLOW
from palpate.runtime.shared_state import require_room

if TYPE_CHECKING:
    from palpate.runtime.loop import Loop
    from palpate.runtime.touchable import Touchable
    from palpate.surrogates.memories import Carry

__all__ = ["SECONDS", "SHORTEST", "Swap", "require_blend_time", "require_same_body", "swap_between"]

SECONDS, SHORTEST = 0.2, 0.1  # s that a blend takes by default, and at least
_UNFELT = 1e-3  # W that blending may always add: a slow hand's device takes more by its own damping
_SAME = 1e-9  # of a probe's radius, and of a direction
_FORMS = {"overlap": "contact"}  # of one ball on one body: learning takes the one that misses less


@dataclass(frozen=True, eq=False)
class _Successor:
    """The surrogate that takes over, made before the loop sees it."""

    evaluator: HandEvaluator  # its answer
    carry: Carry | None  # hands the memory on
    stiffness: float  # N/m, its largest, in its own metres; 0 where it isn't known
    # J, difference of the two energies at rest, at further inputs (p,): the energy of a body whose place of rest moves
    # with its other loads counts from anywhere
    gap: Callable[[np.ndarray], float]


def require_blend_time(seconds: float) -> None:
    """Refuse a time of a blend, s, that is too short."""
    if not SHORTEST <= seconds < math.inf:
        raise UsageError(
            f"Two surrogates can't be blended in {seconds:g} s.",
            why="A faster change would be felt as a jump.",
            fix=f"Give at least {SHORTEST:g} s.",
        )


class Swap:
    """One swap, from its first tick to its last; the loop calls `step` at the beginning of each tick.

    `begun` and `ended` are the numbers of the tick with which it began, and of the first that the new surrogate
    answered alone; 0 before. `seconds` is the time of the blend where nothing slows it down, s. `facts` is what the
    loop says of itself to those who record it from then on, empty for nothing new; `rehearse` is called as it begins:
    the rehearsal takes over the new surrogate, too.
    """

    def __init__(self, successor: _Successor, seconds: float = SECONDS) -> None:
        require_blend_time(seconds)
        self.seconds, self.begun, self.ended = seconds, 0, 0
        self.facts = b""
        self.rehearse: Callable[[], None] = lambda: None
        self._next = successor
        self._blend: Blend | None = None
        self._progress, self._added, self._gap = 0.0, 0.0, 0.0
        self._last, self._before = 0.0, 0.0

    def step(self, loop: Loop) -> None:
        """Begin, go on or end, before the tick that begins now."""
        if self._blend is None:
            self._begin(loop)
        elif self._blend.share >= 1.0:
            self._end(loop)
        else:
            self._go_on(loop, self._blend)

    def _begin(self, loop: Loop) -> None:
        old, new = loop.evaluator, self._next
        assert not isinstance(old, Blend)
        new.evaluator.take_over(old, new.carry)
        self._gap = new.gap(loop.parameters)
        self._blend = loop.evaluator = Blend(old, new.evaluator)
        self._last, self._before = loop.now, loop.coupling.hardest
        if self._before > 0.0:
            loop.coupling.hardest = max(self._before, new.stiffness)
        self.rehearse()
        self.begun = loop.out.begin_blend()

    def _go_on(self, loop: Loop, blend: Blend) -> None:
        way = min(max(loop.now - self._last, 0.0), SLOW) / self.seconds
        self._last = loop.now
        gain = blend.gain - self._gap
        free = not (loop.open and blend.force.any())
        if free:
            self._added = 0.0
        progress = min(1.0, self._progress + way)
        change = (_smooth(progress) - blend.share) * gain
        if change > 0.0 and not free:
            room = max(loop.passivity.energy - self._added, _UNFELT * way * self.seconds)
            if change > room:
                change = room
                progress = _progress_at(blend.share + room / gain)
        self._progress, blend.share = progress, _smooth(progress)
        self._added += max(change, 0.0)
        loop.passivity.book(change)
        loop.out.blended(loop.passivity.added)
        if self._before > 0.0:
            loop.take_stiffness((1.0 - blend.share) * self._before + blend.share * self._next.stiffness)

    def _end(self, loop: Loop) -> None:
        assert self._blend is not None
        loop.evaluator = self._next.evaluator
        loop.coupling.proxy += self._blend.shift
        if self._before > 0.0:
            loop.coupling.hardest = self._next.stiffness
        self.ended = loop.out.end_blend()
        if self.facts and loop.recorder is not None:
            loop.recorder.ring.describe_encoded(self.facts)
        loop.swap = None


def _smooth(progress: float) -> float:
    """b at τ: flat at both ends."""
    return progress * progress * (3.0 - 2.0 * progress)


def _progress_at(share: float) -> float:
    """τ at b: the root of b = 3 τ² − 2 τ³ between 0 and 1."""
    return 0.5 - math.sin(math.asin(1.0 - 2.0 * share) / 3.0)


def swap_between(
    old: Touchable, new: Touchable, *, seconds: float = SECONDS, stiffness: float | None = None
) -> Swap:
    """Return the swap that leads a hand from one surrogate of a body to another, blended in `seconds`, at least 0.1 s.

    `stiffness` is the new one's largest, N/m; by default it is worked out. A memory that can't be handed on, or a new
    one that doesn't answer, is refused.
    """
    require_same_body(old, new)
    carry = None
    if old.memory is not None and new.memory is not None:
        carry = new.memory.carry_from(old.memory)
    largest = new.stiffness_max if stiffness is None else stiffness
    if not (math.isfinite(new.force_max) and math.isfinite(largest)):
        raise UsageError(
            f"{new.name} can't take the place of {old.name}.",
            why="Its forces are not all finite.",
            fix="Learn it again.",
        )
    evaluator = new.evaluator()
    require_room(new.name, len(evaluator.loads), len(evaluator.indentation))
    return Swap(_Successor(evaluator, carry, largest, _gap(old, new)), seconds)


def _gap(old: Touchable, new: Touchable) -> Callable[[np.ndarray], float]:
    """Return the function that gives the difference of two energies at rest, J."""
    if not old.holds or old.energy.baseline.amplitude != "none":
        return lambda _: 0.0
    at_rest = np.zeros(len(old.energy.baseline.directions))

    def gap(parameters: np.ndarray) -> float:
        X = np.concatenate([at_rest, parameters])[None]
        return float(new.energy.energy(X)[0] - old.energy.energy(X)[0])

    return gap


def require_same_body(old: Touchable, new: Touchable) -> None:
    """Refuse a surrogate that can't take the place of another one in the hand, with what differs."""
    if why := _difference(old, new):
        raise UsageError(
            f"{new.name} can't take the place of {old.name}, which stays in the hand: {why}.",
            why="Only another surrogate of the same body, in the same hand, can be blended with it.",
            fix="Learn it from solves of the same study; or end the loop and start it with the other body.",
        )


def _difference(old: Touchable, new: Touchable) -> str:
    """Return in words what keeps the second from the first one's place; "" where nothing does."""
    first, second = (_traits(body) for body in (old, new))
    for name, value in first.items():
        if value != second[name]:
            return f"{name} {value} there, and {second[name]} in the new one"
    radii = (old.energy.baseline.radius, new.energy.baseline.radius)
    if abs(radii[0] - radii[1]) > _SAME * radii[0]:
        return f"the probe has {1e3 * radii[0]:g} mm there, and {1e3 * radii[1]:g} mm in the new one"
    if not np.allclose(old.energy.baseline.directions, new.energy.baseline.directions, rtol=0.0, atol=_SAME):
        return "they are felt along other directions"
    return ""


def _traits(body: Touchable) -> dict[str, str]:
    """Return in words what two surrogates of one body have in common."""
    return {
        "the body is": "held" if body.holds else "pressed",
        "the inputs are": ", ".join(f"{r.name} ({r.unit})" if r.unit else r.name for r in body.inputs),
        "the baseline is": _FORMS.get(body.energy.baseline.name, body.energy.baseline.name),
        "the radius of the probe is": "fixed" if body.radius_parameter is None else "an input",
        "the memory is": "none" if body.memory is None else body.memory.name,
        "the loads that draw it are": "none"
        if body.line is None
        else ", ".join(r.name for r in body.line.inputs),
    }
