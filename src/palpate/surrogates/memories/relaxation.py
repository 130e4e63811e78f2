"""Relaxation: forces that fall while they are held, by branches in parallel to the elastic answer.

A held probe feels its force fall to the share g(t) = γ_∞ + Σ γ_i exp(−t/τ_i), with γ_∞ + Σ γ_i = 1. The shares are
those of the *force on the probe*: what doesn't relax, a pad or the volumetric stiffness, makes them smaller than the
material's own.

**A pad in series** doesn't relax and takes the larger share of the compliance the lighter the touch. With U_a the
elastic energy at which pad and body give way alike, the body's share of the compliance is

    β² = 1/(1 + (U_a/U)^(1/6))

because a pad's energy grows with the cube of the depth and a Hertzian body's with its power 5/2: the ratio of their
stiffnesses goes with the root of the depth, that is with U^(1/6). Shares and times are then those of the body behind
the pad, and the share left of a held force is

    g(t) = (1 − u) (1 − u (1 − β²)/6)        u = b (Σγ_i − γᵀ exp(A t) 1)        b = β²/(1 − (1 − β²) Σγ_i)

with A = T⁻¹ ((1 − β²) 1 γᵀ − I), T = diag(τ_i), where the second factor comes from β growing with the depth.

**The model.** The elastic answer at the probe's centre c has the amplitude q = √(2U) and its slope ∇q. With patches of
the touched surface and their patterns e_j(c) (`patches`, Σ e_j² = 1), the probe asks the amplitude φ_j = q e_j of patch
j. Each branch i remembers an amplitude z_ij. The body itself takes the amplitude p_j of least energy, behind its pad
and free to stay deeper than the probe, since tissue doesn't stick:

    V = min over p of Σ_j [ ½ β²/(1 − β²) (φ_j/β − p_j)₊² + ½ γ_∞ p_j² + Σ_i ½ γ_i (p_j − z_ij)² ]
      = Σ_j [ ½ (φ_j − β Y_j)₊² + ½ Σ_i γ_i z_ij² − ½ Y_j² ]        Y_j = Σ_i γ_i z_ij

    F = −∂V/∂c        τ_i ż_ij = p_j − z_ij

Without memory V = U. Without a pad β = 1, and a probe that is pressed in and held feels its force relax by the Prony
series exactly. A single patch gives the scalar form F = −[γ_∞ q + Σγ_i (q − z_i)]₊ ∇q. V ≥ 0 because
Y_j² ≤ Σγ_i z_ij². At U → 0 the slope ∇q = ∇U/q is finite for every contact law (U ~ s², s^{5/2}, s³), the force zero.

**Passive.** V is the least of functions that are convex in (p, z), hence convex in z, and ż_ij = −(∂V/∂z_ij)/(γ_i τ_i):
at a probe that stays, V can only fall. While it moves, dV/dt = −F·ċ − Σ γ_i (p_j − z_ij)²/τ_i.

**A step** moves the probe at once in between two holds. In a hold of Δ seconds p minimises

    V(p, z) + Σ ½ γ_i (z_i − z_i⁰)²/r_i        r_i = 1/k_i − 1        z_i = p + k_i (z_i⁰ − p)

with k_i = exp(−Δ/τ_i). It is exact for a patch under the probe without a pad, and lowers V for every k_i in (0, 1],
for any patch and pad. With the holds' k_i = e_i/a_i and a_i, where e_i = exp(−Δ/τ_i) and a_i = (1 − e_i) τ_i/Δ for the
whole step Δ, a press that grows evenly in φ during the step is exact as well (Taylor, Pister & Goudreau 1970). Where
patches recover, or behind a pad, the error is of first order in Δ/τ; steps longer than τ/10 are split. So work, stored
and lost energy close to rounding at any step, work being that of the moves, V(c₁, z) − V(c₀, z): it differs from a
trapezoid of the forces at the samples by terms of second order in the step over the whole motion.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from palpate.errors import UsageError
from palpate.surrogates.memories.memory import Carry, Memory, MemoryState, amplitudes, register_memory
from palpate.surrogates.memories.patches import Patches, nearest_points
from palpate.surrogates.memories.relaxation_kernels import step_into

__all__ = ["Course", "Relaxation", "RelaxationState", "course"]


@register_memory
@dataclass(frozen=True, eq=False)
class Relaxation(Memory):
    """Shares of the instantaneous answer that relax, their times, and where on the surface that is remembered.

    Attributes
    ----------
    terms : tuple of (float, float)
        (γ_i, τ_i): share, in (0, 1), and relaxation time in s, positive. The shares sum to less than 1.
    pad : float
        U_a in J; 0 for a body without a pad, or with shares that were seen through it.
    patches : Patches, optional
        Where on the surface memory is kept. By default one memory that travels with the probe, which knows nothing
        of fresh material under a sliding probe.

    Raises
    ------
    UsageError
        For a share or a time that isn't positive and finite, shares that leave nothing, or a negative pad.
    """

    name: ClassVar[str] = "relaxation"

    terms: tuple[tuple[float, float], ...]
    pad: float = 0.0
    patches: Patches | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "terms", tuple(_pair(term) for term in self.terms))
        if not self.equilibrium > 0:
            raise UsageError(
                f"The shares of the branches sum to {math.fsum(self.shares):g}.",
                why="They are shares of the instantaneous force; a body that holds a probe up keeps some for ever.",
                fix="Give shares that sum to less than 1.",
            )
        if not 0 <= self.pad < math.inf:
            raise UsageError(
                f"A pad's energy can't be {self.pad} J.", fix="Give 0, or a positive energy in J."
            )

    def c_source(self) -> str:
        """Return the step in C99."""
        return Path(__file__).with_suffix(".c").read_text("utf-8")

    def c_arguments(self) -> tuple[np.ndarray, ...]:
        """Return the arrays of that step."""
        patches = self.patches or Patches.single()
        shares, times, pad = self.compiled()
        law = np.array([patches.width, math.sqrt(2 * patches.energy), patches.least])
        return patches.points, law, shares, times, np.array([pad])

    def c_size(self) -> int:
        """Return how many numbers the state of that step has, after the four of the ledger."""
        patches, terms = len(self.patches or Patches.single()), len(self.terms)
        return 1 + patches * (3 + terms) + 3 * terms

    def c_states(self) -> tuple[tuple[str, ...], ...]:
        """Return the names of z_ij, a group for each patch j."""
        patches, branches = len(self.patches or Patches.single()), range(1, 1 + len(self.terms))
        return tuple(tuple(f"z_{j + 1}_{i}" for i in branches) for j in range(patches))

    def start(self) -> RelaxationState:
        """Return the state of a body at rest."""
        return RelaxationState(self)

    def spread(self, patches: Patches, spacing: float) -> Relaxation:
        """Return the same memory, kept on patches of the surface."""
        del spacing
        return replace(self, patches=patches)

    def carry_from(self, other: Memory) -> Carry:
        """Return how remembered amplitudes are taken over: from the branch of nearest time, at the nearest place.

        Where several places take over from one they share its energy; no place has more than it was given.

        Raises
        ------
        UsageError
            If the other memory is no relaxation, or one travels with the probe and the other doesn't.
        """
        if not isinstance(other, Relaxation):
            return super().carry_from(other)
        if (self.patches is None) != (other.patches is None):
            raise UsageError(
                "What a relaxing body remembers at places of its surface can't be handed on to one memory that "
                "travels with the probe, nor the other way round.",
                fix="Give both bodies places that remember, or neither.",
            )
        if self.patches is None or other.patches is None:
            place, part = np.zeros(1, dtype=np.int64), np.ones(1)
        else:
            place = nearest_points(self.patches.points, other.patches.points)
            part = 1.0 / np.sqrt(np.bincount(place, minlength=len(other.patches))[place])
        times = np.log(other.times)
        branch = np.array(
            [int(np.argmin(np.abs(times - math.log(t)))) for t in self.times if len(times)], int
        )

        def carry(old: Any, new: Any) -> None:
            new.take_over(old, place, part, branch)

        return carry

    def __str__(self) -> str:
        if not self.terms:
            return "does not relax"
        return "relaxes by " + " and ".join(f"{share:.4g} in {time:.4g} s" for share, time in self.terms)

    @property
    def shares(self) -> tuple[float, ...]:
        """γ_i, pure numbers."""
        return tuple(share for share, _ in self.terms)

    @property
    def times(self) -> tuple[float, ...]:
        """τ_i in s."""
        return tuple(time for _, time in self.terms)

    @property
    def equilibrium(self) -> float:
        """γ_∞, the share that never relaxes."""
        return 1.0 - math.fsum(self.shares)

    def body_share(self, energy: Any) -> np.ndarray:
        """β², the body's share of the compliance, at elastic energies in J of any shape; 1 without a pad."""
        energy = np.asarray(energy, dtype=float)
        if self.pad == 0:
            return np.ones_like(energy)
        ratio = np.power(energy / self.pad, 1 / 6)
        return np.asarray(ratio / (1 + ratio))

    def relaxation(self, time: Any, energy: float | None = None) -> np.ndarray:
        """g(t), the share of a held force that is left, for times in s of any shape.

        Parameters
        ----------
        time : array_like
            Since a sudden press, s.
        energy : float, optional
            Elastic energy at the held position, J, on which g depends if there is a pad. By default the limit of
            deep presses.
        """
        time = np.asarray(time, dtype=float)
        if not self.terms:
            return np.ones_like(time)
        body = 1.0 if energy is None else float(self.body_share(energy))
        rates, amplitudes = self._modes(body)
        fallen = (1.0 - np.exp(-np.multiply.outer(time, rates))) @ amplitudes
        return np.asarray((1.0 - fallen) * (1.0 - fallen * (1.0 - body) / 6.0))

    def _modes(self, body: float) -> tuple[np.ndarray, np.ndarray]:
        """Rates (n,) in 1/s and amplitudes (n,) of the exponentials in u, at a share β² of the body."""
        shares, times, _ = self.compiled()
        # A is similar to a symmetric matrix by diag(√(γ τ))
        root = np.sqrt(shares / times)
        rates, vectors = np.linalg.eigh(np.diag(1 / times) - (1 - body) * np.outer(root, root))
        felt = body / (1 - (1 - body) * shares.sum())
        return rates, felt * (root @ vectors) * (np.sqrt(shares * times) @ vectors)

    def compiled(self) -> tuple[np.ndarray, np.ndarray, float]:
        """γ (n,), τ (n,) in s, and √(2U_a) in √J, as the kernels take them."""
        return np.array(self.shares), np.array(self.times), math.sqrt(2 * self.pad)


def _pair(term: Any) -> tuple[float, float]:
    if not (isinstance(term, Sequence) and not isinstance(term, str) and len(term) == 2):
        raise UsageError(
            f"A branch is {term!r}.",
            why="It must be a pair: the share that relaxes and its relaxation time in s.",
            fix="Pass a tuple of pairs, for example terms=((0.3, 0.1), (0.2, 2.0)).",
        )
    share, time = float(term[0]), float(term[1])
    if not (share > 0 and 0 < time < math.inf):
        raise UsageError(
            f"A branch has the share {share:g} and the time {time:g} s.",
            fix="Both must be positive; leave a branch without a share out.",
        )
    return share, time


class RelaxationState(MemoryState):
    """The state of a body that relaxes; `step` allocates nothing.

    Parameters
    ----------
    relaxation : Relaxation
        Its law.
    """

    def __init__(self, relaxation: Relaxation) -> None:
        super().__init__()
        patches = relaxation.patches or Patches.single()
        shares, times, pad = relaxation.compiled()
        count, n = len(patches), len(shares)
        self.relaxation, self.patches = relaxation, patches
        # amplitudes asked, remembered, whether there are any, and the last q
        self._state = (np.zeros(count), np.zeros((count, n)), np.zeros(count, dtype=np.bool_), np.zeros(1))
        self._work = (np.zeros(count), np.zeros(4), np.zeros(2), np.zeros((3, n)))
        law = np.array([patches.width, math.sqrt(2 * patches.energy), patches.least])
        self._constants = (patches.points, law, shares, times, pad)
        self.step(np.zeros(3), 0.0, np.zeros(3), 0.0)  # compile now, not in the loop
        self.reset()

    def __repr__(self) -> str:
        return f"RelaxationState: {self.relaxation}, {self.patches}; force {self.force} N, stored {self.stored:.3g} J"

    def reset(self) -> None:
        """Forget everything: the probe is outside, the body at rest."""
        super().reset()
        for array in self._state:
            array[...] = 0

    def take_over(
        self, other: RelaxationState, place: np.ndarray, part: np.ndarray, branch: np.ndarray
    ) -> None:
        """Go on with what another body remembers.

        Parameters
        ----------
        other : RelaxationState
            Of that body.
        place : (M,) int
            Which of its places each place takes over from.
        part : (M,)
            By what its amplitudes there are multiplied, at most 1.
        branch : (n,) int
            Which of its branches each branch takes over from; (0,) where it has none.
        """
        asked, remembered, awake, last = other._state
        self._state[0][:] = part * asked[place]
        if len(branch):
            self._state[1][:] = part[:, None] * remembered[place][:, branch]
        self._state[2][:] = awake[place]
        self._state[3][:] = last

    def step(self, position: np.ndarray, amplitude: float, slope: np.ndarray, dt: float) -> bool:
        """Move the probe to a place within dt seconds and renew `force`; see `MemoryState.step`.

        Raises
        ------
        UsageError
            If position or slope is no array.
        """
        if not (isinstance(position, np.ndarray) and isinstance(slope, np.ndarray)):
            raise UsageError(
                "A step takes position and slope as arrays of float64.",
                why="It runs a thousand times a second, and converts nothing.",
                fix="Pass for example np.array([0.0, 0.0, 0.046]).",
            )
        own = self.force, self._ledger, self._state, self._work, self._constants
        return bool(step_into(position, amplitude, slope, dt, *own))


@dataclass(frozen=True, eq=False)
class Course:
    """The forces and energies of a motion.

    Attributes
    ----------
    force : (N, 3)
        On the probe, N.
    stored, lost, work : (N,)
        Energy stored, turned into heat so far, and put in by the hand so far, J.
    """

    force: np.ndarray
    stored: np.ndarray
    lost: np.ndarray
    work: np.ndarray


def course(
    memory: MemoryState, times: np.ndarray, positions: np.ndarray, energies: np.ndarray, slopes: np.ndarray
) -> Course:
    """Lead a memory, from rest at time 0, along samples of a motion.

    Parameters
    ----------
    memory : MemoryState
        It is reset first.
    times : (N,)
        Ascending, s, not before 0.
    positions : (N, 3)
        Places, m.
    energies : (N,)
        Elastic energies U there, J.
    slopes : (N, 3)
        Their slopes ∇U, N.

    Raises
    ------
    UsageError
        If the arrays don't fit together, time doesn't ascend, or a number isn't finite.
    """
    times, positions = np.asarray(times, dtype=float), np.asarray(positions, dtype=float)
    steps = np.diff(times, prepend=0.0)
    shapes = {np.shape(positions), np.shape(slopes), (*np.shape(energies), 3), (*np.shape(times), 3)}
    if shapes != {(len(times), 3)} or not (steps >= 0).all():
        raise UsageError(
            "These samples are no motion.",
            why=f"Shapes are {times.shape}, {positions.shape}, {np.shape(energies)}, {np.shape(slopes)}.",
            fix="Give times (N,) that ascend from 0, positions (N, 3), energies (N,) and slopes (N, 3).",
        )
    q, by_place = amplitudes(energies, slopes)
    memory.reset()
    force, ledger = np.empty((len(times), 3)), np.empty((len(times), 3))
    for k, dt in enumerate(steps):
        if not memory.step(positions[k], float(q[k]), by_place[k], float(dt)):
            raise UsageError(f"Sample {k} has a number that isn't finite.")
        force[k] = memory.force
        ledger[k] = memory.stored, memory.lost, memory.work
    return Course(force, *ledger.T)
