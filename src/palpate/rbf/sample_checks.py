"""Samples as arrays that fit together, or refused in words; and errors relative to how much the outputs vary.

Spread and errors hold in whatever unit: squares of SI numbers may under- or overflow.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from palpate.errors import UsageError
from palpate.tables import numbers_of

__all__ = ["numbers", "relative_error", "samples", "second_derivatives", "spread_of"]


def numbers(what: str, given: Any, shape: tuple[int | None, ...], *, finite: bool = True) -> np.ndarray:
    """Return an array of real numbers, finite if they must be, as float64; None in `shape` is any length but zero.

    `what` is its name, as the message of a UsageError begins.
    """
    found = numbers_of(what, given)
    fits = found.ndim == len(shape) and all(
        f == w or (w is None and f > 0) for f, w in zip(found.shape, shape, strict=True)
    )
    if not fits:
        wanted = ", ".join("any" if w is None else str(w) for w in shape) + ("," if len(shape) == 1 else "")
        raise UsageError(
            f"{what} have shape {found.shape}; ({wanted}) is needed.",
            why="Each row is one sample, each column one input or output.",
            fix="A single column of N numbers is an array of shape (N, 1): Y[:, None].",
        )
    if finite:
        _finite(what, found)
    return found


def samples(
    X: Any,
    Y: Any,
    weights: Any = None,
    slopes: Any = None,
    *,
    slope_weight: Any = 1.0,
    inputs: int | None = None,
    outputs: int | None = None,
    fewest: int = 1,
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray | None, np.ndarray]:
    """Return N samples as float64 arrays that fit together: X, Y, weights, slopes or None, slope weights.

    X (N, n) and Y (N, m) are inputs and outputs, one row a sample; n and m may be known, and N is at least `fewest`.
    The weights (N,) are not negative and one is positive; by default they are ones. Slopes (N, m, n) are ∂Y/∂X, and
    their weights, one number, (N,) or (N, n), are not negative; without slopes they come back as zeros. Samples of no
    weight, and slopes of no weight, count for nothing and need not be finite.
    """
    X = numbers("Inputs X", X, (None, inputs), finite=False)
    Y = numbers("Outputs Y", Y, (None, outputs), finite=False)
    if len(X) != len(Y):
        raise UsageError(
            f"{len(X)} rows of inputs came with {len(Y)} rows of outputs.",
            why="Row i of both is the same sample.",
            fix="Pass X (N, n) and Y (N, m) with the same N.",
        )
    N = len(X)
    w = np.ones(N) if weights is None else _weights("Weights", weights, N)
    s = np.zeros(N) if slopes is None else _weights("Slope weights", slope_weight, N, X.shape[1])
    if slopes is not None:
        slopes = numbers("Slopes", slopes, (N, Y.shape[1], X.shape[1]), finite=False)
        _finite("Slopes", _counting(slopes, w, s))
    known = w > 0
    if not known.any():
        raise UsageError(
            "No sample has a positive weight.",
            why="A weight of zero leaves its sample out.",
            fix="Give one positive weight at least.",
        )
    if known.sum() < fewest:
        raise UsageError(
            f"{known.sum()} samples came, and {fewest} are needed.",
            why="Fewer can't be split into some to learn from and some to judge by.",
            fix=f"Give at least {fewest} samples.",
        )
    _finite("Inputs X", X[known])
    _finite("Outputs Y", Y[known])
    return X, Y, w, slopes, s


def second_derivatives(
    curvatures: Any, curvature_weight: Any, weights: np.ndarray, *, inputs: int, outputs: int
) -> tuple[np.ndarray, np.ndarray]:
    """Return the second derivatives of N samples, and their weights, as float64 arrays that fit the samples.

    Curvatures (N, m, n(n+1)/2) are ∂²y/∂x_i∂x_j, i ≤ j, with weights ≥ 0 of one number, (N,) or (N, n(n+1)/2), and come
    back so; those of no weight, their own or of the samples' `weights` (N,), need not be finite.
    """
    N, count = len(weights), inputs * (inputs + 1) // 2
    c = _weights("Curvature weights", curvature_weight, N, count)
    found = numbers("Curvatures", curvatures, (N, outputs, count), finite=False)
    _finite("Curvatures", _counting(found, weights, c))
    return found, c


def _counting(derivatives: np.ndarray, w: np.ndarray, s: np.ndarray) -> np.ndarray:
    """The derivatives, of (N, m, q), whose weights, w (N,) times s (N,) or (N, q), are positive."""
    each = np.broadcast_to(s if s.ndim > 1 else s[:, None], (len(w), derivatives.shape[2]))
    return np.asarray(derivatives.transpose(0, 2, 1)[(each > 0) & (w > 0)[:, None]])


def _finite(what: str, found: np.ndarray) -> None:
    if not np.isfinite(found).all():
        raise UsageError(
            f"{what} hold numbers that are not finite.",
            why="A failed solve or a broken sensor leaves not-a-number in its row.",
            fix="Leave such rows out (`Dataset.ok` keeps the converged ones).",
        )


def _weights(what: str, given: Any, N: int, columns: int = 0) -> np.ndarray:
    """(N,), or (N, columns) where one came for each column."""
    given = numbers_of(what, given)
    shape = (N, columns) if columns and given.ndim == 2 else (N,)
    found = numbers(what, np.full(N, float(given)) if given.ndim == 0 else given, shape)
    if (found < 0).any():
        raise UsageError(
            f"{what} are negative for {int((found.reshape(N, -1) < 0).any(axis=1).sum())} samples.",
            why="A weight is how many ordinary samples one counts as.",
            fix="Give a sample that is to be left out a weight of zero.",
        )
    return found


def spread_of(Y: np.ndarray) -> float:
    """Root mean square deviation of the outputs Y (N, m) from their means; 1 where they do not vary."""
    size = float(np.abs(Y).max())
    if size == 0.0:
        return 1.0
    scaled = Y / size
    return float(np.sqrt(((scaled - scaled.mean(axis=0)) ** 2).mean())) * size or 1.0


def relative_error(predicted: np.ndarray, Y: np.ndarray, spread: float) -> float:
    """Root mean square error (N, m) over the outputs' spread."""
    return float(np.sqrt((((predicted - Y) / spread) ** 2).mean()))
