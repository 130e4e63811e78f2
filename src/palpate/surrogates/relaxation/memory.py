"""Viscoelastic branches on any elastic energy: forces that relax, and never give back more than was put in.

The elastic answer at the probe's centre c is an energy U(c) and its slope ∇U. With q = √(2U), patches of the touched
surface and their patterns e_j(c) (`patches`, Σ e_j² = 1), the probe asks the amplitude φ_j = q e_j of patch j. Each
branch i remembers an amplitude z_ij. The body itself takes the amplitude p_j of least energy, behind its pad and free
to stay deeper than the probe, since tissue doesn't stick:

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
from dataclasses import dataclass

import numpy as np

from palpate.errors import UsageError
from palpate.surrogates.relaxation import kernels
from palpate.surrogates.relaxation.branches import Branches
from palpate.surrogates.relaxation.patches import Patches

__all__ = ["Course", "Memory", "course"]

_STORED, _LOST, _WORK, _STEP = range(4)  # places in the ledger


class Memory:
    """The state of a body that relaxes; `step` allocates nothing.

    Attributes
    ----------
    force : (3,)
        Force on the probe, N; overwritten by each step.

    Parameters
    ----------
    branches : Branches
    patches : Patches, optional
        Where on the surface memory is kept. By default one memory that travels with the probe, which knows nothing
        of fresh material under a sliding probe.
    """

    def __init__(self, branches: Branches, patches: Patches | None = None) -> None:
        patches = Patches.single() if patches is None else patches
        shares, times, pad = branches.compiled()
        count, n = len(patches), len(shares)
        self.branches, self.patches = branches, patches
        self.force, self._ledger = np.zeros(3), np.zeros(4)
        # amplitudes asked, remembered, whether there are any, and the last q
        self._state = (np.zeros(count), np.zeros((count, n)), np.zeros(count, dtype=np.bool_), np.zeros(1))
        self._work = (np.zeros(count), np.zeros(4), np.zeros(2), np.zeros((3, n)))
        law = np.array([patches.width, math.sqrt(2 * patches.energy), patches.least])
        self._constants = (patches.points, law, shares, times, pad)
        self.step(np.zeros(3), 0.0, np.zeros(3), 0.0)  # compile now, not in the loop
        self.reset()

    def __repr__(self) -> str:
        return f"Memory: {self.branches}, {self.patches}; force {self.force} N, stored {self.stored:.3g} J"

    @property
    def stored(self) -> float:
        """V in J: the most that the body can give back."""
        return float(self._ledger[_STORED])

    @property
    def lost(self) -> float:
        """Energy turned into heat since the start, J."""
        return float(self._ledger[_LOST])

    @property
    def lost_in_step(self) -> float:
        """Energy turned into heat in the last step, J; never negative."""
        return float(self._ledger[_STEP])

    @property
    def work(self) -> float:
        """Work of the hand on the body since the start, J; `work` = `stored` + `lost`."""
        return float(self._ledger[_WORK])

    def reset(self) -> None:
        """Forget everything: the probe is outside, the body at rest."""
        for array in (*self._state, self._ledger, self.force):
            array[...] = 0

    def step(self, position: np.ndarray, energy: float, slope: np.ndarray, dt: float) -> bool:
        """Move the probe to a position within dt seconds and renew `force`.

        Parameters
        ----------
        position : (3,) float64
            Centre of the probe at the end of the step, m.
        energy : float
            U there, J; 0 without contact.
        slope : (3,) float64
            ∇U there, minus the elastic force, N.
        dt : float
            Length of the step, s; 0 for an instant.

        Returns
        -------
        bool
            False if a number is not finite or U is negative: the force is zero then and nothing has changed.

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
        return bool(kernels.step_into(position, energy, slope, dt, *own))


@dataclass(frozen=True, eq=False)
class Course:
    """What a motion felt.

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
    memory: Memory, times: np.ndarray, positions: np.ndarray, energies: np.ndarray, slopes: np.ndarray
) -> Course:
    """Lead a memory, from rest at time 0, along samples of a motion.

    Parameters
    ----------
    memory : Memory
        It is reset first.
    times : (N,)
        Ascending, s, not before 0.
    positions : (N, 3)
        m.
    energies : (N,)
        U at the positions, J.
    slopes : (N, 3)
        ∇U at the positions, N.

    Raises
    ------
    UsageError
        If the arrays don't fit together, time doesn't ascend, or a number isn't finite.
    """
    times, energies = np.asarray(times, dtype=float), np.asarray(energies, dtype=float)
    positions, slopes = np.asarray(positions, dtype=float), np.asarray(slopes, dtype=float)
    steps = np.diff(times, prepend=0.0)
    shapes = {positions.shape, slopes.shape, (*energies.shape, 3), (*times.shape, 3)}
    if shapes != {(len(times), 3)} or not (steps >= 0).all():
        raise UsageError(
            "These samples are no motion.",
            why=f"Shapes are {times.shape}, {positions.shape}, {energies.shape}, {slopes.shape}.",
            fix="Give times (N,) that ascend from 0, positions (N, 3), energies (N,) and slopes (N, 3).",
        )
    memory.reset()
    force, ledger = np.empty((len(times), 3)), np.empty((len(times), 3))
    for k, dt in enumerate(steps):
        if not memory.step(positions[k], float(energies[k]), slopes[k], float(dt)):
            raise UsageError(f"Sample {k} has a negative energy or a number that isn't finite.")
        force[k] = memory.force
        ledger[k] = memory.stored, memory.lost, memory.work
    return Course(force, *ledger.T)
