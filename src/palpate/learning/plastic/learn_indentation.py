"""The tables of an indentation, learnt from presses at one place.

With the elastic answer known, U and ∇U at the same positions, a press at one place is a sequence of amplitudes
asked, q = √(2U), and felt, a = q F·(−∇U)/|∇U|². `Indentation` says a = κ(p) (q − p)₊, with p the residual
amplitude that the largest q so far left. First yield, the shares dp/dQ between knots and κ at the knots are found by
least squares on the force (Branch, Coleman & Li 1999), within bounds that keep what `Indentation` promises.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from palpate.errors import UsageError
from palpate.surrogates.memories import Indentation

__all__ = ["Press", "learn_indentation"]

KNOTS = 4  # beyond first yield
LEAST_SHARE, MOST_SHARE = 1e-3, 0.999  # of dp/dQ: an indentation grows, and the elastic part doesn't shrink
SOFTEST, STIFFEST = 0.5, 2.0  # κ: the indentation of a sphere makes contact at most √2 times stiffer


@dataclass(frozen=True, eq=False)
class Press:
    """A press at one place, from the virgin body, beside the elastic answer there.

    Attributes
    ----------
    energy : (N,)
        U of the elastic body at the same positions, J.
    slope : (N, 3)
        ∇U there, N.
    force : (N, 3)
        On the probe, N.
    """

    energy: np.ndarray
    slope: np.ndarray
    force: np.ndarray

    @property
    def asked(self) -> np.ndarray:
        """q (N,) in √J."""
        return np.asarray(np.sqrt(2 * np.maximum(self.energy, 0.0)))

    @property
    def felt(self) -> np.ndarray:
        """a (N,) in √J; 0 without contact."""
        square = (self.slope**2).sum(1)
        along = -(self.force * self.slope).sum(1)
        felt: np.ndarray = np.divide(self.asked * along, square, out=np.zeros_like(square), where=square > 0)
        return felt

    @property
    def weight(self) -> np.ndarray:
        """Force in N per felt amplitude, (N,)."""
        q = self.asked
        steep = np.linalg.norm(self.slope, axis=1)
        weight: np.ndarray = np.divide(steep, q, out=np.zeros_like(q), where=q > 0)
        return weight


def learn_indentation(
    presses: Sequence[Press],
    *,
    points: np.ndarray | None = None,
    width: float = 1.0,
    knots: int = KNOTS,
) -> tuple[Indentation, float]:
    """Learn how a body yields under a probe.

    Parameters
    ----------
    presses : sequence of Press
        With unloading from several depths.
    points : (n, 3), optional
        Where indentations are kept, m; by default one that moves with the probe.
    width : float
        Of an indentation's weights, m; for a sphere of radius R pressed to the depth s about ½ √(R s), half the
        radius of contact.
    knots : int
        Of the tables beyond first yield.

    Returns
    -------
    Indentation, float
        And the root mean square error of the force on the presses, over the largest force.

    Raises
    ------
    UsageError
        If the presses have too few samples in contact.
    """
    from scipy.optimize import least_squares

    samples = sum(int((press.energy > 0).sum()) for press in presses)
    if samples < 2 * knots + 2:
        raise UsageError(
            f"{samples} samples in contact are too few for an indentation of {knots} knots.",
            fix="Press deeper and unload, or ask for fewer knots.",
        )
    top = max(float(press.asked.max()) for press in presses)
    largest = max(float(np.linalg.norm(press.force, axis=1).max()) for press in presses)

    def misses(x: np.ndarray) -> np.ndarray:
        tables = _tables(x, top, knots)
        return np.concatenate(
            [(_felt(press.asked, *tables) - press.felt) * press.weight / largest for press in presses]
        )

    low = np.concatenate([[0.01], np.full(knots, LEAST_SHARE), np.full(knots, SOFTEST)])
    high = np.concatenate([[0.95], np.full(knots, MOST_SHARE), np.full(knots, STIFFEST)])
    starts = [
        np.concatenate([[first], np.full(knots, share), np.ones(knots)])
        for first in (0.1, 0.3)
        for share in (0.3, 0.7)
    ]
    fits = [least_squares(misses, start, bounds=(low, high)) for start in starts]
    best = min(fits, key=lambda fit: float(fit.cost))
    place = np.zeros((1, 3)) if points is None else points
    indentation = Indentation(*_tables(best.x, top, knots), place, width)
    return indentation, float(np.sqrt(np.mean(best.fun**2)))


def _tables(x: np.ndarray, top: float, knots: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """p, Q and κ at the knots, of the share of first yield, the slopes dp/dQ and κ."""
    reach = np.linspace(x[0], 1.0, knots + 1) * top
    residual = np.concatenate([[0.0], np.cumsum(x[1 : 1 + knots] * np.diff(reach))])
    return residual, reach, np.concatenate([[1.0], x[1 + knots :]])


def _felt(asked: np.ndarray, residual: np.ndarray, reach: np.ndarray, table: np.ndarray) -> np.ndarray:
    """a along a press at one place: the largest q so far decides p."""
    p = np.interp(np.maximum.accumulate(asked), reach, residual)
    return np.asarray(np.interp(p, residual, table) * np.maximum(asked - p, 0.0))
