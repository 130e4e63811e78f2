"""Iwan elements: springs in parallel that slip or relax, the memory of a body that is held and bent.

Let q be the signed amplitude in which the elastic energy of a held body is ½ q². Its unit stiffness is shared out among
elements in parallel, each a spring of the elongation e_i with a slider or a dashpot in series:

    force of all        f = Σ k_i e_i                       energy stored   V = Σ ½ k_i e_i²
    a spring            ė_i = q̇
    a slider            ė_i = q̇ − ṗ_i,  |e_i| ≤ y_i + c_i α_i,  α̇_i = |ṗ_i|, and ṗ_i e_i ≥ 0
    a dashpot           ė_i = q̇ − e_i/τ_i

    F = −Σ k_i e_i ∇q

so that without memory F = −∂U/∂x. Sliders are the model of Prandtl 1928 and Iwan 1966 with isotropic hardening c_i;
dashpots that of Maxwell, in parallel a Prony series. Whatever the numbers, as long as k_i, y_i, c_i, τ_i are not
negative,

    work of the hand = change of V + lost        lost = Σ ∫ k_i (y_i + c_i α_i) |ṗ_i| + k_i e_i²/τ_i dt ≥ 0

so nothing can be had back that was not put in; where nothing slips or relaxes the force is the gradient of V at kept
memory, and a closed path takes nothing.

**A step** in which q changes evenly is integrated exactly: a slider's elongation is the return mapping of the end
point (Wilkins 1964), as its path has one direction, and a dashpot's is e^{−x} e + (1 − e^{−x})/x Δq with x = Δt/τ
(Taylor, Pister & Goudreau 1970). So any length of step is stable.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from palpate.checks import own_arrays
from palpate.errors import UsageError
from palpate.kernels import kernel, part
from palpate.surrogates.memories.memory import Amplitude, Carry, Memory, MemoryState, register_memory

__all__ = ["IwanElements", "IwanMemento", "IwanState", "advance", "free_step"]

_HALVINGS = 80  # halvings in the search for the free state, to the last bit of any bracket


@part
def _after(e, alpha, dh, dt, y, c, tau):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Elongation and slip of one element after an even step."""
    if tau < math.inf:
        x = min(dt / tau, 700.0)
        mean = -math.expm1(-x) / x if x > 0.0 else 1.0
        return e * math.exp(-x) + mean * dh, 0.0
    trial = e + dh
    over = abs(trial) - y - c * alpha
    if over <= 0.0:
        return trial, 0.0
    slip = over / (1.0 + c)
    return (trial - slip if trial > 0.0 else trial + slip), slip


@part
def _lost(e, alpha, slip, dh, dt, k, y, c, tau):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Energy that one element turns into heat during an even step, J; never negative."""
    if tau < math.inf:
        x = min(dt / tau, 700.0)
        if x <= 0.0:
            return 0.0
        # e(t) = A exp(−t/τ) + B
        B = dh / x
        A = e - B
        once, twice = -math.expm1(-x), -math.expm1(-2.0 * x)
        return max(k * (0.5 * A * A * twice + 2.0 * A * B * once + B * B * x), 0.0)
    if slip == 0.0:  # a spring's limit is infinite
        return 0.0
    return k * slip * (y + c * (alpha + 0.5 * slip))


@part
def _pull_after(dh, dt, e, alpha, k, y, c, tau) -> float:  # type: ignore[no-untyped-def]  # noqa: ANN001
    """Σ k e, N, after an even step that is not taken."""
    pull = 0.0
    for i in range(k.size):
        pull += k[i] * _after(e[i], alpha[i], dh, dt, y[i], c[i], tau[i])[0]
    return float(pull)


@kernel
def advance(dh, dt, e, alpha, ledger, k, y, c, tau) -> float:  # type: ignore[no-untyped-def]  # noqa: ANN001
    """Take an even step; returns Σ k e, N. The ledger has stored, lost, work and lost in this step, J."""
    before, stored, lost, pull = ledger[0], 0.0, 0.0, 0.0
    for i in range(k.size):
        after, slip = _after(e[i], alpha[i], dh, dt, y[i], c[i], tau[i])
        lost += _lost(e[i], alpha[i], slip, dh, dt, k[i], y[i], c[i], tau[i])
        e[i], alpha[i] = after, alpha[i] + slip
        stored += 0.5 * k[i] * after * after
        pull += k[i] * after
    ledger[0] = stored
    ledger[1] += lost
    ledger[2] += stored - before + lost
    ledger[3] = lost
    return float(pull)


@kernel
def free_step(dt, e, alpha, k, y, c, tau) -> float:  # type: ignore[no-untyped-def]  # noqa: ANN001
    """Change of h, m, after which nothing pulls: the force grows with h, so halving an interval finds it."""
    reach = 0.0
    for i in range(k.size):
        reach = max(reach, abs(e[i]))
    # by then every spring pushes the other way; one that relaxes meanwhile may need more
    low, high = -reach, reach
    for _ in range(_HALVINGS):
        if _pull_after(low, dt, e, alpha, k, y, c, tau) <= 0.0:
            break
        low *= 2.0
    for _ in range(_HALVINGS):
        if _pull_after(high, dt, e, alpha, k, y, c, tau) >= 0.0:
            break
        high *= 2.0
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        if _pull_after(middle, dt, e, alpha, k, y, c, tau) > 0.0:
            high = middle
        else:
            low = middle
    return float(0.5 * (low + high))


@kernel(allocates=True)
def _follow(stretch, steps, k, y, c, tau) -> np.ndarray:  # type: ignore[no-untyped-def]  # noqa: ANN001
    """Elongations (N, n) along a history."""
    e, alpha, out = np.zeros(k.size), np.zeros(k.size), np.zeros((stretch.size, k.size))
    last = 0.0
    for t in range(stretch.size):
        dh = stretch[t] - last
        last = stretch[t]
        for i in range(k.size):
            e[i], slip = _after(e[i], alpha[i], dh, steps[t], y[i], c[i], tau[i])
            alpha[i] += slip
            out[t, i] = e[i]
    return out


@register_memory
@dataclass(frozen=True, eq=False)
class IwanElements(Memory):
    """Springs in parallel, some with a slider, some with a dashpot.

    Attributes
    ----------
    stiffness : (n,)
        k_i, shares of the unit stiffness in q, positive.
    limit : (n,)
        y_i, the elongation at which it first slips, √J; infinite for springs and dashpots.
    hardening : (n,)
        c_i, by how much the limit grows for each √J of slip; a pure number.
    time : (n,)
        τ_i, s; infinite for springs and sliders.

    Raises
    ------
    UsageError
        If a number has no meaning, or an element both slips and relaxes.
    """

    name: ClassVar[str] = "iwan-elements"
    walks: ClassVar[frozenset[Amplitude]] = frozenset({"signed"})
    moves_rest: ClassVar[bool] = True

    stiffness: np.ndarray
    limit: np.ndarray
    hardening: np.ndarray
    time: np.ndarray

    def __post_init__(self) -> None:
        own_arrays(self, "stiffness", "limit", "hardening", "time")
        n = self.stiffness.shape
        shaped = len(n) == 1 and n[0] > 0 and self.limit.shape == self.hardening.shape == self.time.shape == n
        sound = shaped and bool(
            (np.isfinite(self.stiffness) & (self.stiffness > 0)).all()
            and (np.isfinite(self.hardening) & (self.hardening >= 0)).all()
            and (self.limit > 0).all()
            and (self.time > 0).all()
            and (np.isinf(self.limit) | np.isinf(self.time)).all()
        )
        if not sound:
            raise UsageError(
                f"These are no elements: stiffness {self.stiffness}, limit {self.limit}, hardening {self.hardening}, "
                f"time {self.time}.",
                why="Each needs a positive stiffness, and a positive limit or a positive time or neither.",
                fix="Use infinity for a limit or a time that an element hasn't.",
            )

    @classmethod
    def sliders(cls, stiffness: np.ndarray, limit: np.ndarray, hardening: np.ndarray) -> IwanElements:
        """Return springs that slip; those of infinite limit don't."""
        return cls(stiffness, limit, hardening, np.full(len(np.atleast_1d(stiffness)), math.inf))

    @classmethod
    def dashpots(cls, stiffness: np.ndarray, time: np.ndarray) -> IwanElements:
        """Return springs that relax; those of infinite time don't."""
        n = len(np.atleast_1d(stiffness))
        return cls(stiffness, np.full(n, math.inf), np.zeros(n), time)

    def __len__(self) -> int:
        return len(self.stiffness)

    def __str__(self) -> str:
        slip, relax = int(np.isfinite(self.limit).sum()), int(np.isfinite(self.time).sum())
        kinds = [f"{slip} that slip" if slip else "", f"{relax} that relax" if relax else ""]
        return f"{len(self)} springs, " + (
            " and ".join(kind for kind in kinds if kind) or "none with a memory"
        )

    @property
    def total(self) -> float:
        """Σ k_i: the virgin body's share of its elastic stiffness, 1 where the elements add up to it."""
        return float(self.stiffness.sum())

    @property
    def first_slip(self) -> float:
        """Amplitude of a virgin body at which something slips, √J."""
        return float(self.limit.min())

    def compiled(self) -> tuple[np.ndarray, ...]:
        """(k, y, c, τ), as the kernels take them."""
        return self.stiffness, self.limit, self.hardening, self.time

    def elongations(self, stretch: np.ndarray, times: np.ndarray | None = None) -> np.ndarray:
        """Return e (N, n), √J, along a history of q (N,), √J, from rest; times (N,) in s if something relaxes.

        Between two samples q changes evenly.

        Raises
        ------
        UsageError
            If something relaxes and the times don't fit.
        """
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
        return np.asarray(_follow(stretch, steps, *self.compiled()))

    def carry_from(self, other: Memory) -> Carry:
        """Return how elongations and slips are taken over, element by element.

        Raises
        ------
        UsageError
            If the other memory has no such elements, or another number of them.
        """
        if not isinstance(other, IwanElements):
            return super().carry_from(other)
        if len(other) != len(self):
            raise UsageError(
                f"What {len(other)} elements remember can't be handed on to {len(self)}.",
                fix="Learn the new body with as many elements.",
            )

        def carry(old: Any, new: Any) -> None:
            new.memento = old.memento

        return carry

    def c_source(self) -> str:
        """Return the step in C99."""
        return Path(__file__).with_suffix(".c").read_text("utf-8")

    def c_arguments(self) -> tuple[np.ndarray, ...]:
        """Return the arrays of that step."""
        return self.compiled()

    def c_size(self) -> int:
        """Return how many numbers the state of that step has, after the four of the ledger."""
        return 1 + 2 * len(self)

    def c_states(self) -> tuple[tuple[str, ...], ...] | None:
        """Return the names of a_i, the amplitude that dashpot i has given way by; None where an element slips."""
        if np.isfinite(self.limit).any():
            return None
        return tuple((f"a_{i + 1}",) for i in np.flatnonzero(np.isfinite(self.time)))

    def start(self) -> IwanState:
        """Return the state of a virgin body."""
        return IwanState(self)


@dataclass(frozen=True, eq=False)
class IwanMemento:
    """All that the future of a held body depends on, and its energies so far."""

    amplitude: float  # q, √J
    elongation: np.ndarray  # (n,), e_i, √J
    slipped: np.ndarray  # (n,), α_i, √J
    ledger: np.ndarray  # (4,), stored, lost, work of the hand, and lost in the last step, J


class IwanState(MemoryState):
    """The state of a held body that remembers; `step` and `release` allocate nothing.

    Attributes
    ----------
    amplitude : float
        q after the last step, √J.

    Parameters
    ----------
    elements : IwanElements
        Its law.
    """

    def __init__(self, elements: IwanElements) -> None:
        super().__init__()
        n = len(elements)
        self.elements, self.amplitude = elements, 0.0
        self._state = (np.zeros(n), np.zeros(n))
        self._constants = elements.compiled()
        self.step(np.zeros(3), 0.0, np.zeros(3), 0.0)  # compile now, not in the loop
        self.release(0.0)
        self.reset()

    def __repr__(self) -> str:
        return f"IwanState: {self.elements}; force {self.force} N, stored {self.stored:.3g} J"

    def reset(self) -> None:
        """Go back to the virgin body."""
        super().reset()
        for array in self._state:
            array[...] = 0.0
        self.amplitude = 0.0

    def step(self, position: np.ndarray, amplitude: float, slope: np.ndarray, dt: float) -> bool:
        """Move the hand evenly in q and renew `force`; see `MemoryState.step`."""
        change = amplitude - self.amplitude
        self.force[:] = 0.0
        if not (math.isfinite(change) and math.isfinite(dt) and dt >= 0.0):
            return False
        self.amplitude = amplitude
        pull = advance(change, dt, *self._state, self._ledger, *self._constants)
        for i in range(3):
            self.force[i] = -pull * slope[i]
        return True

    def release(self, dt: float) -> float:
        """Let go for dt seconds; return the amplitude to which the body moves, √J, where nothing pulls."""
        change = free_step(dt, *self._state, *self._constants)
        advance(change, dt, *self._state, self._ledger, *self._constants)
        self.amplitude += change
        self.force[:] = 0.0
        return self.amplitude

    @property
    def memento(self) -> IwanMemento:
        """A copy of the memory; setting it goes back to that moment."""
        e, alpha = self._state
        return IwanMemento(self.amplitude, e.copy(), alpha.copy(), self._ledger.copy())

    @memento.setter
    def memento(self, memento: IwanMemento) -> None:
        e, alpha = self._state
        if memento.elongation.shape != e.shape or memento.slipped.shape != e.shape:
            raise UsageError(
                f"This memory has {memento.elongation.size} elements, the body {e.size}.",
                fix="Use a memento of the same body.",
            )
        self.amplitude = memento.amplitude
        e[:], alpha[:], self._ledger[:] = memento.elongation, memento.slipped, memento.ledger
