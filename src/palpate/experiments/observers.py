"""Simulated observers: people whose threshold is known, to try a plan before anyone sits down."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from palpate import checks
from palpate.experiments.psychometric import JND, Psychometric

__all__ = ["Observer"]

_LEARNT = 0.2  # of a sitting, after which the surplus of a beginner's spread is down to 1/e


@dataclass(frozen=True)
class Observer:
    """A simulated observer.

    Attributes
    ----------
    location : float
        μ, the bias of the signed form, the threshold of the other; in the unit of the levels.
    spread : float
        σ in the unit of the levels, at rest and with experience.
    lapse : float
        Share of the answers that have nothing to do with the stimulus.
    side : float
        Preference of the second interval, b, in the unit of the levels.
    fatigue : float
        Growth of σ by the end of the sitting, as a share; the lapse rate grows by as large a share.
    learning : float
        Surplus of σ at the first trial, as a share; it fades over the first trials.
    """

    location: float = 0.0
    spread: float = 0.2
    lapse: float = 0.02
    side: float = 0.0
    fatigue: float = 0.0
    learning: float = 0.0

    def __post_init__(self) -> None:
        for part in fields(self):
            checks.finite(f"An observer's {part.name}", getattr(self, part.name))
        checks.positive("An observer's spread", self.spread)
        checks.fits("An observer's lapse", self.lapse, least=0.0, below=1.0)
        checks.fits("An observer's fatigue", self.fatigue, least=0.0)
        checks.fits("An observer's learning", self.learning, least=0.0)

    @property
    def jnd(self) -> float:
        """The JND at rest, in the unit of the levels."""
        return JND * self.spread

    def probability(
        self,
        function: Psychometric,
        x: np.ndarray,
        order: np.ndarray,
        progress: float = 0.0,
        location: np.ndarray | float | None = None,
        spread: np.ndarray | float | None = None,
    ) -> np.ndarray:
        """Return the probability (N,) of the answer that p counts, at a time of the sitting from 0 to 1.

        Stimuli x (N,) come in orders ±1 (N,); `location` and `spread` (N,) replace the observer's own where people
        differ.
        """
        mu = self.location if location is None else location
        base = self.spread if spread is None else spread
        tired = 1.0 + self.fatigue * progress
        sigma = base * tired * (1.0 + self.learning * np.exp(-progress / _LEARNT))
        guess = float(np.mean(function.guess))
        return function.probability(
            x, np.asarray(mu), np.asarray(sigma), np.asarray(self.lapse * tired), guess, self.side * order
        )
