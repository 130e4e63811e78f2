"""A held body that remembers, one step at a time: what the 1 kHz path calls."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numba import njit

from palpate.errors import UsageError
from palpate.network.network_kernels import value_and_jacobian_into, value_into
from palpate.surrogates.memories.iwan_elements import advance, free_step

if TYPE_CHECKING:
    from palpate.surrogates.plastic.held_body import HeldBody

__all__ = ["HeldEvaluator", "HeldState"]

_NONE = np.zeros(0)


@dataclass(frozen=True, eq=False)
class HeldState:
    """All that the future of a held body depends on, and the energies so far.

    Attributes
    ----------
    position : float
        w in m.
    elongation, slipped : (n,)
        e_i and α_i in m.
    ledger : (4,)
        Stored, lost, work of the hand, and lost in the last step, J.
    """

    position: float
    elongation: np.ndarray
    slipped: np.ndarray
    ledger: np.ndarray


class HeldEvaluator:
    """Hand position in, force out, with a memory; nothing is allocated per step.

    Made by `HeldBody.evaluator`; one evaluator serves one thread at a time.

    Attributes
    ----------
    force : (3,)
        On the hand, N.
    contact : (3,)
        Where the held node is, as an offset from its rest position, m.
    loads : (2,)
        w in m and P in N: input of `HeldBody.displacement`.
    inside : bool
        Whether the hand is inside the trained range.
    mirrored : bool
        Always False: both sides are one body.
    period : float
        Seconds that a call takes; the loop's own.
    """

    def __init__(self, body: HeldBody, *, period: float = 1e-3) -> None:
        n = len(body.elements)
        self.force, self.contact, self.loads = np.zeros(3), np.zeros(3), np.zeros(2)
        self.inside, self.mirrored, self.period = True, False, period
        self._state = (np.zeros(1), np.zeros(n), np.zeros(n), np.zeros(4))  # w, e, α, ledger
        self._work = (np.zeros(1), np.zeros(1), np.zeros((1, 1)), np.zeros(2), np.zeros(2))
        held = slice(2 * body.touch_node, 2 * body.touch_node + 2)
        low, high = (np.array([getattr(r, end) for r in body.shape.inputs]) for end in ("low", "high"))
        edge = body.stretch.inputs[0]
        self._shape = (0.0, math.sqrt(edge.high), True) if body.mirrors else (edge.low, edge.high, False)
        self._nets = (body.stretch.compiled(), body.shape.select(held).compiled(), low, high)
        self._direction = np.ascontiguousarray(body.directions[0], dtype=np.float64)
        self._elements = body.elements.compiled()
        # compile now, not in the loop
        self.step(np.zeros(3), 0.0)
        self.release(0.0)
        self.reset()

    def __repr__(self) -> str:
        where = "inside" if self.inside else "outside"
        return f"HeldEvaluator: force {self.force} N, contact {self.contact} m, {where} the trained range"

    def __call__(self, position: np.ndarray, parameters: np.ndarray = _NONE) -> None:
        """Move the hand within `period` seconds; see `step`.

        Raises
        ------
        UsageError
            If there are not three coordinates, or there are parameters.
        """
        if np.shape(parameters) != (0,):
            raise UsageError(
                f"A held body takes no parameters; {np.shape(parameters)} came.", fix="Leave them out."
            )
        self.step(position, self.period)

    def step(self, position: np.ndarray, dt: float) -> bool:
        """Move the hand evenly to a position within dt seconds, and renew the attributes.

        Parameters
        ----------
        position : (3,) float64
            Offset of the hand from the held node's rest position, m; only its part along the load counts.
        dt : float
            In s; 0 is an instant.

        Returns
        -------
        bool
            False if a number is not finite or dt negative: the force is zero then, and nothing has changed.

        Raises
        ------
        UsageError
            If there are not three coordinates.
        """
        position = np.asarray(position, np.float64)
        if position.shape != (3,):
            raise UsageError(
                f"A hand at {position.shape} can't be answered.", fix="Give a position (3,) in m."
            )
        w = float(self._direction @ position)
        return self._move(w, dt, _HELD)

    def release(self, dt: float | None = None) -> bool:
        """Let go for dt seconds, by default `period`: the body moves to where nothing pulls, and stays bent there.

        Afterwards `loads[0]` and `contact` say where the held node is, and the force is zero.
        """
        return self._move(0.0, self.period if dt is None else dt, _FREE)

    def stretch_at(self, w: float) -> tuple[float, float]:
        """h in m and dh/dw at w in m; changes nothing."""
        at = self._work[3]
        _stretch_into(w, at, self._shape, self._work, self._nets[0])
        return float(at[0]), float(at[1])

    def reset(self) -> None:
        """Back to the virgin body."""
        for array in (*self._state, self.force):
            array[...] = 0.0
        self._move(0.0, 0.0, _HELD)

    @property
    def state(self) -> HeldState:
        """A copy of the memory; setting it goes back to that moment."""
        w, e, alpha, ledger = self._state
        return HeldState(float(w[0]), e.copy(), alpha.copy(), ledger.copy())

    @state.setter
    def state(self, state: HeldState) -> None:
        w, e, alpha, ledger = self._state
        if state.elongation.shape != e.shape or state.slipped.shape != e.shape:
            raise UsageError(
                f"This memory has {state.elongation.size} elements, the body {e.size}.",
                fix="Use a state of the same body.",
            )
        w[0], e[:], alpha[:], ledger[:] = (
            state.position,
            state.elongation,
            state.slipped,
            state.ledger,
        )
        self._move(state.position, 0.0, _HELD)
        ledger[:] = state.ledger

    @property
    def stored(self) -> float:
        """V in J: the most that the body can give back."""
        return float(self._state[3][0])

    @property
    def lost(self) -> float:
        """Energy turned into heat so far, J; all plastic work counts as such."""
        return float(self._state[3][1])

    @property
    def work(self) -> float:
        """Work of the hand so far, J, along even paths of the stretch: stored + lost."""
        return float(self._state[3][2])

    @property
    def lost_in_step(self) -> float:
        """Energy turned into heat in the last step, J; never negative."""
        return float(self._state[3][3])

    def _move(self, w: float, dt: float, how: int) -> bool:
        flags = _move(
            w,
            dt,
            how,
            self._direction,
            (self.force, self.contact, self.loads),
            self._state,
            self._shape,
            self._work,
            self._nets,
            self._elements,
        )
        self.inside = flags == _GOOD
        return bool(flags != _REFUSED)


_HELD, _FREE = 0, 1
_GOOD, _OUTSIDE, _REFUSED = 0, 1, 2
_jit = njit(cache=True, nogil=True, error_model="numpy")
_NEWTON = 60  # steps to the w of a stretch; halving an interval takes over where they leave it


@_jit
def _stretch_into(w, out, shape, work, net) -> bool:  # type: ignore[no-untyped-def]  # noqa: ANN001
    """h and h' at w into out (2,); False beyond the trained range, where h goes on along its tangent."""
    low, high, mirrors = shape
    x, value, slope, _, _ = work
    asked = abs(w) if mirrors else w
    at = min(max(asked, low), high)
    x[0] = at * at if mirrors else at
    value_and_jacobian_into(x, value, slope, *net)
    factor, share = math.exp(value[0]), x[0] * slope[0, 0]
    h, rise = at * factor, factor * (1.0 + (2.0 * share if mirrors else share))
    h += rise * (asked - at)
    out[0] = -h if mirrors and w < 0.0 else h
    out[1] = rise
    return bool(abs(asked - at) <= 1e-9 * (high - low))


@_jit
def _place_of(h, guess, shape, work, net) -> float:  # type: ignore[no-untyped-def]  # noqa: ANN001
    """The w of a stretch h, by Newton's iteration: h grows with w and is close to it."""
    w, at = guess, work[4]
    for _ in range(_NEWTON):
        _stretch_into(w, at, shape, work, net)
        change = (h - at[0]) / at[1]
        w += change
        if abs(change) <= 1e-15 * (abs(w) + abs(guess)):
            break
    return float(w)


@_jit
def _move(w, dt, how, direction, answer, state, shape, work, nets, elements) -> int:  # type: ignore[no-untyped-def]  # noqa: ANN001
    force, contact, loads = answer
    last, e, alpha, ledger = state
    stretch_net, tip_net, low, high = nets
    force[:] = 0.0
    if not (math.isfinite(w) and math.isfinite(dt) and dt >= 0.0):
        return 2
    at = work[3]
    _stretch_into(last[0], at, shape, work, stretch_net)
    before = at[0]
    if how == 1:
        dh = free_step(dt, e, alpha, *elements)
        w = _place_of(before + dh, last[0], shape, work, stretch_net)
        inside = _stretch_into(w, at, shape, work, stretch_net)
        advance(dh, dt, e, alpha, ledger, *elements)
        pull = 0.0
    else:
        inside = _stretch_into(w, at, shape, work, stretch_net)
        pull = advance(at[0] - before, dt, e, alpha, ledger, *elements) * at[1]
    last[0] = w
    for a in range(3):
        force[a] = -pull * direction[a]
    # the picture's inputs are held in their trained range, the force's are not
    loads[0], loads[1] = min(max(w, low[0]), high[0]), min(max(pull, low[1]), high[1])
    value_into(loads, at, *tip_net)
    contact[0], contact[1], contact[2] = at[0], at[1], 0.0
    loads[0], loads[1] = w, pull
    return 0 if inside else 1
