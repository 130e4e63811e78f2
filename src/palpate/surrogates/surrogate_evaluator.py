"""One touch at a time, without allocation: what the 1 kHz path calls."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from palpate.surrogates.arguments import NONE, touch_at
from palpate.surrogates.touch_kernels import ANSWER, FORCE, STIFFNESS, VECTORS, touch_into
from palpate.surrogates.touch_trust import trust_at

__all__ = ["SurrogateEvaluator"]


class SurrogateEvaluator:
    """Evaluates one touch at a time into arrays it owns; one evaluator serves one thread at a time.

    Made by `TouchSurrogate.evaluator`.

    Attributes
    ----------
    force : (3,)
        F on the probe, N, where the last call evaluated.
    stiffness : (3, 3)
        ∂F/∂c, N/m.
    outward : (3,)
        ∇d there, of length 1 where the distance d to the touched surface is one.
    inside : bool
        Whether that was inside the trained region; without contact the answer is exact and counts as inside.

    Parameters
    ----------
    compiled : tuple
        Of `TouchSurrogate.compiled`.
    posterior : tuple
        Root (1 + n + k, z) of the covariance of ℓ's coefficients, (0, 0) without one, and the network of its k units,
        compiled.
    somewhere : n numbers
        An input of the surrogate.
    """

    _kernel: Callable[..., bool] = staticmethod(touch_into)

    def __init__(
        self,
        compiled: tuple[Any, ...],
        posterior: tuple[np.ndarray, tuple[Any, ...]],
        somewhere: Sequence[float],
    ) -> None:
        self._answer = np.zeros(ANSWER)
        self.force, self.stiffness = self._answer[FORCE], self._answer[STIFFNESS].reshape(3, 3)
        self.inside = True
        self.outward: np.ndarray = compiled[1][VECTORS, 0]
        self._arguments = (self._answer, *compiled)
        self._shape = (len(somewhere) - 3,)
        x: np.ndarray = compiled[0][0]  # the kernels keep the whole input there
        root, net = posterior
        self._posterior = (x, root, np.zeros((4, root.shape[1])), net)
        # compile now, not in the loop
        self.trust(np.array(somewhere[:3], dtype=float), np.array(somewhere[3:], dtype=float))

    def __call__(self, position: np.ndarray, parameters: np.ndarray = NONE) -> None:
        """Evaluate at a centre; float64 arrays are taken as they are, other sequences are converted.

        Parameters
        ----------
        position : (3,) float64
            The probe's centre c, m.
        parameters : (p,) float64
            The further inputs.

        Raises
        ------
        UsageError
            If there are not three coordinates and p parameters.
        """
        position, parameters = touch_at(position, parameters, self._shape)
        self.inside = self._kernel(position, parameters, *self._arguments)

    def trust(self, position: np.ndarray, parameters: np.ndarray = NONE) -> float:
        """Standard deviation of the force relative to its size; evaluates there first.

        Zero without contact, where the answer is exact; not-a-number in contact where the surrogate has no
        posterior, or an input is not finite.

        Raises
        ------
        UsageError
            As a call.
        """
        self(position, parameters)
        return trust_at(self._answer, *self._posterior)

    @property
    def energy(self) -> float:
        """U where the last call evaluated, J."""
        return float(self._answer[0])

    @property
    def depth(self) -> float:
        """s where the last call evaluated, m; negative without contact."""
        return float(self._answer[1])

    def __repr__(self) -> str:
        where = "inside" if self.inside else "outside"
        return f"SurrogateEvaluator: force {self.force} N at depth {self.depth:.4g} m, {where} the trained region"
