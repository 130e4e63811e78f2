"""A record of relaxation: force against time at a held position, looked at before anything is fitted to it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from palpate.errors import UsageError

__all__ = ["Record"]

FEWEST = 8  # samples: two branches and the force that stays have five unknowns
SIGNIFICANT = 4.0  # standard errors


@dataclass(frozen=True, eq=False)
class Record:
    """Force on a probe that was pressed in and is held.

    Attributes
    ----------
    times : (N,)
        Since the press ended, s, ascending, not negative.
    forces : (N,)
        Along one direction, N, positive.
    rise : float
        How long the press took, s; 0 for a sudden one.
    energy : float
        Elastic energy U at the held position, J; only needed to tell a pad.

    Raises
    ------
    UsageError
        If there are too few samples, time doesn't ascend, or the force isn't positive, grows or doesn't relax.
    """

    times: np.ndarray
    forces: np.ndarray
    rise: float = 0.0
    energy: float = 0.0

    def __post_init__(self) -> None:
        for name in ("times", "forces"):
            object.__setattr__(self, name, np.asarray(getattr(self, name), dtype=float))
        if self.times.shape != self.forces.shape or self.times.ndim != 1 or len(self.times) < FEWEST:
            raise UsageError(
                f"{self.times.shape} times and {self.forces.shape} forces are no record of relaxation.",
                fix=f"Give as many forces (N,) as times (N,), at least {FEWEST}.",
            )
        self._check_numbers()
        self._check_fall()

    @property
    def span(self) -> float:
        """Length of the record, s."""
        return float(self.times[-1])

    def gain(self, times: np.ndarray) -> np.ndarray:
        """Share of a branch's force that an even press of `rise` seconds leaves at its end, for times τ in s."""
        x = self.rise / times
        return np.asarray(-np.expm1(-x) / x if self.rise > 0 else np.ones_like(x))

    def _check_numbers(self) -> None:
        if not (np.isfinite(self.times).all() and np.isfinite(self.forces).all()):
            raise UsageError("The record holds a number that isn't finite.", fix="Leave those samples out.")
        back = np.flatnonzero(np.diff(self.times) <= 0)
        if len(back) or self.times[0] < 0:
            at = int(back[0]) + 1 if len(back) else 0
            raise UsageError(
                f"Time doesn't ascend at sample {at}, {self.times[at]:g} s.",
                fix="Give times since the end of the press, sorted, each once.",
            )
        if not (self.forces.mean() > 0 and self.rise >= 0):
            raise UsageError(
                f"The mean force is {self.forces.mean():g} N after a press of {self.rise:g} s.",
                fix="Give the force on the probe along the direction that it pushes back, and a rise ≥ 0 s.",
            )

    def _check_fall(self) -> None:
        count = max(1, len(self.times) // 5)
        fall = self.forces[:count].mean() - self.forces[-count:].mean()
        doubt = SIGNIFICANT * self._noise() * np.sqrt(2 / count) + 1e-9 * np.abs(self.forces).max()
        if fall < -doubt:
            raise UsageError(
                f"The force grows by {-fall:.3g} N over the record.",
                why="A body that is held relaxes; a force that grows is drift, a moving probe or drying tissue.",
                fix="Check that position is held, and subtract the sensor's drift.",
            )
        if fall <= doubt:
            raise UsageError(
                f"The force falls by {fall:.3g} N over {self.span:.3g} s, which its noise hides.",
                fix="Record longer, press deeper, or treat the body as elastic: Relaxation(()).",
            )

    def _noise(self) -> float:
        """Standard deviation of a sample, from what a straight line through its neighbours leaves, N."""
        t, f = self.times, self.forces
        share = (t[1:-1] - t[:-2]) / (t[2:] - t[:-2])
        rest = f[1:-1] - (1 - share) * f[:-2] - share * f[2:]
        # the median isn't moved by the steep start
        return float(np.median(np.abs(rest) / np.sqrt(1 + share**2 + (1 - share) ** 2)) / 0.6745)
