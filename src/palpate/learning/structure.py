"""How many units a refined network needs: forward growth, judged by the closed-form leave-one-out error."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from palpate.learning.refine import Refined, refine
from palpate.learning.regressors import Tail
from palpate.network import Network, Scaling
from palpate.units import Quantity, Range

__all__ = ["Trial", "refined_network"]


@dataclass(frozen=True)
class Trial:
    """One size that was tried: number of units, leave-one-out error per scaled output, condition number."""

    units: int
    loo: float
    condition: float


def refined_network(
    X: np.ndarray,
    Y: np.ndarray,
    inputs: Sequence[Range],
    outputs: Sequence[Quantity],
    *,
    target: float = 5e-7,
    units_max: int = 6,
    starts: int = 6,
    seed: int = 0,
    known: tuple[np.ndarray, np.ndarray] | None = None,
    tail: Tail = "affine",
) -> tuple[Network, Refined, tuple[Trial, ...]]:
    """The smallest refined network whose leave-one-out error is under the target, or the best up to `units_max`.

    Parameters
    ----------
    X : (N, n)
        Inputs in SI units.
    Y : (N, m)
        Outputs in SI units.
    inputs, outputs : sequences of n ranges and m quantities
    target : float
        Leave-one-out error wanted, relative to the largest deviation of any output from its mean.
    units_max : int
    starts : int
        Starts per size; the cost has many minima.
    seed : int
    known : (centres (h, n), widths (h, n)), optional
        Scaled units that the sequential filter found; they are one of the starts.
    tail : {"affine", "constant", "none"}

    Returns
    -------
    Network, Refined, tuple of Trial
    """
    scaling = Scaling.of(inputs, Y)
    xs, ys = scaling.scale_inputs(X), scaling.scale_outputs(Y)
    best = refine(xs, ys, *_none(xs), tail=tail)
    trials = [Trial(0, best.loo, best.condition)]
    # as many unknowns as samples would interpolate anything and judge nothing
    room = max(0, (len(xs) - 1 - xs.shape[1]) // (1 + 2 * xs.shape[1]))
    for h in _sizes(min(units_max, room)):
        if best.loo <= target:
            break
        found = [refine(xs, ys, *start, tail=tail) for start in _starts(xs, h, starts, seed, known, best)]
        winner = min(found, key=lambda r: r.loo)
        trials.append(Trial(h, winner.loo, winner.condition))
        best = min(best, winner, key=lambda r: r.loo)
    return _network(best, inputs, outputs, scaling), best, tuple(trials)


def _sizes(largest: int) -> list[int]:
    """Every size up to six, then by about a third more each time."""
    sizes = [h for h in (1, 2, 3, 4, 5, 6, 8, 11, 15, 20, 27, 36, 48, 64) if h <= largest]
    return sizes if not sizes or sizes[-1] == largest else [*sizes, largest]


def _none(xs: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    return np.zeros((0, xs.shape[1])), np.ones((0, xs.shape[1]))


def _starts(
    xs: np.ndarray,
    h: int,
    count: int,
    seed: int,
    known: tuple[np.ndarray, np.ndarray] | None,
    best: Refined,
) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Spread-out centres of several widths, random ones, the filter's units, and the last size's and some more."""
    n = xs.shape[1]
    rng = np.random.default_rng((seed, h))
    spacing = 2.0 / h ** (1.0 / n)
    if known is not None and len(known[0]) >= h:
        chosen = _spread(known[0], h)
        yield known[0][chosen], known[1][chosen]
    if 0 < len(best.centres) < h:
        new = h - len(best.centres)
        extra = xs[rng.choice(len(xs), new, replace=False)]
        yield np.vstack([best.centres, extra]), np.vstack([best.widths, np.full((new, n), spacing)])
    for i in range(count):
        rows = _spread(xs, h) if i % 2 == 0 else rng.choice(len(xs), h, replace=False)
        width = spacing * (0.75, 1.0, 1.5, 0.5, 2.0, 1.25)[i % 6]
        yield xs[rows], np.full((h, n), width) * np.exp(rng.normal(0.0, 0.2, (h, n)))


def _spread(points: np.ndarray, count: int) -> np.ndarray:
    """Indices of `count` points far from each other, by farthest-point selection (Gonzalez 1985)."""
    chosen = [int(np.argmin(points.sum(axis=1)))]
    distance = np.full(len(points), np.inf)
    while len(chosen) < count:
        distance = np.minimum(distance, ((points - points[chosen[-1]]) ** 2).sum(axis=1))
        chosen.append(int(np.argmax(distance)))
    return np.array(chosen)


def _network(
    best: Refined, inputs: Sequence[Range], outputs: Sequence[Quantity], scaling: Scaling
) -> Network:
    tail = np.zeros((len(outputs), 1 + len(inputs)))
    tail[:, : len(best.tail)] = best.tail.T
    return Network.axis_aligned(
        inputs,
        outputs,
        centres=best.centres,
        widths=best.widths,
        weights=best.weights.T,
        tail=tail,
        scaling=scaling,
        meta={"loo": best.loo, "condition": best.condition, "refined": True},
    )
