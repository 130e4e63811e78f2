"""One place at a time, without allocation: what the 1 kHz path calls."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from palpate.kernels import for_rows
from palpate.surrogates.arguments import NONE, place_at
from palpate.surrogates.energy_kernels import (
    AMPLITUDE,
    ANSWER,
    FORCE,
    OUTWARD,
    SLOPE,
    STIFFNESS,
    VECTORS,
    trust_at,
)

__all__ = ["EnergyEvaluator"]


class EnergyEvaluator:
    """Evaluates one place at a time into arrays it owns; one evaluator serves one thread at a time.

    Made by `LearntEnergy.evaluator`. Moving a parameter while the hand is in contact changes the energy by no work of
    the hand.

    Attributes
    ----------
    force : (3,)
        F on the hand, N, where the last call evaluated.
    stiffness : (3, 3)
        ∂F/∂x, N/m.
    outward : (3,)
        Slope ∇d of the distance d to a touched surface, of length 1 where d is a distance; zero where nothing is
        touched.
    slope : (3,)
        Slope ∇q of the signed amplitude, √J/m.
    inside : bool
        Whether that was inside the trained region; without contact the answer is exact and counts as inside.

    Parameters
    ----------
    kernel : compiled function
        The baseline's, for one place.
    compiled : tuple
        Of `LearntEnergy.compiled`.
    posterior : tuple
        Root (1 + n + k, z) of the covariance of ℓ's coefficients, (0, 0) without one, and the network of its k units,
        compiled.
    somewhere : (3 + p,)
        A place, m, and parameters, to compile with.
    """

    def __init__(
        self,
        kernel: Callable[..., bool],
        compiled: tuple[Any, ...],
        posterior: tuple[np.ndarray, tuple[Any, ...]],
        somewhere: np.ndarray,
    ) -> None:
        self._kernel, self._answer = kernel, np.zeros(ANSWER)
        self.force, self.stiffness = self._answer[FORCE], self._answer[STIFFNESS].reshape(3, 3)
        self.slope = self._answer[SLOPE]
        self.inside = True
        lines, small = compiled[:2]
        self.outward: np.ndarray = small[VECTORS, OUTWARD]
        self._arguments = (self._answer, *compiled)
        self._shape = (len(somewhere) - 3,)
        root, net = posterior
        axes: np.ndarray = compiled[8]
        # the kernels keep the network's inputs in the first line
        self._posterior = (lines[0], root, np.zeros((4, root.shape[1])), axes, net)
        # compile now, not in the loop
        self(somewhere[:3].copy(), somewhere[3:].copy())

    def __call__(self, position: np.ndarray, parameters: np.ndarray = NONE) -> None:
        """Evaluate at a place; float64 arrays are taken as they are, other sequences are converted.

        Parameters
        ----------
        position : (3,) float64
            The probe's centre, or the displacement of what is held, m.
        parameters : (p,) float64
            The further inputs.

        Raises
        ------
        UsageError
            If there are not three coordinates and p parameters.
        """
        position, parameters = place_at(position, parameters, self._shape)
        self.inside = self._kernel(position, parameters, *self._arguments)

    def trust(self, position: np.ndarray, parameters: np.ndarray = NONE) -> float:
        """Return the standard deviation of the force relative to its size; evaluates there first.

        Zero without a force; not-a-number where there is no posterior, or an input is not finite.

        Raises
        ------
        UsageError
            As a call.
        """
        self(position, parameters)
        return for_rows(trust_at, 1)(self._answer, *self._posterior)  # type: ignore[no-any-return]

    @property
    def energy(self) -> float:
        """U where the last call evaluated, J."""
        return float(self._answer[0])

    @property
    def depth(self) -> float:
        """The baseline's coordinate s where the last call evaluated, m: a probe's depth, or how far a pad has gone."""
        return float(self._answer[1])

    @property
    def amplitude(self) -> float:
        """Signed amplitude q where the last call evaluated, √J: ½ q² is the energy on its baseline."""
        return float(self._answer[AMPLITUDE])

    def __repr__(self) -> str:
        where = "inside" if self.inside else "outside"
        return f"EnergyEvaluator: force {self.force} N at {self.depth:.4g} m, {where} the trained region"
