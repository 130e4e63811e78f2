"""Errors of forces: before, after, and on measurements that were left out."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from palpate.format import share
from palpate.surrogates import LearntEnergy

__all__ = ["ForceError", "felt_along", "force_error"]

FELT = 0.05  # of the largest force: relative errors are of touches above it


@dataclass(frozen=True)
class ForceError:
    """Errors of N measured touches."""

    count: int  # touches in contact, by the model or by the sensor
    rms: float  # root mean square of ‖error‖, N
    relative: float  # that over the root mean square of the measured force
    median: float  # median of ‖error‖/‖force‖ over touches of more than a twentieth of the largest force
    p95: float  # 95th percentile of the same

    def __str__(self) -> str:
        return (
            f"{1e3 * self.rms:.3g} mN rms ({share(self.relative)}), of felt touches "
            f"{share(self.median)} median, {share(self.p95)} p95"
        )

    def as_dict(self) -> dict[str, float]:
        """Return the errors by name."""
        return dict(vars(self))


def force_error(
    answer: LearntEnergy | tuple[np.ndarray, np.ndarray],
    X: np.ndarray,
    force: np.ndarray,
    along: np.ndarray | None = None,
) -> ForceError:
    """Return the errors of predicted forces at the places of measured ones.

    Parameters
    ----------
    answer : LearntEnergy, or a pair of arrays
        The energy that is asked, or its forces (N, 3) in N and depths (N,) in m.
    X : (N, n)
        Inputs, SI units.
    force : (N, 3)
        Measured forces, N.
    along : (N, 3), optional
        Unit vectors of the only components measured, zeros where all three are, as in `Corrector.observe`.
    """
    predicted, depth = answer if isinstance(answer, tuple) else (answer.force(X), answer.depth(X))
    measured = np.asarray(force)
    if along is not None:
        predicted, measured = felt_along(predicted, along), felt_along(measured, along)
    size, missed = np.linalg.norm(measured, axis=1), np.linalg.norm(predicted - measured, axis=1)
    largest = float(size.max(initial=0.0))
    felt = size > FELT * largest
    touched = (depth > 0) | felt
    if not felt.any():
        return ForceError(int(touched.sum()), _rms(missed), np.nan, np.nan, np.nan)
    ratio = missed[felt] / size[felt]
    rms = _rms(missed[touched])
    quantiles = np.quantile(ratio, [0.5, 0.95])
    return ForceError(
        int(touched.sum()), rms, rms / _rms(size[touched]), float(quantiles[0]), float(quantiles[1])
    )


def felt_along(force: np.ndarray, along: np.ndarray) -> np.ndarray:
    """Return the measured part of forces (N, 3): that along `along` (N, 3) where it has a direction, else all."""
    one = along.any(axis=1, keepdims=True)
    return np.asarray(np.where(one, (force * along).sum(axis=1, keepdims=True) * along, force))


def _rms(sizes: np.ndarray) -> float:
    return float(np.sqrt((sizes**2).mean())) if sizes.size else 0.0
